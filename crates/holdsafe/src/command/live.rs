//! `holdsafe live SCENARIO`: one live run, with what the operator sees as text.

use std::path::PathBuf;

use link::clock::trace_us;
use results::mode::Mode;
use runner::bring::Bring;
use runner::engine::View;
use runner::failure::{Exit, Failure};
use runner::plan::Wanted;
use runner::retry::{Retries, retried};
use runner::{Context, batch, engine, out, plan};
use scenario::FRAMES;
use wire::person::Role;

/// Least time between two of the operator's views on a terminal, microseconds.
const APART_US: u64 = 200_000;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Scenario, by name or by file.
    #[arg(value_name = "SCENARIO", default_value = "nominal")]
    scenario: String,
    /// A policy file in place of the scenario's own.
    #[arg(long, value_name = "FILE")]
    policy: Option<PathBuf>,
    /// Only this cell, such as verbatim/present/session-only; else the first.
    #[arg(long)]
    cell: Option<String>,
    #[command(flatten)]
    bring: Bring,
    /// Open the operator's window. The run then lasts until that is closed, at least to the scenario's end.
    #[arg(long)]
    console: bool,
    /// What the person at the window may do: view, operate or supervise. Who may only look has no pen, and then the scenario's
    /// operator has none either.
    #[arg(long, requires = "console", default_value = "supervise", value_parser = role)]
    role: Role,
    #[command(flatten)]
    retries: Retries,
    /// Keep recordings here.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Of these, keep every Nth set of sensor frames whole and of the others the hash: 1 keeps all (5 GB an hour), 0 none.
    #[arg(long, value_name = "N", requires = "out", default_value_t = FRAMES)]
    frames: u32,
}

pub(super) fn role(text: &str) -> Result<Role, String> {
    let named = Role::ALL.into_iter().find(|role| role.name() == text);
    named.ok_or_else(|| format!("one of {} is expected", Role::ALL.map(Role::name).join(", ")))
}

/// Whether there is a display to open a window on.
pub(super) fn display() -> Result<(), Failure> {
    console::process::open::probe().map_err(|why| Failure::new(Exit::Environment, why.to_string()))
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    if args.console {
        display()?;
    }
    let (policy, cell, detector) = (args.policy.clone(), args.cell.clone(), args.bring.load()?);
    let wanted = Wanted { policy, cell, rendered: true, detector, sabotage: false };
    let (_, mut planned) = plan::plan(context, &plan::file_of(context, &args.scenario)?, &wanted)?;
    planned.truncate(1);
    let Some(one) = planned.first_mut() else {
        return Err(Failure::new(Exit::NoEvidence, "nothing to run"));
    };
    // A window is a person's: a run that was looked at is not repeated unasked.
    one.setup.retries = if args.console { 0 } else { args.retries.retries };
    if let Some(dir) = &args.out {
        one.setup.frames = args.frames;
        out::unused(dir)?;
        one.setup.run_dir = Some(out::directory(dir, Some(dir), "live")?);
    }
    if let Some(mark) = one.setup.watermark() {
        link::note!("{mark}");
    }
    // With --json stdout is for the object, so the operator's view goes to stderr.
    let tell: fn(&str) =
        if context.json { |text| link::note!("{text}") } else { |text| out::say(format_args!("{text}")) };
    let mut told = 0;
    let mut show = |text: &str| {
        let now = trace_us();
        if now.saturating_sub(told) >= APART_US {
            told = now;
            tell(text);
        }
    };
    let scenario = &one.variation.scenario;
    let mut trial = retried(&one.setup, context.seed, || {
        let view = View { show: &mut show, window: args.console, role: args.role, acts: Vec::new() };
        engine::watched(scenario, &one.setup, context.seed, &context.stop, view)
            .map_err(|e| Failure::from(e).reproduced_by(batch::reproduce(Mode::Live, one, context.seed)))
    })?;
    trial.cell = one.variation.cell.clone();
    if context.json {
        out::print_json("trial", &trial)?;
    } else {
        out::say(format_args!("{}", trial.outcome.name()));
        trial.held.iter().for_each(|held| out::say(format_args!("held.json has SHA-256 {held}")));
    }
    Ok(batch::judge(Mode::Live, &planned, &[trial]))
}
