//! `holdsafe search SCENARIO`: attack sequences over an attack space, tried on a scenario in the twin until a safety
//! property breaks; and of each cause the smallest, as its own scenario.
//!
//! With `--exhaust K` every sequence of up to K actions over a small part of the attack space, in place of a search.

mod listed;

use std::path::{Path, PathBuf};

use evidence::ablation::Switch;
use evidence::trial::Outcome;
use parallel::progress::Progress;
use results::campaign::partition::Partition;
use results::mode::Mode;
use results::report::{Confirmed, FindingRow, SearchObject, search_table};
use runner::closing::Closing;
use runner::failure::{Exit, Failure};
use runner::guest_options::NoGuest;
use runner::optimizer::{self, Optimizer};
use runner::plan::PlanOptions;
use runner::search_config::{SearchNames, stopped_or_unfit, unfit};
use runner::{Context, engine, out, plan, quoted};
use scenario::{Name, Setup};
use search::{
    AttackSequence, Cause, FoundSequence, Moments, Proposer, RunConfig, RunResult, SearchConfig, Shrunk, Source,
    Strategy, ends_in,
};

use self::listed::Listed;
use super::emit::{Shares, tell_kept};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A scenario of the twin, by name or by file: the mission during which the sequences are tried.
    #[arg(value_name = "SCENARIO")]
    scenario: String,
    /// The attack space: a file of scenarios/spaces, by name or by path.
    #[arg(long = "attack-space", alias = "alphabet", value_name = "SPACE", default_value = "path")]
    space: String,
    /// Most trials.
    #[arg(long, value_name = "N", default_value_t = 1_000, value_parser = clap::value_parser!(u64).range(1..=100_000_000))]
    budget: u64,
    /// Strategy by which sequences are drawn.
    #[arg(long, value_enum, default_value = "guided")]
    strategy: Strategy,
    /// A program that proposes the sequences in place of a strategy, by lines of JSON on its stdin and stdout. It runs with your rights.
    #[arg(long, value_name = "PROGRAM", conflicts_with_all = ["strategy", "exhaust", "partition", "from"])]
    optimizer: Option<PathBuf>,
    /// Every sequence of up to so many actions in place of a search: each action type at its weakest and strongest,
    /// when the unit changes mode.
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..=6), conflicts_with_all = ["strategy", "budget"])]
    exhaust: Option<u32>,
    /// Classes that are findings.
    #[arg(long, value_delimiter = ',', value_name = "CLASS", default_value = "UNSAFE", value_parser = class)]
    find: Vec<Outcome>,
    /// End with the first finding.
    #[arg(long)]
    first: bool,
    /// Seed of the drawing; --seed is that of every trial.
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    draws: u64,
    /// Threads [default: one a core]. The findings do not depend on it.
    #[arg(long, value_name = "J", value_parser = runner::batch::jobs)]
    jobs: Option<usize>,
    /// With rendered sensors and the detector; frames that a sequence does not reach are not rendered again.
    #[arg(long)]
    rendered: bool,
    /// A policy file in place of the scenario's own.
    #[arg(long, value_name = "FILE")]
    policy: Option<PathBuf>,
    /// Checks that are waived besides, by their place in a policy file, such as boundary.freshness.
    #[arg(long, value_delimiter = ',', value_name = "CHECK", value_parser = Switch::from_name)]
    waive: Vec<Switch>,
    /// Only this cell; needed where the scenario has several.
    #[arg(long)]
    cell: Option<String>,
    /// Run each finding live so many times, away from its edge.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u64).range(0..=1_000))]
    confirm: u64,
    #[command(flatten)]
    _no_guest: NoGuest,
    /// Try and keep only every N-th sequence, from the i-th on, of --exhaust or of a strategy that does not learn; the same command with --from
    /// puts the parts together.
    #[arg(long, value_name = "i/N", requires = "out", conflicts_with_all = ["from", "first"])]
    partition: Option<Partition>,
    /// Take the tried sequences of a partition's folder too, so that only those that are nowhere are tried; may be repeated.
    #[arg(long, value_name = "DIR", requires = "out", conflicts_with = "first")]
    from: Vec<PathBuf>,
    /// Keep the findings here, and of --exhaust and of partitions every tried sequence, to resume from [default: runs/search-N].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl Args {
    /// Its pieces of work for partitions.
    pub(super) fn shares(&self, context: &Context) -> Result<Shares, Failure> {
        if self.first {
            let message =
                "behind `--`: a search that ends with its first finding does not come in partitions; leave --first out";
            return Err(Failure::new(Exit::Usage, message));
        }
        if self.optimizer.is_some() {
            return Err(listed::learns());
        }
        let listed = Listed::from_args(self, &self.config(context)?)?.ok_or_else(listed::learns)?;
        let set = self.partition.is_some() || !self.from.is_empty() || self.out.is_some();
        let (pieces, of, threads) = (listed.sequences.len() as u64, "sequences", self.jobs.map(|jobs| jobs as u16));
        Ok(Shares { pieces, of, threads, set, rounds: false })
    }

    fn config(&self, context: &Context) -> Result<SearchConfig, Failure> {
        plan::file_of(context, &self.scenario)?;
        let (policy, cell, rendered) = (self.policy.clone(), self.cell.clone(), self.rendered);
        let wanted = PlanOptions { policy, cell, rendered, ..PlanOptions::default() };
        let requested = SearchNames {
            scenario: &self.scenario,
            space: &self.space,
            options: wanted,
            waive: &self.waive,
            misset: &[],
        };
        requested.config(context)
    }

    fn source(&self) -> Source {
        let program = |program: &PathBuf| Source::Program(optimizer::program_name(program));
        self.optimizer.as_ref().map_or(Source::Strategy(self.strategy), program)
    }

    fn threads(&self) -> usize {
        self.jobs.unwrap_or_else(parallel::cores)
    }

    fn run(&self) -> RunConfig {
        RunConfig { strategy: self.strategy, seed: self.draws, budget: self.budget, first: self.first }
    }
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let config = args.config(context)?;
    let parted = args.partition.is_some() || !args.from.is_empty();
    let listed = if parted || args.exhaust.is_some() { Listed::from_args(args, &config)? } else { None };
    if parted && listed.is_none() {
        return Err(listed::learns());
    }
    let directory = || out::directory(&context.runs_folder()?, args.out.as_deref(), "search");
    let (dir, result) = match listed {
        Some(listed) => {
            let dir = directory()?;
            let numbered = listed.try_missing(context, args, &config, &dir)?;
            if args.partition.is_some() {
                tell_kept(context, &dir)?;
                return Ok(Exit::Fine);
            }
            (dir, listed.result(&numbered, args, &config)?)
        }
        None => {
            let result = draw_and_try(context, args, &config)?;
            (directory()?, result)
        }
    };
    let nominal = config.try_sequence(&AttackSequence::default()).map_err(unfit)?;
    let moments = Moments::from_run(&nominal, &config.space, &config.setup.bounds);
    if !args.waive.is_empty() {
        out::write_text(&dir, POLICY_FILE, &policy_text(&config)?)?;
    }
    let mut findings = Vec::new();
    for (i, (cause, found)) in result.found.iter().enumerate() {
        let shrunk = config.shrink(&found.sequence, &ends_in(&args.find), cause, &moments).map_err(unfit)?;
        let name = format!("found-{}", i + 1);
        let mut row = finding(args, &config, &name, (cause, found, &shrunk), &dir)?;
        if args.confirm > 0 {
            row.live = Some(confirm(context, args, &config, cause, &shrunk.sequence)?);
        }
        findings.push(row);
    }
    let object = SearchObject::new(&config, args.draws, &result, args.source(), args.exhaust, findings);
    out::write_result(&dir, "result.json", "search", &object)?;
    if context.json {
        out::print_json("search", &object)?;
    } else {
        out::show(search_table(&object));
    }
    let trials = format!("{} trials", object.hunt.trials);
    let found = match object.findings.len() {
        0 => "nothing found".to_owned(),
        n => format!("{n} found, the first {}", object.findings[0].outcome.name()),
    };
    Closing::new(context).part(trials).part(found).print(next(context, args, &object, &dir));
    Ok(if object.findings.is_empty() { Exit::Fine } else { Exit::Unexpected })
}

/// A finding run again and explained; without any the page, and the citation.
fn next(context: &Context, args: &Args, object: &SearchObject, dir: &Path) -> [String; 2] {
    let Some(first) = object.findings.first() else {
        return [context.report_of(dir), context.explain_of(&args.scenario, args.cell.as_deref())];
    };
    let file = dir.join(format!("{}.toml", first.name));
    let policy = if args.waive.is_empty() { args.policy.clone() } else { Some(dir.join(POLICY_FILE)) };
    let seed = object.seed.to_string();
    let words = ["inspect", "explain", &file.to_string_lossy(), "--all", "--seed", &seed].map(str::to_owned);
    let policy = policy.map(|policy| ["--policy".to_owned(), policy.to_string_lossy().into_owned()]);
    let words: Vec<String> = words.into_iter().chain(policy.into_iter().flatten()).collect();
    [context.own_command(&first.reproduce), context.command(words.iter().map(String::as_str))]
}

/// The policy with the checks of `--waive` waived, beside the findings.
const POLICY_FILE: &str = "searched.toml";

fn class(text: &str) -> Result<Outcome, String> {
    let wanted = Outcome::ALL.into_iter().find(|outcome| outcome.name() == text);
    wanted.filter(|outcome| *outcome != Outcome::Invalid).ok_or_else(|| {
        let names = Outcome::ALL.into_iter().filter(|o| *o != Outcome::Invalid).map(Outcome::name);
        format!("no class that can be found; there are: {}", names.collect::<Vec<_>>().join(", "))
    })
}

fn draw_and_try(context: &Context, args: &Args, config: &SearchConfig) -> Result<RunResult, Failure> {
    let start = |program| Optimizer::start(program, config, args.run(), &context.stop);
    let mut own_optimizer = args.optimizer.as_deref().map(start).transpose().map_err(unfit)?;
    let proposer = own_optimizer.as_mut().map(|own_optimizer| own_optimizer as &mut dyn Proposer);
    let progress = Progress::new("search", args.budget as usize, context.talk);
    let result = config.search(args.run(), proposer, &ends_in(&args.find), args.threads(), &progress, &context.stop);
    progress.finish();
    result.map_err(|reason| stopped_or_unfit(context, reason))
}

/// A finding: its file, and the checks that would have stopped it.
fn finding(
    args: &Args,
    config: &SearchConfig,
    name: &str,
    (cause, found, shrunk): (&Cause, &FoundSequence, &Shrunk),
    dir: &Path,
) -> Result<FindingRow, Failure> {
    let tried = config.try_sequence(&shrunk.sequence).map_err(unfit)?;
    let reason = first_finding(&tried.trial.findings, &cause.broken);
    let line = reason.as_deref().unwrap_or("It ends in a class that was looked for.");
    let scenario = config.as_regression(&shrunk.sequence, &args.find, line).map_err(unfit)?;
    let file = dir.join(format!("{name}.toml"));
    let parsed = Name::new(name).map_err(Failure::internal)?;
    let text = scenario.to_file(&parsed).map_err(Failure::internal)?;
    std::fs::write(&file, text)?;
    let policy = match (&args.policy, args.waive.is_empty()) {
        (_, false) => format!(" --policy {}", quoted(&dir.join(POLICY_FILE).to_string_lossy())),
        (Some(policy), true) => format!(" --policy {}", quoted(&policy.to_string_lossy())),
        (None, true) => String::new(),
    };
    let rendered = if args.rendered { " --rendered" } else { "" };
    Ok(FindingRow {
        name: name.to_owned(),
        outcome: cause.outcome,
        broken: cause.broken.clone(),
        finding: reason,
        word: shrunk.sequence.describe(&config.space),
        found_as: found.sequence.describe(&config.space),
        trial: found.trial,
        cpu_seconds: found.cpu_seconds,
        executions: shrunk.executions,
        margins: shrunk.margins.clone(),
        stopped_by: stopped_by(args, config, &shrunk.sequence)?,
        live: None,
        reproduce: format!(
            "holdsafe run {} --trials 1 --seed {}{rendered}{policy}",
            quoted(&file.to_string_lossy()),
            config.seed
        ),
    })
}

/// Live outcome of a finding, under the seed under which the twin found it.
fn confirm(
    context: &Context,
    args: &Args,
    config: &SearchConfig,
    cause: &Cause,
    sequence: &AttackSequence,
) -> Result<Confirmed, Failure> {
    let Some(inside) = config.inside(sequence, &ends_in(&args.find), cause).map_err(unfit)? else {
        return Ok(Confirmed::default());
    };
    let scenario = inside.in_scenario(&config.space, &config.scenario).map_err(unfit)?;
    // A live run always has frames.
    let setup = Setup { rendered: true, ..config.setup.clone() };
    let mut confirmed = Confirmed { word: Some(inside.describe(&config.space)), ..Confirmed::default() };
    let progress = Progress::new("live", args.confirm as usize, context.talk);
    for _ in 0..args.confirm {
        let trial = engine::trial(Mode::Live, &scenario, &setup, config.seed, &context.stop)?;
        confirmed.take(trial.outcome, args.find.contains(&trial.outcome));
        runner::batch::count(&progress, &trial);
    }
    progress.finish();
    Ok(confirmed)
}

/// The first of the oracle's findings about the broken property.
fn first_finding(findings: &[String], broken: &str) -> Option<String> {
    findings.iter().find(|finding| finding.starts_with(broken)).cloned()
}

/// The waived checks each of which alone would have prevented the finding.
fn stopped_by(args: &Args, config: &SearchConfig, sequence: &AttackSequence) -> Result<Vec<String>, Failure> {
    let mut stopped_by = Vec::new();
    for switch in Switch::all().into_iter().filter(|switch| switch.is_waived(&config.setup.policy)) {
        let mut varied = config.clone();
        switch.require(&mut varied.setup.policy);
        if !args.find.contains(&varied.try_sequence(sequence).map_err(unfit)?.trial.outcome) {
            stopped_by.push(switch.name());
        }
    }
    Ok(stopped_by)
}

fn policy_text(config: &SearchConfig) -> Result<String, Failure> {
    toml::to_string_pretty(&config.setup.policy).map_err(Failure::internal)
}
