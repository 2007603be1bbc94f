//! `holdsafe inspect explain RUN`: reasons for the platform's changes of mode, from a recording or from a run in the
//! twin.

use std::path::{Path, PathBuf};

use evidence::Micros;
use explain::{Explanation, Log, explain, why_not};
use recording::{Checked, RecordedLog};
use results::report::{ExplainObject, diagram, explained, kept_out};
use runner::checked::Unverified;
use runner::failure::{Exit, Failure};
use runner::plan::PlanOptions;
use runner::recorded::{log_of_twin, note_assumptions};
use runner::{Context, checked, engine, out, plan};
use wire::mode::Mode;

#[derive(Debug, clap::Args)]
pub(in crate::command) struct Args {
    /// Directory of a recorded run, or a scenario that is run in the twin under --seed.
    #[arg(value_name = "RUN")]
    run: String,
    #[command(flatten)]
    unverified: Unverified,
    /// The change of mode that was in force at this time; else every loss.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    at: Option<Micros>,
    /// Conditions that keep the unit out of this mode, at --at or at the end.
    #[arg(long, value_name = "MODE", value_parser = mode)]
    why_not: Option<Mode>,
    /// Every change of mode, those that were asked for too.
    #[arg(long, conflicts_with = "at")]
    all: bool,
    /// As Mermaid flow charts.
    #[arg(long, conflicts_with = "json")]
    diagram: bool,
    /// Of a scenario: only this cell; else the first.
    #[arg(long)]
    cell: Option<String>,
    /// Of a scenario: a policy file in place of its own.
    #[arg(long, value_name = "FILE")]
    policy: Option<PathBuf>,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let (found, checked) = find(context, args)?;
    let read: Vec<&Checked> = checked.iter().collect();
    // A run in the twin has no recording to verify, but may have ended INVALID.
    let of_twin =
        found.flaw.as_ref().filter(|_| checked.is_none()).map(|reason| format!("INVALID: {}: {reason}", args.run));
    let exit = args
        .unverified
        .exit(&read, if of_twin.is_none() { Exit::Fine } else { args.unverified.with_invalid(Exit::Fine) });
    if args.diagram {
        // A comment of Mermaid's, the only text allowed there.
        let marks = read.iter().filter_map(|recording| recording.mark()).chain(of_twin);
        marks.for_each(|mark| out::say(format_args!("%% {mark}")));
    } else {
        checked::print_marks(context, &read);
        of_twin.iter().for_each(|mark| checked::print_mark(context, mark));
    }
    note_assumptions(&found, &args.run);
    let RecordedLog { entries, flaw, assumed, bounds } = found;
    let log = Log::from_entries(&entries, bounds);
    let end = log.entries().last().map(|w| w.at);
    let Some(end) = end else {
        return Err(Failure::new(Exit::NoEvidence, format!("{}: no entry of any service", args.run)));
    };
    let not = args.why_not.map(|wanted| why_not(&log, wanted, args.at.unwrap_or(end)));
    let explanations = if not.is_some() { Vec::new() } else { chosen(args, explain(&entries, &bounds)) };
    if not.is_none() && explanations.is_empty() {
        let whole = if read.iter().all(|recording| recording.invalid().is_none()) {
            ""
        } else {
            " in what is left of the recording"
        };
        link::note!("no loss to explain{whole}; --all tells of every change of mode");
    }
    if context.json {
        checked::print_json("explain", &ExplainObject::new(&args.run, flaw, assumed, explanations, not), &read)?;
        return Ok(exit);
    }
    for explanation in &explanations {
        if args.diagram {
            out::say(format_args!("{}", diagram(explanation)))
        } else {
            out::show(explained(explanation))
        }
    }
    not.iter().for_each(|error| out::say(format_args!("{}", kept_out(error))));
    Ok(exit)
}

fn chosen(args: &Args, mut all: Vec<Explanation>) -> Vec<Explanation> {
    match args.at {
        Some(at) => all.into_iter().rev().find(|e| e.at_us <= at).into_iter().collect(),
        None => {
            all.retain(|e| args.all || e.restricts());
            all
        }
    }
}

fn find(context: &Context, args: &Args) -> Result<(RecordedLog, Option<Checked>), Failure> {
    let path = Path::new(&args.run);
    if path.is_dir() {
        let checked = checked::open_one_run(path)?;
        return Ok((RecordedLog::read(&checked)?, Some(checked)));
    }
    let wanted = PlanOptions { policy: args.policy.clone(), cell: args.cell.clone(), ..PlanOptions::default() };
    let (scenario, planned) = plan::plan(context, &plan::file_of(context, &args.run)?, &wanted)?;
    if scenario.is_of_stacks() {
        let message = format!("`{}` runs on the real stacks, without a platform that could change its mode", args.run);
        return Err(Failure::new(Exit::Usage, message));
    }
    let one = planned.first().ok_or_else(|| Failure::new(Exit::NoEvidence, "nothing to run"))?;
    let (evidence, verdict) = engine::twin_verdict(&one.variation.scenario, &one.setup, context.seed)?;
    Ok((log_of_twin(evidence, &verdict), None))
}

fn seconds(text: &str) -> Result<Micros, String> {
    match text.parse::<f64>() {
        Ok(s) if (0.0..=1e6).contains(&s) => Ok((s * 1e6) as Micros),
        Ok(_) | Err(_) => Err("a number of seconds from 0 to 1000000 is expected".to_owned()),
    }
}

fn mode(text: &str) -> Result<Mode, String> {
    let known = || Mode::ALL.map(Mode::name).join(", ");
    Mode::ALL.into_iter().find(|m| m.name() == text).ok_or_else(|| format!("one of {} is expected", known()))
}
