//! `holdsafe run SCENARIO…`: trials of scenarios, in the twin or live, judged against their expected classes.

mod live;
mod world;

use std::path::PathBuf;

use evidence::SCHEMA_VERSION;
use evidence::trial::Trial;
use results::mode::Mode;
use results::report::{RunObject, RunsObject, run_table, width};
use runner::batch::Batch;
use runner::closing::{Closing, Ran, joined, next_of_runs};
use runner::custom_detector::DetectorOptions;
use runner::failure::{Exit, Failure};
use runner::guest_options::GuestOptions;
use runner::plan::{Chosen, PlanOptions, Planned};
use runner::retry::Retries;
use runner::{Context, batch, out, plan, probe, quoted};
use scenario::{Confinement, FRAMES, Hosts, Scenario};
use serde::Serialize;
use wire::person::Role;

/// Twin trials of each cell when the user names no number: the fewest that bound a 95th percentile.
const TWIN_TRIALS: u64 = 59;
/// Largest number of recordings whose digests are printed on one screen; `result.json` has all.
const MAX_TOLD: usize = 8;
/// Drawn worlds of each cell when the user names no number, and most of them.
const WORLDS: u64 = 10;
const MAX_WORLDS: u64 = 1000;
/// Live trials of each cell when the user names no number.
const LIVE_TRIALS: u64 = 1;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Scenarios, by name or by file.
    #[arg(required_unless_present = "watch", value_name = "SCENARIO")]
    scenarios: Vec<String>,
    /// Run live: processes, sockets, real clocks.
    #[arg(long)]
    live: bool,
    /// Print the operator's view while one live trial runs: of the first cell, of `nominal` where no scenario is named.
    #[arg(long, requires = "live", conflicts_with_all = ["trials", "jobs"])]
    watch: bool,
    /// Trials of each scenario, or of each of its cells [default: 59 in the twin, 1 live].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    trials: Option<u64>,
    /// A policy file in place of the scenario's own.
    #[arg(long, value_name = "FILE")]
    policy: Option<PathBuf>,
    /// A platform in place of the scenario's own, by name or by file; classes are then those that `[[under]]` expects on it.
    #[arg(long, value_name = "PLATFORM")]
    platform: Option<String>,
    /// Only this cell, such as verbatim/present/session-only.
    #[arg(long)]
    cell: Option<String>,
    /// Run in drawn worlds of this family in place of the scenario's own, the attack at a time that the world's seed draws: NUMBER of them from
    /// --seed on, or the one of a seed, as in street:7.
    #[arg(long, value_name = "FAMILY[:SEED]", value_parser = world::named)]
    world: Option<world::Named>,
    /// Drawn worlds.
    #[arg(long, value_name = "NUMBER", requires = "world", default_value_t = WORLDS, value_parser = clap::value_parser!(u64).range(1..=MAX_WORLDS))]
    worlds: u64,
    /// Render the sensors and run the detector, in the twin; live runs always do.
    #[arg(long)]
    rendered: bool,
    #[command(flatten)]
    bring: DetectorOptions,
    #[command(flatten)]
    engage: GuestOptions,
    /// Open the operator's window on the one live trial. The run then lasts until that is closed, at least to the scenario's end.
    #[arg(long, requires = "live")]
    console: bool,
    /// Powers of the person at the window: view, operate or supervise. With view there is no pen, and then the
    /// scenario's operator has none either.
    #[arg(long, requires = "console", default_value = "supervise", value_parser = live::role)]
    role: Role,
    /// Deny every injection: the actors' claims in a log of the same trial without any action. INVALID is expected.
    #[arg(long, conflicts_with_all = ["live", "rendered", "detector", "autonomy"])]
    sabotage: bool,
    /// Live trials at a time.
    #[arg(long, value_name = "J", default_value_t = 1, value_parser = batch::jobs)]
    jobs: usize,
    #[command(flatten)]
    retries: Retries,
    /// Keep manifest, trials, result and recordings here.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Of a live trial's recordings, keep every Nth set of sensor frames whole and of the others the hash: 1 keeps all, 0 none.
    #[arg(long, value_name = "N", requires_all = ["live", "out"], default_value_t = FRAMES)]
    frames: u32,
    /// Run only where every service is confined as its row of docs/reviewer/confinement.md states.
    #[arg(long, requires = "live")]
    require_confinement: bool,
    /// Leave the services all rights of the user: to measure the cost of confinement, or for a debugger.
    #[arg(long, requires = "live", conflicts_with = "require_confinement")]
    no_confinement: bool,
    /// Networks of the hosts of a live run: one loopback interface, or a namespace each, on a wire with the adversary at its bridge.
    #[arg(long, requires = "live", value_name = "loopback|namespaces", default_value = "loopback", value_parser = live::hosts)]
    hosts: Hosts,
}

impl Args {
    fn confinement(&self) -> Confinement {
        match (self.require_confinement, self.no_confinement) {
            (true, _) => Confinement::Full,
            (false, true) => Confinement::None,
            (false, false) => Confinement::Best,
        }
    }

    /// The drawn worlds that are named.
    fn worlds(&self, context: &Context) -> Option<plan::Worlds> {
        self.world.map(|named| named.worlds(context.seed, self.worlds))
    }

    /// The platform that is named.
    fn platform(&self, context: &Context) -> Result<Option<Chosen>, Failure> {
        self.platform.as_ref().map(|name| plan::platform_of(context, name)).transpose()
    }
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    if args.watch {
        return live::run(context, args);
    }
    let engine = if args.live { Mode::Live } else { Mode::Twin };
    let rendered = args.rendered || args.live;
    let (policy, cell, detector) = (args.policy.clone(), args.cell.clone(), args.bring.load()?);
    let (platform, guest) = (args.platform(context)?, args.engage.load()?);
    let (where_trained, sabotage) = (args.live && !args.rendered, args.sabotage);
    let worlds = args.worlds(context);
    let wanted = PlanOptions { policy, platform, cell, worlds, rendered, where_trained, detector, sabotage, guest };
    if args.retries.retries > 0 && !args.live {
        return Err(Failure::new(Exit::Usage, "--retries is for live trials; add --live or leave it out"));
    }
    // Every file is read before anything runs.
    let mut plans = Vec::new();
    for name in &args.scenarios {
        let (scenario, mut planned) = plan::plan(context, &plan::file_of(context, name)?, &wanted)?;
        for of in &mut planned {
            of.setup.frames = args.frames;
            of.setup.retries = args.retries.retries;
            of.setup.confinement = args.confinement();
            of.setup.hosts = args.hosts;
            of.setup.window = args.console.then_some(args.role);
            let live = if args.live { " --live" } else { "" };
            let name = plan::is_path(name).then(|| quoted(name));
            of.command = name.map(|name| format!("holdsafe run {name} --trials 1{live}{}", of.options));
        }
        plans.push((scenario, planned));
    }
    if !args.live {
        probe::probe(plans.iter_mut().flat_map(|(_, planned)| planned), context.seed)?;
    }
    if args.console {
        one_window(args, &plans)?;
    }
    if let Some((scenario, _)) = plans.iter().find(|(scenario, _)| args.live && scenario.is_of_stacks()) {
        let name = scenario.name.as_str();
        let message = format!("`{name}` runs on the real stacks in memory and has no live form; leave out --live");
        return Err(Failure::new(Exit::Usage, message));
    }
    if let Some((scenario, _)) = plans.iter().find(|(scenario, _)| args.live && !scenario.guest_bus.is_empty()) {
        let name = scenario.name.as_str();
        let message = format!("`{name}` attacks a guest's own bus step by step, on the twin's clock; leave out --live");
        return Err(Failure::new(Exit::Usage, message));
    }
    let n = args.trials.unwrap_or(if args.live { LIVE_TRIALS } else { TWIN_TRIALS });
    let batches: Vec<Batch<'_>> = plans
        .iter()
        .map(|(scenario, planned)| Batch {
            label: scenario.name.as_str(),
            mode: if scenario.is_of_stacks() { Mode::Stack } else { engine },
            planned,
            n,
            seed: context.seed,
            jobs: args.jobs,
            out: args.out.as_deref(),
        })
        .collect();
    batches.iter().try_for_each(Batch::check_free)?;
    let out = args.out.as_ref().map(|dir| out::directory(dir, Some(dir), "run")).transpose()?;
    if let Some(dir) = &out {
        let all: Vec<Planned> = plans.iter().flat_map(|(_, planned)| planned.clone()).collect();
        out::write_manifest(dir, &out::Manifest::new(context, &all)?)?;
    }
    let (mut exit, mut runs) = (Exit::Fine, Vec::new());
    for ((scenario, planned), batch) in plans.iter().zip(&batches) {
        let (label, mode) = (batch.label, batch.mode);
        let trials = batch.run(context.talk, &context.stop)?;
        exit = batch::graver(exit, batch::judge(mode, planned, &trials));
        if let Some(dir) = &out {
            out::write_trials(dir, &format!("{label}.jsonl"), &trials)?;
        }
        let folded = batch::fold(scenario, mode, context.seed, planned, trials);
        runs.push(RunObject { platform: args.platform.clone(), ..folded });
    }
    let each = args.scenarios.iter().zip(&batches).zip(&runs);
    let ran: Vec<Ran<'_>> = each.map(|((scenario, batch), run)| Ran { scenario, batch, trials: &run.trials }).collect();
    let ended: Vec<_> = ran.iter().flat_map(|ran| batch::ended(ran.batch.planned, ran.trials)).collect();
    let recordings: Vec<PathBuf> = ran.iter().flat_map(Ran::recordings).collect();
    let next = next_of_runs(context, &ran, out.as_deref());
    finish(context, engine, runs, out.as_deref())?;
    Closing::new(context).ended("cells", &ended).verified(&recordings)?.print(next);
    Ok(exit)
}

/// A window has one user for a whole trial, so one trial only is allowed.
fn one_window(args: &Args, plans: &[(Scenario, Vec<Planned>)]) -> Result<(), Failure> {
    let reason = match plans {
        [(scenario, planned)] if planned.len() > 1 => {
            let cells: Vec<&str> = planned.iter().filter_map(|one| one.variation.cell.as_deref()).collect();
            format!("choose one cell of `{}` with --cell: {}", scenario.name.as_str(), cells.join(", "))
        }
        [(_, _)] if args.trials.is_none_or(|n| n == 1) => return live::display(),
        [(_, _)] => "leave --trials out".to_owned(),
        _ => "name one scenario".to_owned(),
    };
    Err(Failure::new(Exit::Usage, format!("--console opens a window on one trial: {reason}")))
}

/// Digest of a trial's recording, to be noted by the user.
fn told_of(trial: &Trial) -> Option<String> {
    let cell = trial.cell.as_ref().map(|cell| format!("{cell}, ")).unwrap_or_default();
    Some(joined(&[trial.held.clone()?, format!("{cell}seed {}", trial.seed)], "  ", width()).join("\n  "))
}

fn finish(
    context: &Context,
    mode: Mode,
    mut runs: Vec<RunObject>,
    out: Option<&std::path::Path>,
) -> Result<(), Failure> {
    if !context.json {
        for run in &runs {
            out::show(run_table(run));
        }
        let told: Vec<String> = runs.iter().flat_map(|run| &run.trials).filter_map(told_of).collect();
        if !told.is_empty() {
            let all = if told.len() > MAX_TOLD { "; result.json has all" } else { "" };
            out::say(format_args!("to be noted: SHA-256 of held.json of each recording{all}"));
            told.iter().take(MAX_TOLD).for_each(|line| out::say(format_args!("{line}")));
        }
    }
    if runs.len() == 1
        && let Some(run) = runs.pop()
    {
        return give(context, "run", &run, out);
    }
    give(context, "runs", &RunsObject { schema_version: SCHEMA_VERSION, mode, seed: context.seed, runs }, out)
}

fn give(
    context: &Context,
    kind: &'static str,
    value: &impl Serialize,
    out: Option<&std::path::Path>,
) -> Result<(), Failure> {
    if let Some(dir) = out {
        out::write_result(dir, "result.json", kind, value)?;
    }
    if context.json { out::print_json(kind, value) } else { Ok(()) }
}
