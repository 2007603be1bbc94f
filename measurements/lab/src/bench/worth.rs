//! `lab search`: detection benchmark of the search: the time until each strategy finds each weakness of a list; or,
//! with `--shrink`, the uniqueness and the length of the minimal cases.
//!
//! The strategies take turns seed by seed, so that all see the same machine. CPU time is that of the trials, each on
//! one thread; that of the run without a sequence is in it where the strategy reads its moments, that of an optimizer's own process is not.
//! It measures and prints; no test asserts its numbers.

use std::path::{Path, PathBuf};

use super::minima;
use crate::report::{StrategyRow, WeaknessRow, WorthObject, worth_table};
use crate::waiting::Wait;
use evidence::SCHEMA_VERSION;
use evidence::trial::Outcome;
use parallel::progress::{Progress, Talk};
use runner::failure::{Exit, Failure};
use runner::optimizer::{self, Optimizer};
use runner::plan::PlanOptions;
use runner::search_config::stopped_or_unfit;
use runner::{Context, batch, out, search_config};
use scenario::{Weakness, Weaknesses};
use search::{Cause, Proposer, RunConfig, RunResult, SearchConfig, Source, Strategy, Tried, ends_in};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// A list of weaknesses [default: every list of scenarios/weaknesses].
    #[arg(long, value_name = "FILE")]
    list: Option<PathBuf>,
    /// Only these of them.
    #[arg(long, value_delimiter = ',', value_name = "NAME")]
    only: Vec<String>,
    /// Only these strategies. CPU and trials are compared with those of `uniform`, where it is one of them.
    #[arg(long, value_delimiter = ',', value_name = "NAME", conflicts_with = "shrink")]
    strategy: Vec<Strategy>,
    /// And this program, which proposes sequences as with `holdsafe search --optimizer`.
    #[arg(long, value_name = "PROGRAM", conflicts_with = "shrink")]
    optimizer: Option<PathBuf>,
    /// Seeds of drawing for each strategy, from 1.
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u64).range(1..=1_000))]
    draws: u64,
    /// Most trials for each seed.
    #[arg(long, value_name = "N", default_value_t = 2_000, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    budget: u64,
    /// In place of comparing strategies: shrink the first finding of each of so many seeds of guided drawing.
    #[arg(long, value_name = "N", conflicts_with = "draws", value_parser = clap::value_parser!(u64).range(1..=1_000))]
    shrink: Option<u64>,
    /// Threads [default: one a core].
    #[arg(long, value_name = "J", value_parser = batch::jobs)]
    jobs: Option<usize>,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let optimizer = args.optimizer.as_deref();
    let bench = Bench { context, optimizer, budget: args.budget, threads: args.jobs.unwrap_or_else(parallel::cores) };
    let chosen = chosen(context, args)?;
    if let Some(seeds) = args.shrink {
        return minima::run(&bench, &chosen, seeds);
    }
    let chosen_by = |strategy: &Strategy| args.strategy.is_empty() || args.strategy.contains(strategy);
    let program = optimizer.map(|program| Source::Program(optimizer::program_name(program)));
    let shipped = Strategy::ALL.into_iter().filter(chosen_by).map(Source::Strategy);
    let strategies: Vec<Source> = shipped.chain(program).collect();
    // A list of which the last does not fit is refused before hours are spent on the others.
    for weakness in &chosen {
        Sought::load(context, weakness.clone())?;
    }
    let hunts = chosen.len() * strategies.len() * args.draws as usize;
    let progress = Progress::new("hunts", hunts, context.talk);
    let mut weaknesses = Vec::new();
    let before = load_average();
    for weakness in chosen {
        weaknesses.push(compared(&bench, &Sought::load(context, weakness)?, &strategies, args.draws, &progress)?);
    }
    progress.finish();
    let object = WorthObject {
        schema_version: SCHEMA_VERSION,
        seed: context.seed,
        draws: args.draws,
        budget: args.budget,
        threads: bench.threads,
        load_average: [before, load_average()],
        weaknesses,
    };
    if context.json {
        out::print_json("bench-search", &object)?;
    } else {
        out::say(format_args!("{}", worth_table(&object)));
    }
    Ok(Exit::Fine)
}

/// Settings shared by all search runs of a bench.
pub(super) struct Bench<'a> {
    pub(super) context: &'a Context,
    /// The program that proposes sequences, for [`Source::Program`].
    pub(super) optimizer: Option<&'a Path>,
    pub(super) budget: u64,
    pub(super) threads: usize,
}

impl Bench<'_> {
    /// One search run for a first finding, on one thread.
    pub(super) fn search(&self, sought: &Sought, source: &Source, seed: u64) -> Result<RunResult, Failure> {
        let strategy = match source {
            Source::Strategy(strategy) => *strategy,
            // It is given the approaches of the run without a sequence, as guided drawing is; their CPU time counts.
            Source::Program(_) => Strategy::Guided,
        };
        let run = RunConfig { strategy, seed, budget: self.budget, first: true };
        let program = self.optimizer.filter(|_| matches!(source, Source::Program(_)));
        let start = |program| Optimizer::start(program, &sought.config, run, &self.context.stop);
        let mut own_optimizer =
            program.map(start).transpose().map_err(|reason| stopped_or_unfit(self.context, reason))?;
        let own = own_optimizer.as_mut().map(|own_optimizer| own_optimizer as &mut dyn Proposer);
        let untold = Progress::new("", 0, Talk::Quiet);
        let result = sought.config.search(run, own, &sought.test(), 1, &untold, &self.context.stop);
        result.map_err(|reason| stopped_or_unfit(self.context, reason))
    }
}

/// A weakness, the search for it, and its controls: the same search with one part of the weakness put right.
pub(super) struct Sought {
    pub(super) weakness: Weakness,
    pub(super) config: SearchConfig,
    controls: Vec<SearchConfig>,
}

impl Sought {
    /// The search for `weakness`, and one control for each of its parts.
    pub(super) fn load(context: &Context, weakness: Weakness) -> Result<Self, Failure> {
        let config = |weakness: &Weakness| search_config::of_weakness(context, weakness, PlanOptions::default());
        let controls = weakness.controls().map(|control| config(&control)).collect::<Result<_, Failure>>()?;
        Ok(Self { config: config(&weakness)?, controls, weakness })
    }

    /// Test for a finding of this weakness: the trial ends in one of its classes, and ends in none of them with any one part put
    /// right. The trials of the controls are not counted: they are part of the measurement, and no strategy learns from them. If one
    /// cannot be run or is INVALID, the trial is no finding.
    pub(super) fn test(&self) -> impl Fn(&Tried) -> Option<Cause> + Sync + '_ {
        let ends = ends_in(&self.weakness.find);
        move |tried| {
            let fine = |control: &SearchConfig| {
                let tried = control.try_sequence(&tried.sequence);
                tried.is_ok_and(|tried| tried.trial.outcome != Outcome::Invalid && ends(&tried).is_none())
            };
            ends(tried).filter(|_| self.controls.iter().all(fine))
        }
    }
}

/// The weaknesses asked for.
fn chosen(context: &Context, args: &Args) -> Result<Vec<Weakness>, Failure> {
    let mut list = match &args.list {
        Some(file) => Weaknesses::load(file)?.weakness.to_vec(),
        None => search_config::weaknesses(context)?,
    };
    let known = || list.iter().map(|weakness| weakness.name.as_str());
    if let Some(unknown) = args.only.iter().find(|name| !known().any(|known| known == name.as_str())) {
        let known: Vec<&str> = known().collect();
        return Err(Failure::new(Exit::Usage, format!("no weakness `{unknown}`; there are: {}", known.join(", "))));
    }
    list.retain(|weakness| args.only.is_empty() || args.only.iter().any(|name| name == weakness.name.as_str()));
    Ok(list)
}

fn compared(
    bench: &Bench<'_>,
    sought: &Sought,
    strategies: &[Source],
    draws: u64,
    progress: &Progress,
) -> Result<WeaknessRow, Failure> {
    let turns: Vec<(u64, &Source)> =
        (1..=draws).flat_map(|seed| strategies.iter().map(move |source| (seed, source))).collect();
    let result = parallel::map(bench.threads, &turns, |(seed, strategy)| {
        let result = bench.search(sought, strategy, *seed)?;
        progress.step();
        Ok::<_, Failure>((*strategy, result))
    })?;
    let of = |strategy: &Source| {
        let hunts = || result.iter().filter(|(by, _)| *by == strategy).map(|(_, result)| result);
        let (trials, cpu_seconds): (Vec<Wait>, Vec<Wait>) = hunts().map(waits).unzip();
        let finding = |result: &RunResult| {
            let (cause, found) = result.found.first_key_value()?;
            let sequence = found.sequence.describe(&sought.config.space);
            Some(format!("{} {}: {sequence}", cause.outcome.name(), cause.broken))
        };
        StrategyRow::new(strategy.clone(), trials, cpu_seconds, hunts().map(finding).collect())
    };
    Ok(WeaknessRow::new(&sought.weakness, strategies.iter().map(of).collect()))
}

/// Trials and CPU seconds until the first finding.
fn waits(result: &RunResult) -> (Wait, Wait) {
    match result.found.values().next() {
        Some(found) => {
            (Wait { waited: found.trial as f64, came: true }, Wait { waited: found.cpu_seconds, came: true })
        }
        None => (Wait { waited: result.trials as f64, came: false }, Wait { waited: result.cpu_seconds, came: false }),
    }
}

/// The machine's load over the last minute, where the host gives it.
fn load_average() -> Option<f64> {
    nix::sys::sysinfo::sysinfo().ok().map(|info| info.load_average().0)
}
