//! `lab kill`: each process of live runs killed at a random moment, the mode the platform ends in, the delay, and the
//! plant's standstill. The same kills run in the twin, whose classes must contain the live ones.
//!
//! The required response is `oracle::process_fault`'s table, stated before any run; here it is only run, counted and
//! printed.

use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::report::{KillRow, kill_table};
use evidence::process_fault::Response;
use evidence::trial::{Outcome, Trial};
use evidence::{SCHEMA_VERSION, Under};
use oracle::process_fault;
use oracle::process_fault::RequiredResponse;
use results::mode::Mode;
use runner::batch::Batch;
use runner::failure::{Exit, Failure};
use runner::plan::{PlanOptions, Planned};
use runner::{Context, batch, out, plan};
use scenario::{Process, Scenario};
use serde::Serialize;
use topology::node_of;
use wire::mode::Mode as Driving;

use super::transitions;

/// The processes in the order in which they are killed, by their names on the command line.
pub(super) const PROCESSES: [(&str, Process); 8] = [
    ("sim", Process::Sim),
    ("perception", Process::Perception),
    ("autonomy", Process::Autonomy),
    ("gateway", Process::Gateway),
    ("relay", Process::Adversary),
    ("broker", Process::Broker),
    ("recorder", Process::Recorder),
    ("console", Process::Console),
];

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Live runs for each process; as many twin trials.
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    pub(super) runs: u64,
    /// Only these processes, such as sim,autonomy.
    #[arg(long, value_delimiter = ',', value_name = "PROCESS",
          value_parser = clap::builder::PossibleValuesParser::new(PROCESSES.map(|(name, _)| name)))]
    pub(super) only: Vec<String>,
    /// A platform in place of `ground`, by name or by file; live runs are unrendered where no network is trained for its views.
    #[arg(long, conflicts_with = "at_transitions")]
    platform: Option<String>,
    /// Live runs at a time.
    #[arg(long, value_name = "J", default_value_t = 1, value_parser = batch::jobs)]
    jobs: usize,
    /// Kill in the twin only.
    #[arg(long)]
    twin: bool,
    /// Kill, hang and slow each of them at each change of mode of `process_ends`, in the twin.
    #[arg(long)]
    at_transitions: bool,
    /// Keep manifest, trials, result and recordings here.
    #[arg(long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
}

#[derive(Serialize)]
struct Measured {
    schema_version: u32,
    seed: u64,
    rows: Vec<KillRow>,
    trials: BTreeMap<&'static str, Vec<Trial>>,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    if args.at_transitions {
        return transitions::run(context, args);
    }
    let nominal = scenario::load(&plan::file_of(context, "nominal")?)?;
    let twin = planned(context, args, &nominal, Mode::Twin)?;
    let live = if args.twin { Vec::new() } else { planned(context, args, &nominal, Mode::Live)? };
    let out = args.out.as_ref().map(|dir| out::directory(dir, Some(dir), "kill")).transpose()?;
    if let Some(dir) = &out {
        let all: Vec<Planned> = twin.iter().chain(&live).cloned().collect();
        out::write_json(dir, "manifest.json", &out::Manifest::new(context, &all)?)?;
    }
    let (mut exit, mut rows, mut trials) = (Exit::Fine, Vec::new(), BTreeMap::new());
    for (mode, planned) in [(Mode::Twin, &twin), (Mode::Live, &live)] {
        if planned.is_empty() {
            continue;
        }
        let label = format!("kill ({})", mode.name());
        let (n, seed, jobs) = (args.runs, context.seed, args.jobs);
        let batch = Batch { label: &label, mode, planned, n, seed, jobs, out: out.as_deref() };
        let done = batch.run(context.talk, &context.stop)?;
        exit = batch::graver(exit, batch::judge(mode, planned, &done));
        if let Some(dir) = &out {
            out::write_trials(dir, &format!("kill.{}.jsonl", mode.name()), &done)?;
        }
        rows.extend(planned.iter().map(|one| row(one, mode, &done)));
        trials.insert(mode.name(), done);
    }
    let measured = Measured { schema_version: SCHEMA_VERSION, seed: context.seed, rows, trials };
    if let Some(dir) = &out {
        out::write_result(dir, "result.json", "bench-kill", &measured)?;
    }
    if context.json {
        out::print_json("bench-kill", &measured)?;
    } else {
        out::say(format_args!("{}", kill_table(&measured.rows)));
    }
    Ok(exit)
}

/// One variation of the null attack for each process that is to be killed.
fn planned(context: &Context, args: &Args, nominal: &Scenario, mode: Mode) -> Result<Vec<Planned>, Failure> {
    let platform = args.platform.as_ref().map(|name| plan::platform_of(context, name)).transpose()?;
    let wanted = PlanOptions { platform, rendered: mode == Mode::Live, where_trained: true, ..PlanOptions::default() };
    let mut all = Vec::new();
    for (name, process) in PROCESSES {
        if !args.only.is_empty() && !args.only.iter().any(|only| only == name) {
            continue;
        }
        let expected = [required_response(process)?.ends_in].map(class);
        let twin = if mode == Mode::Twin { " --twin" } else { "" };
        let on = args.platform.as_ref().map_or_else(String::new, |name| format!(" --platform {name}"));
        for mut one in plan::of_scenario(context, &nominal.killing(process, &expected), &wanted)? {
            one.variation.cell = Some(name.to_owned());
            one.command = Some(format!("lab kill --only {name} --runs 1{on}{twin}"));
            all.push(one);
        }
    }
    Ok(all)
}

fn required_response(process: Process) -> Result<&'static RequiredResponse, Failure> {
    let node = node_of(process);
    process_fault::required_response(Under::A, node)
        .ok_or_else(|| Failure::internal(format!("nothing is stated of the death of {node}")))
}

/// The class of a trial that ends in this mode by itself.
fn class(mode: Driving) -> Outcome {
    match mode {
        Driving::HoldSafe => Outcome::HoldSafe,
        Driving::Degraded => Outcome::Degraded,
        Driving::Idle | Driving::Ready | Driving::PrepareToAct => Outcome::Undetected,
    }
}

fn row(planned: &Planned, mode: Mode, trials: &[Trial]) -> KillRow {
    let cell = planned.variation.cell.clone().unwrap_or_default();
    let own_trials: Vec<&Trial> = trials.iter().filter(|t| t.cell == planned.variation.cell).collect();
    let responses: Vec<&Response> =
        own_trials.iter().filter(|t| t.outcome != Outcome::Invalid).flat_map(|t| &t.responses).collect();
    let owed =
        PROCESSES.iter().find(|(name, _)| *name == cell).and_then(|(_, process)| required_response(*process).ok());
    KillRow::new(cell, mode, owed, &planned.setup.bounds, &own_trials, &responses)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_killed_process_has_a_stated_response() {
        assert!(PROCESSES.iter().all(|(_, process)| required_response(*process).is_ok()));
        assert_eq!(PROCESSES.len(), process_fault::REQUIRED_RESPONSES.len());
    }
}
