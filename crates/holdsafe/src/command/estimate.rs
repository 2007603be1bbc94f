//! `holdsafe estimate SCENARIO --event …`: the probability of a rare event of a run in the twin, by multilevel
//! splitting, with an interval; without levels in between by plain Monte Carlo, in the same code. Its repetitions are independent, so
//! partitions share them out.

use std::path::{Path, PathBuf};
use std::rc::Rc;

use parallel::progress::Progress;
use results::campaign::InputDigest;
use results::campaign::draw;
use results::campaign::partition::Partition;
use results::report::{RareObject, RareQuestion, rare_table};
use runner::closing::Closing;
use runner::failure::{Exit, Failure};
use runner::guest_options::NoGuest;
use runner::lines::LineFault;
use runner::numbered::Numbered;
use runner::plan::{PlanOptions, Planned};
use runner::{Context, out, plan};
use scenario::{Settings, Variation};
use search::rare::{Event, MAX_LEVELS, Plan, Question, Repetition};
use serde::Serialize;
use serde_json::Value;

use super::emit::{Shares, tell_kept};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A scenario of the twin, by name or by file.
    #[arg(value_name = "SCENARIO")]
    scenario: String,
    #[command(flatten)]
    _no_guest: NoGuest,
    /// Event.
    #[arg(long, value_enum)]
    event: Event,
    /// Progress of a run at the end of each stage, in the unit of the event's levels. None between start and event:
    /// plain Monte Carlo.
    #[arg(long, value_delimiter = ',', value_name = "LEVEL")]
    levels: Vec<f64>,
    /// Trials of each stage.
    #[arg(long, value_name = "N", default_value_t = 500, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    trials: u64,
    /// Independent repetitions of all stages; the interval is of their mean.
    #[arg(long, value_name = "R", default_value_t = 10, value_parser = clap::value_parser!(u64).range(2..=1_000))]
    repetitions: u64,
    /// A value by its path in the scenario, as in a cell's `set`, such as conditions.loss=0.02.
    #[arg(long, value_name = "PATH=VALUE", value_parser = setting)]
    set: Vec<(String, Value)>,
    /// Only this cell; needed where the scenario has several.
    #[arg(long)]
    cell: Option<String>,
    /// A policy file in place of the scenario's own.
    #[arg(long, value_name = "FILE")]
    policy: Option<PathBuf>,
    /// Threads [default: one a core]. The estimate does not depend on it.
    #[arg(long, value_name = "J", value_parser = runner::batch::jobs)]
    jobs: Option<usize>,
    /// Run and keep only every N-th repetition, from the i-th on; the same command with --from puts the parts together.
    #[arg(long, value_name = "i/N", requires = "out", conflicts_with = "from")]
    partition: Option<Partition>,
    /// Take the finished repetitions of a partition's folder too, so that only those that are nowhere run; may be repeated.
    #[arg(long, value_name = "DIR", requires = "out")]
    from: Vec<PathBuf>,
    /// Keep finished repetitions and the result here, and resume from there.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl Args {
    /// Its pieces of work for partitions.
    pub(super) fn shares(&self, context: &Context) -> Result<Shares, Failure> {
        question(context, self)?;
        plan(context, self)?;
        let set = self.partition.is_some() || !self.from.is_empty() || self.out.is_some();
        Ok(Shares {
            pieces: self.repetitions,
            of: "repetitions",
            threads: self.jobs.map(|jobs| jobs as u16),
            set,
            rounds: false,
        })
    }
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let (plan, (question, planned)) = (plan(context, args)?, question(context, args)?);
    let numbered =
        args.out.as_deref().map(|directory| load_repetitions(context, args, &planned, directory)).transpose()?;
    let repetitions = all(context, args, &plan, &question, numbered)?;
    if let (Some(_), Some(directory)) = (args.partition, &args.out) {
        tell_kept(context, directory)?;
        return Ok(Exit::Fine);
    }
    let requested = RareQuestion { question: &question, set: args.set.iter().cloned().collect(), levels: &args.levels };
    let object = RareObject::new(requested, &plan, &repetitions);
    if let Some(directory) = &args.out {
        out::write_result(directory, "estimate.json", "rare", &object)?;
    }
    if context.json {
        out::print_json("rare", &object)?;
    } else {
        out::show(rare_table(&object));
    }
    let (seen, trials) = (object.seen(), object.stages.iter().map(|stage| stage.tried).sum::<u64>());
    let found = if seen { format!("estimate {:.2e}", object.estimate) } else { "event not seen".to_owned() };
    let closing = Closing::new(context).part(found).part(format!("{trials} trials"));
    let (explain, folder) =
        (context.explain_of(&args.scenario, args.cell.as_deref()), context.free_folder("estimated"));
    let run = ["run", &args.scenario, "--trials", "1", "--out", &folder];
    closing
        .print([explain, context.command(run.into_iter().chain(args.cell.iter().flat_map(|cell| ["--cell", cell])))]);
    Ok(if object.seen() { Exit::Fine } else { Exit::NoEvidence })
}

fn plan(context: &Context, args: &Args) -> Result<Plan, Failure> {
    let usage = |reason: String| Failure::new(Exit::Usage, reason);
    let levels = args.event.ladder(&args.levels).map_err(|error| usage(error.to_string()))?;
    if levels.len() > MAX_LEVELS {
        return Err(usage(format!("{} stages, at most {MAX_LEVELS} are taken; leave levels out", levels.len())));
    }
    Ok(Plan { levels, trials: args.trials, repetitions: args.repetitions, seed: context.seed })
}

/// Everything that a repetition's result depends on.
#[derive(Serialize)]
struct Terms<'a> {
    /// SHA-256 over the sources of the program.
    program: &'a str,
    content: InputDigest,
    event: Event,
    levels: &'a [f64],
    trials: u64,
    repetitions: u64,
    seed: u64,
}

/// The finished repetitions in `directory`, with those of `--from`.
fn load_repetitions(
    context: &Context,
    args: &Args,
    planned: &Planned,
    directory: &Path,
) -> Result<Numbered<Repetition>, Failure> {
    let Args { event, levels, trials, repetitions, .. } = args;
    let (program, content, seed) = (context.program, planned.content()?, context.seed);
    let terms = Terms { program, content, event: *event, levels, trials: *trials, repetitions: *repetitions, seed };
    let (stages, trials) = (plan(context, args)?.levels.len(), *trials);
    let check = move |one: &Repetition| {
        if one.is_of(stages, trials) {
            Ok(())
        } else {
            Err(LineFault::Content("no repetition of this estimate".to_owned()))
        }
    };
    let mut numbered = Numbered::open(directory, &terms, *repetitions, Rc::new(check), &context.stop)?;
    args.from.iter().try_for_each(|from| numbered.add(from))?;
    Ok(numbered)
}

/// The repetitions of this command, in order; those that are not kept run.
fn all(
    context: &Context,
    args: &Args,
    plan: &Plan,
    question: &Question,
    mut numbered: Option<Numbered<Repetition>>,
) -> Result<Vec<Repetition>, Failure> {
    let wanted = (0..plan.repetitions).filter(|number| args.partition.is_none_or(|part| part.holds(*number)));
    let wanted: Vec<u64> = wanted.collect();
    let missing =
        wanted.iter().filter(|number| numbered.as_ref().is_none_or(|numbered| !numbered.is_finished(**number))).count();
    let total = plan.levels.len() as u64 * plan.trials * missing as u64;
    let progress = Progress::new("trials", total as usize, context.talk);
    let threads = args.jobs.unwrap_or_else(parallel::cores);
    let mut all = Vec::new();
    for number in wanted {
        if let Some(known) = numbered.as_ref().map(|numbered| numbered.get(number)).transpose()?.flatten() {
            all.push(known);
            continue;
        }
        let one = question.repeat(plan, number, threads, &progress, &context.stop);
        let one = one.map_err(|reason| match (context.stop.is_requested(), &numbered) {
            (true, None) => Failure::new(Exit::Interrupted, "stopped; nothing was kept"),
            (true, Some(_)) => {
                Failure::new(Exit::Interrupted, "stopped; the same command runs the repetitions that are left")
            }
            (false, _) => Failure::new(Exit::Internal, reason.to_string()),
        })?;
        numbered.as_mut().map(|numbered| numbered.put(number, one.clone())).transpose()?;
        all.push(one);
    }
    progress.finish();
    Ok(all)
}

fn question(context: &Context, args: &Args) -> Result<(Question, Planned), Failure> {
    let wanted = PlanOptions { policy: args.policy.clone(), cell: args.cell.clone(), ..PlanOptions::default() };
    let (scenario, planned) = plan::plan(context, &plan::file_of(context, &args.scenario)?, &wanted)?;
    if scenario.is_of_stacks() {
        let name = scenario.name.as_str();
        let message = format!("`{name}` runs on the real stacks in memory, which cannot be copied; it takes the twin");
        return Err(Failure::new(Exit::Usage, message));
    }
    let [planned] = <[Planned; 1]>::try_from(planned).map_err(|several| {
        let cells: Vec<String> = several.into_iter().filter_map(|p| p.variation.cell).collect();
        let message = format!("`{}` has several cells; choose one with --cell: {}", args.scenario, cells.join(", "));
        Failure::new(Exit::Usage, message)
    })?;
    let variation = planned.variation;
    let set: Settings = args.set.iter().cloned().collect();
    let scenario = variation.with_settings(&set).map_err(|error| plan::unfit(&variation, &error))?;
    let planned = plan::prepare(context, Variation { scenario, ..variation }, &wanted)?;
    let (scenario, setup) = (planned.variation.scenario.clone(), planned.setup.clone());
    Ok((Question { scenario, setup, event: args.event }, planned))
}

fn setting(text: &str) -> Result<(String, Value), String> {
    match text.split_once('=') {
        Some((path, value)) if !path.is_empty() && !value.is_empty() => Ok((path.to_owned(), draw::scalar(value))),
        Some(_) | None => Err("a value is set as PATH=VALUE, such as conditions.loss=0.02".to_owned()),
    }
}
