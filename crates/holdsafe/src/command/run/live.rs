//! `holdsafe run --live --watch SCENARIO`: one live run, with the operator's view as text.

use std::path::Path;

use link::clock::trace_us;
use results::mode::Mode;
use runner::closing::Closing;
use runner::engine::View;
use runner::failure::{Exit, Failure};
use runner::plan::PlanOptions;
use runner::retry::retried;
use runner::{Context, batch, engine, out, own_arguments, plan};
use scenario::Hosts;
use wire::person::Role;

use super::Args;

/// Least time between two of the operator's views on a terminal, microseconds.
const APART_US: u64 = 200_000;

/// The scenario where none is named.
const SCENARIO: &str = "nominal";

pub(super) fn role(text: &str) -> Result<Role, String> {
    let named = Role::ALL.into_iter().find(|role| role.name() == text);
    named.ok_or_else(|| format!("one of {} is expected", Role::ALL.map(Role::name).join(", ")))
}

pub(super) fn hosts(text: &str) -> Result<Hosts, String> {
    match text {
        "loopback" => Ok(Hosts::Loopback),
        "namespaces" => Ok(Hosts::Namespaces),
        _ => Err("loopback or namespaces is expected".to_owned()),
    }
}

/// Checks that there is a display to open a window on.
pub(super) fn display() -> Result<(), Failure> {
    console::process::open::probe().map_err(|window| Failure::new(Exit::Environment, window.to_string()))
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    if args.console {
        display()?;
    }
    let name = match args.scenarios.as_slice() {
        [] => SCENARIO,
        [one] => one,
        _ => return Err(Failure::new(Exit::Usage, "--watch shows one live trial: name one scenario")),
    };
    let (policy, cell, detector) = (args.policy.clone(), args.cell.clone(), args.bring.load()?);
    let (platform, guest) = (args.platform(context)?, args.engage.load()?);
    let where_trained = !args.rendered;
    let worlds = args.worlds(context);
    let wanted =
        PlanOptions { policy, platform, cell, worlds, rendered: true, where_trained, detector, sabotage: false, guest };
    let (_, mut planned) = plan::plan(context, &plan::file_of(context, name)?, &wanted)?;
    planned.truncate(1);
    let Some(one) = planned.first_mut() else {
        return Err(Failure::new(Exit::NoEvidence, "nothing to run"));
    };
    // A window is a person's: a run with one is not repeated unasked.
    one.setup.retries = if args.console { 0 } else { args.retries.retries };
    one.setup.confinement = args.confinement();
    one.setup.hosts = args.hosts;
    if let Some(dir) = &args.out {
        one.setup.frames = args.frames;
        out::check_unused(dir)?;
        one.setup.run_dir = Some(out::directory(dir, Some(dir), "live")?);
    }
    if let Some(mark) = one.setup.watermark() {
        link::note!("{mark}");
    }
    // With --json stdout is for the object, so the operator's view goes to stderr.
    let print: fn(&str) =
        if context.json { |text| link::note!("{text}") } else { |text| out::say(format_args!("{text}")) };
    let mut printed = 0;
    let mut show = |text: &str| {
        let now = trace_us();
        if now.saturating_sub(printed) >= APART_US {
            printed = now;
            print(text);
        }
    };
    let scenario = &one.variation.scenario;
    let mut trial = retried(&one.setup, context.seed, || {
        let view = View { show: &mut show, window: args.console, role: args.role, acts: Vec::new() };
        engine::run_watched(scenario, &one.setup, context.seed, &context.stop, view)
            .map_err(|e| Failure::from(e).reproduced_by(batch::reproduce(Mode::Live, one, context.seed)))
    })?;
    trial.cell = one.variation.cell.clone();
    if context.json {
        out::print_json("trial", &trial)?;
    } else {
        out::show(trial.outcome.name());
        trial.held.iter().for_each(|held| out::say(format_args!("held.json has SHA-256 {held}")));
    }
    let trials = [trial];
    let exit = batch::judge(Mode::Live, &planned, &trials);
    let recording = args.out.clone().filter(|_| trials[0].held.is_some());
    let next = match &recording {
        Some(folder) => [context.see_why(trials[0].outcome, folder), context.report_of(folder)],
        None => {
            let folder = context.free_folder(name);
            [context.own_command(&own_arguments(&["--out", &folder])), context.report_of(Path::new(&folder))]
        }
    };
    let closing = Closing::new(context).ended("cells", &batch::ended(&planned, &trials));
    closing.verified(&Vec::from_iter(recording))?.print(next);
    Ok(exit)
}
