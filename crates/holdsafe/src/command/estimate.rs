//! `holdsafe estimate SCENARIO --event …`: the probability of a rare event of a run in the twin, by multilevel
//! splitting, with an interval; without levels in between by plain Monte Carlo, in the same code.

use std::path::PathBuf;

use parallel::progress::Progress;
use results::campaign::draw;
use results::report::{Asked, RareObject, rare_table};
use runner::engage::NoGuest;
use runner::failure::{Exit, Failure};
use runner::plan::{Planned, Wanted};
use runner::{Context, out, plan};
use scenario::{Settings, Variation};
use search::rare::{Event, MAX_LEVELS, Plan, Question};
use serde_json::Value;

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
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let usage = |why: String| Failure::new(Exit::Usage, why);
    let levels = args.event.ladder(&args.levels).map_err(usage)?;
    if levels.len() > MAX_LEVELS {
        return Err(usage(format!("{} stages, at most {MAX_LEVELS} are taken; leave levels out", levels.len())));
    }
    let question = question(context, args)?;
    let plan = Plan { levels, trials: args.trials, repetitions: args.repetitions, seed: context.seed };
    let total = plan.levels.len() as u64 * plan.trials * plan.repetitions;
    let progress = Progress::new("trials", total as usize, context.talk);
    let threads = args.jobs.unwrap_or_else(parallel::cores);
    let repetitions = question.ask(&plan, threads, &progress, &context.stop);
    progress.finish();
    let repetitions = repetitions.map_err(|why| match context.stop.asked() {
        true => Failure::new(Exit::Interrupted, "stopped; nothing was kept"),
        false => Failure::new(Exit::Internal, why),
    })?;
    let asked = Asked { question: &question, set: args.set.iter().cloned().collect(), levels: &args.levels };
    let object = RareObject::new(asked, &plan, &repetitions);
    if context.json {
        out::print_json("rare", &object)?;
    } else {
        out::say(format_args!("{}", rare_table(&object)));
    }
    Ok(if object.seen() { Exit::Fine } else { Exit::NoEvidence })
}

fn question(context: &Context, args: &Args) -> Result<Question, Failure> {
    let wanted = Wanted { policy: args.policy.clone(), cell: args.cell.clone(), ..Wanted::default() };
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
    let scenario = variation.with(&set).map_err(|why| plan::unfit(&variation, why))?;
    let Planned { variation, setup, .. } = plan::prepare(context, Variation { scenario, ..variation }, &wanted)?;
    Ok(Question { scenario: variation.scenario, setup, event: args.event })
}

fn setting(text: &str) -> Result<(String, Value), String> {
    match text.split_once('=') {
        Some((path, value)) if !path.is_empty() && !value.is_empty() => Ok((path.to_owned(), draw::scalar(value))),
        Some(_) | None => Err("a value is set as PATH=VALUE, such as conditions.loss=0.02".to_owned()),
    }
}
