//! `holdsafe ablate`: every attack with each check, guard and rule waived in turn, on the same seeds as with it; then
//! pairs of them; and the cost of each without an attack.
//!
//! Every variation is first run a few times without each check. Where a decision differs in any of these, it is run in
//! full; where none does, only the bound on the rate of differences is given. Pairs are run where one of the two
//! changed a decision and neither alone lets the attack through: of two checks in a row, the one that judges first
//! changes a decision when it is waived.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use evidence::ablation::{Gain, Switch};
use evidence::trial::{Outcome, Trial};
use parallel::progress::Progress;
use results::mode::Mode;
use results::report::{Ablation, AttackRow, CheckRow, Compared, Defects, Overlap, Quiet, Summary, ablation_table};
use runner::batch::Batch;
use runner::closing::Closing;
use runner::failure::{Exit, Failure};
use runner::guest_options::NoGuest;
use runner::parts::Parts;
use runner::plan::{PlanOptions, Planned};
use runner::trial_store::{Shelf, TrialStore};
use runner::{Context, batch, out, plan};
use scenario::Scenario;
use stats::paired::Paired;

use super::emit::{Shares, tell_kept};

/// Seconds of one quiet trial.
const QUIET_TRIAL_S: f64 = 600.0;
/// Quiet trials an hour.
const QUIET_TRIALS: u64 = 6;
/// Loss on the telemetry link in the quiet hours.
const QUIET_LOSS: f64 = 0.02;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Attacks, by name or by file; without any, every shipped scenario.
    #[arg(value_name = "SCENARIO")]
    scenarios: Vec<String>,
    #[command(flatten)]
    _no_guest: NoGuest,
    /// Pairs of trials of each attack and check where anything differs.
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    trials: u64,
    /// Pairs after which an attack and a check without any difference are left.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    screen: u64,
    /// Trials of each attack without two checks; 0 leaves pairs of checks out.
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u64).range(0..=100_000))]
    pairs: u64,
    /// Simulated hours of the null attack at 2 % loss, with each check and without; 0 leaves them out.
    #[arg(long, value_name = "H", default_value_t = 1, value_parser = clap::value_parser!(u64).range(0..=1_000))]
    hours: u64,
    /// Only these, by their place in a policy file, such as boundary.freshness,guards.lease.
    #[arg(long, value_delimiter = ',', value_name = "CHECK")]
    only: Vec<String>,
    /// With rendered sensors and the detector.
    #[arg(long)]
    rendered: bool,
    #[command(flatten)]
    parts: Parts,
    /// Keep finished trials and the result here, and resume from there [default: runs/ablation].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl Args {
    /// Its pieces of work for partitions.
    pub(super) fn shares(&self, context: &Context) -> Result<Shares, Failure> {
        let set = self.parts.partition.is_some() || !self.parts.from.is_empty() || self.out.is_some();
        let pieces = attacks(context, self, &switches(self)?)?.len() as u64;
        Ok(Shares { pieces, of: "attacks", threads: self.parts.threads, set, rounds: false })
    }
}

/// A variation of a scenario, with the checks that its policy does not waive anyway.
struct Attack {
    base: Planned,
    switches: Vec<Switch>,
}

/// The trials of one attack, with everything and without each check.
struct Tried {
    base: Vec<Trial>,
    without: BTreeMap<Switch, Vec<Trial>>,
}

/// Settings under which the trials run.
struct Bench<'a> {
    context: &'a Context,
    kept: TrialStore,
    threads: usize,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let switches = switches(args)?;
    let attacks = attacks(context, args, &switches)?;
    let default = context.runs_folder()?.join("ablation");
    let dir = out::directory(&default, Some(args.out.as_deref().unwrap_or(&default)), "ablation")?;
    let bench =
        Bench { context, kept: TrialStore::open(&dir)?.with_parts(&args.parts.from)?, threads: args.parts.threads() };
    let bases: Vec<Planned> = attacks.iter().map(|attack| attack.base.clone()).collect();
    out::write_manifest(&dir, &out::Manifest::new(context, &bases)?)?;

    let tried = bench.each(args, &attacks)?;
    let mut exit = Exit::Fine;
    for (attack, tried) in attacks.iter().zip(&tried) {
        exit = batch::graver(exit, batch::judge(Mode::Twin, std::slice::from_ref(&attack.base), &tried.base));
    }
    let overlaps = if args.pairs > 0 { bench.overlaps(args, &attacks, &tried)? } else { Vec::new() };
    let mut quiet = if args.hours > 0 { bench.quiet(args, &switches)? } else { BTreeMap::new() };
    if args.parts.partition.is_some() {
        tell_kept(context, &dir)?;
        return Ok(Exit::Fine);
    }
    let rows = switches.iter().map(|switch| check_row(*switch, &attacks, &tried, quiet.remove(switch))).collect();
    let compared = Compared {
        seed: context.seed,
        build: bench.kept.build().to_owned(),
        attacks: attacks.len(),
        trials: args.trials,
        screened: args.screen.min(args.trials),
    };
    let ablation = Ablation::new(compared, rows, overlaps);
    out::write_result(&dir, "ablation.json", "ablation", &ablation)?;
    if context.json {
        out::print_json("ablation", &ablation)?;
    } else {
        out::show(ablation_table(&ablation));
    }
    close(context, &ablation, &dir);
    Ok(exit)
}

/// Summary, and the check that lets most through.
fn close(context: &Context, ablation: &Ablation, dir: &Path) {
    let through = |check: &CheckRow| check.attacks.iter().filter(|row| row.gain.lets_through()).count();
    let worth = ablation.checks.iter().filter(|check| through(check) > 0).count();
    let checks = format!("{worth} of {} checks needed alone", ablation.checks.len());
    let Defects { n, found, .. } = ablation.defects;
    let worst = ablation.checks.iter().filter(|check| through(check) > 0).max_by_key(|check| through(check));
    let attack = worst.and_then(|check| Some((check, check.attacks.iter().find(|row| row.gain.lets_through())?)));
    let folder = context.free_folder("ablation");
    let alone = |(check, row): (&CheckRow, &AttackRow)| {
        let terms = ["--trials", "3", "--hours", "0", "--out", &folder];
        context.command(["ablate", &row.scenario, "--only", &check.check].into_iter().chain(terms))
    };
    let other = attack.map_or_else(|| context.citation_of(dir), alone);
    let closing = Closing::new(context).part(checks).part(format!("{found} of {n} seeded defects noticed"));
    closing.print([context.report_of(dir), other]);
}

fn switches(args: &Args) -> Result<Vec<Switch>, Failure> {
    let all = Switch::all();
    let known: Vec<String> = all.iter().map(|switch| switch.name()).collect();
    if let Some(none) = args.only.iter().find(|only| !known.contains(only)) {
        return Err(Failure::new(Exit::Usage, format!("no check `{none}`; there are: {}", known.join(", "))));
    }
    Ok(all.into_iter().filter(|switch| args.only.is_empty() || args.only.contains(&switch.name())).collect())
}

fn attacks(context: &Context, args: &Args, switches: &[Switch]) -> Result<Vec<Attack>, Failure> {
    let scenarios: Vec<Scenario> = if args.scenarios.is_empty() {
        context.catalogue()?.1
    } else {
        let load = |name: &String| Ok(context.scenario(&plan::file_of(context, name)?)?);
        args.scenarios.iter().map(load).collect::<Result<_, Failure>>()?
    };
    let mut attacks = Vec::new();
    // The stacks in memory have no platform and no policy.
    for scenario in scenarios.iter().filter(|scenario| !scenario.is_of_stacks()) {
        for base in
            plan::of_scenario(context, scenario, &PlanOptions { rendered: args.rendered, ..PlanOptions::default() })?
        {
            let is_required = |switch: &&Switch| !switch.is_waived(&base.setup.policy);
            attacks.push(Attack { switches: switches.iter().filter(is_required).copied().collect(), base });
        }
    }
    // The trials of an attack depend on each other, so a partition runs all of some attacks.
    let held = attacks.into_iter().zip(0..).filter(|(_, number)| args.parts.holds(*number));
    Ok(held.map(|(attack, _)| attack).collect())
}

impl Attack {
    /// Plans with all checks, and then without each of `switches`.
    fn planned(&self, switches: &[Switch]) -> Vec<Planned> {
        let ablations = switches.iter().map(|switch| self.waive(&[*switch]));
        [self.base.clone()].into_iter().chain(ablations).collect()
    }

    fn waive(&self, switches: &[Switch]) -> Planned {
        waive(&self.base, switches)
    }

    fn expected(&self) -> &[Outcome] {
        &self.base.variation.scenario.expected
    }

    fn name(&self) -> (String, Option<String>) {
        (self.base.variation.scenario.name.as_str().to_owned(), self.base.variation.cell.clone())
    }
}

/// The scenario with `switches` waived, under a name that says so wherever it is shown.
fn waive(base: &Planned, switches: &[Switch]) -> Planned {
    let mut planned = base.clone();
    switches.iter().for_each(|switch| switch.waive(&mut planned.setup.policy));
    let names: Vec<String> = switches.iter().map(|switch| switch.name()).collect();
    let waived = format!("without {}", names.join(" and "));
    planned.setup.policy_name = format!("{} {waived}", base.setup.policy_name);
    let cell = base.variation.cell.as_ref().map(|cell| format!("{cell} "));
    planned.variation.cell = Some(cell.unwrap_or_default() + &waived);
    let scenario = base.variation.scenario.name.as_str();
    let rendered = if base.setup.rendered { " --rendered" } else { "" };
    planned.command = Some(format!("holdsafe ablate {scenario} --trials 1 --only {}{rendered}", names.join(",")));
    planned
}

impl Tried {
    /// The trials of an attack with everything, then without each of `switches`.
    fn new(switches: &[Switch], trials: Vec<Vec<Trial>>) -> Tried {
        let mut trials = trials.into_iter();
        let base = trials.next().unwrap_or_default();
        Tried { base, without: switches.iter().copied().zip(trials).collect() }
    }

    /// Gain of the attack without `switch`.
    fn gain(&self, switch: Switch, expected: &[Outcome]) -> Option<Gain> {
        let ablated_trials: Vec<&Trial> = self.without.get(&switch)?.iter().collect();
        Some(Gain::from_pairs(&self.base.iter().collect::<Vec<_>>(), &ablated_trials, expected))
    }
}

impl Bench<'_> {
    /// Every attack with everything and without each check.
    fn each(&self, args: &Args, attacks: &[Attack]) -> Result<Vec<Tried>, Failure> {
        let plan = |attack: &Attack| (attack.planned(&attack.switches), args.screen.min(args.trials));
        let screened = self.run("screening", attacks.iter().map(plan).collect())?;
        let of = |(attack, trials): (&Attack, _)| Tried::new(&attack.switches, trials);
        let screened: Vec<Tried> = attacks.iter().zip(screened).map(of).collect();
        let differing = |(attack, tried): (&Attack, &Tried)| {
            let differs = |s: &&Switch| tried.gain(**s, attack.expected()).is_some_and(|gain| gain.changed > 0);
            attack.switches.iter().filter(differs).copied().collect::<Vec<_>>()
        };
        let differing: Vec<Vec<Switch>> = attacks.iter().zip(&screened).map(differing).collect();
        let plan = |(attack, switches): (&Attack, &Vec<Switch>)| (attack.planned(switches), args.trials);
        let full = self.run("ablation", attacks.iter().zip(&differing).map(plan).collect())?;
        let merge = |((switches, trials), screened): ((&Vec<Switch>, _), Tried)| {
            let mut tried = Tried::new(switches, trials);
            // Checks without any difference have only their screening trials; the others were run in full.
            for (switch, trials) in screened.without {
                tried.without.entry(switch).or_insert(trials);
            }
            tried
        };
        Ok(differing.iter().zip(full).zip(screened).map(merge).collect())
    }

    /// Two checks waived together, where neither alone let the attack through.
    fn overlaps(&self, args: &Args, attacks: &[Attack], tried: &[Tried]) -> Result<Vec<Overlap>, Failure> {
        let pairs: Vec<Vec<[Switch; 2]>> = attacks.iter().zip(tried).map(|(a, t)| candidates(a, t)).collect();
        let plan = |(attack, pairs): (&Attack, &Vec<[Switch; 2]>)| {
            let both = pairs.iter().map(|pair| attack.waive(pair));
            (both.collect::<Vec<_>>(), args.pairs)
        };
        let ran = self.run("pairs", attacks.iter().zip(&pairs).map(plan).collect())?;
        let mut overlaps = Vec::new();
        for (((attack, tried), pairs), ran) in attacks.iter().zip(tried).zip(pairs).zip(ran) {
            let base: Vec<&Trial> = tried.base.iter().take(args.pairs as usize).collect();
            for (pair, trials) in pairs.into_iter().zip(ran) {
                let gain = Gain::from_pairs(&base, &trials.iter().collect::<Vec<_>>(), attack.expected());
                if gain.lets_through() {
                    let (scenario, cell) = attack.name();
                    let without = tally(&trials);
                    overlaps.push(Overlap { checks: pair.map(Switch::name), scenario, cell, without, gain });
                }
            }
        }
        Ok(overlaps)
    }

    /// The null attack on a lossy link with everything and without each check.
    fn quiet(&self, args: &Args, switches: &[Switch]) -> Result<BTreeMap<Switch, Quiet>, Failure> {
        let nominal = scenario::load(&plan::file_of(self.context, "nominal")?)?;
        let soak = nominal.soak(QUIET_TRIAL_S, QUIET_LOSS);
        let planned = plan::of_scenario(self.context, &soak, &PlanOptions::default())?;
        let Some(base) = planned.into_iter().next() else {
            return Err(Failure::internal("`nominal` has no variation"));
        };
        let all = [base.clone()].into_iter().chain(switches.iter().map(|switch| waive(&base, &[*switch])));
        let held = all.zip(0..).filter(|(_, number)| args.parts.holds(*number)).map(|(planned, _)| planned).collect();
        let ran = self.run("quiet hours", vec![(held, args.hours * QUIET_TRIALS)])?;
        let summaries: Vec<Summary> =
            ran.iter().flatten().map(|trials| Summary::from_trials(&trials.iter().collect::<Vec<_>>())).collect();
        // In a partition the first may not be the base: `run` keeps its trials and drops this comparison.
        let Some((summary, ablated_summaries)) = summaries.split_first() else { return Ok(BTreeMap::new()) };
        Ok(switches
            .iter()
            .zip(ablated_summaries)
            .map(|(switch, ablated_summary)| (*switch, Quiet::from_summaries(summary, ablated_summary)))
            .collect())
    }

    /// Runs `n` trials of each variation; for each list of them, for each variation, its trials.
    fn run(&self, label: &str, plans: Vec<(Vec<Planned>, u64)>) -> Result<Vec<Vec<Vec<Trial>>>, Failure> {
        let seed = self.context.seed;
        let mut missing = 0;
        for (planned, n) in &plans {
            missing += self.shelves(planned)?.iter().map(|shelf| shelf.missing(seed, *n)).sum::<usize>();
        }
        let progress = Progress::new(label, missing, self.context.talk);
        let mut all = Vec::new();
        for (planned, n) in plans {
            let batch = Batch { label, mode: Mode::Twin, planned: &planned, n, seed, jobs: 1, out: None };
            let trials = batch.run_kept(&self.shelves(&planned)?, self.threads, &progress, &self.context.stop)?;
            all.push(trials.chunks(n.max(1) as usize).map(<[Trial]>::to_vec).collect());
        }
        progress.finish();
        Ok(all)
    }

    fn shelves(&self, planned: &[Planned]) -> Result<Vec<Shelf>, Failure> {
        planned.iter().map(|planned| self.kept.shelf(Mode::Twin, planned)).collect()
    }
}

/// Pairs without which an attack may get through, though it does not without either alone.
fn candidates(attack: &Attack, tried: &Tried) -> Vec<[Switch; 2]> {
    let gain = |switch: Switch| tried.gain(switch, attack.expected()).unwrap_or_default();
    let quiet: Vec<(Switch, bool)> = attack
        .switches
        .iter()
        .map(|switch| (*switch, gain(*switch)))
        .filter(|(_, gain)| !gain.lets_through())
        .map(|(switch, gain)| (switch, gain.changed > 0))
        .collect();
    let mut pairs = Vec::new();
    for (i, (a, changed_a)) in quiet.iter().enumerate() {
        let changed = quiet[i + 1..].iter().filter(|(_, changed_b)| *changed_a || *changed_b);
        pairs.extend(changed.map(|(b, _)| [*a, *b]));
    }
    pairs
}

fn check_row(switch: Switch, attacks: &[Attack], tried: &[Tried], quiet: Option<Quiet>) -> CheckRow {
    let row = |(attack, tried): (&Attack, &Tried)| {
        let gain = tried.gain(switch, attack.expected())?;
        let ablated_trials = tried.without.get(&switch)?;
        let (scenario, cell) = attack.name();
        Some(AttackRow {
            scenario,
            cell,
            expected: attack.expected().to_vec(),
            with: tally(&tried.base[..ablated_trials.len().min(tried.base.len())]),
            without: tally(ablated_trials),
            paired: Paired::from_counts(gain.n, gain.through, gain.back),
            gain,
        })
    };
    CheckRow::new(switch.name(), attacks.iter().zip(tried).filter_map(row).collect(), quiet)
}

fn tally(trials: &[Trial]) -> BTreeMap<Outcome, u64> {
    let mut counts = BTreeMap::new();
    trials.iter().for_each(|trial| *counts.entry(trial.outcome).or_insert(0) += 1);
    counts
}
