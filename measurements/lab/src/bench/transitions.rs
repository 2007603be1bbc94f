//! `lab kill --at-transitions`: every process killed, hung and slowed at every change of mode that the mission of
//! `process_ends` goes through, in the twin; and the share of trials in which every required response came in time.
//!
//! The required responses are `oracle::process_fault`'s; no process may arm or leave HOLD_SAFE by itself, which is the
//! oracle's P9 in every trial.

use std::collections::BTreeMap;

use crate::report::{TransitionRow, transition_table};
use evidence::SCHEMA_VERSION;
use evidence::trial::{Outcome, Trial};
use runner::batch::Batch;
use runner::failure::{Exit, Failure};
use runner::plan::{PlanOptions, Planned};
use runner::{Context, batch, out, plan};
use scenario::Ending;
use serde::Serialize;
use wire::mode::Mode;

use super::kill::{Args, PROCESSES};

const ENDINGS: [(&str, Ending); 3] = [("kill", Ending::Kill), ("hang", Ending::Hang), ("slow", Ending::Slow)];

/// The changes of mode of the mission, in order.
const CHANGES: [(Mode, Mode); 7] = {
    use Mode::{Degraded, HoldSafe, Idle, PrepareToAct, Ready};
    [
        (Idle, Ready),
        (Ready, PrepareToAct),
        (PrepareToAct, Ready),
        (Ready, HoldSafe),
        (HoldSafe, Ready),
        (Ready, Degraded),
        (Degraded, Ready),
    ]
};

#[derive(Serialize)]
struct Measured {
    schema_version: u32,
    seed: u64,
    rows: Vec<TransitionRow>,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let planned = planned(context, args)?;
    let mode = results::mode::Mode::Twin;
    let out = args.out.as_ref().map(|dir| out::directory(dir, Some(dir), "transitions")).transpose()?;
    if let Some(dir) = &out {
        out::write_json(dir, "manifest.json", &out::Manifest::new(context, &planned)?)?;
    }
    let (n, seed) = (args.runs, context.seed);
    let batch = Batch { label: "transitions", mode, planned: &planned, n, seed, jobs: 1, out: None };
    let trials = batch.run(context.talk, &context.stop)?;
    let exit = batch::judge(mode, &planned, &trials);
    let rows = rows(&trials);
    let measured = Measured { schema_version: SCHEMA_VERSION, seed, rows };
    if let Some(dir) = &out {
        out::write_trials(dir, "transitions.jsonl", &trials)?;
        out::write_result(dir, "result.json", "bench-transitions", &measured)?;
    }
    if context.json {
        out::print_json("bench-transitions", &measured)?;
    } else {
        out::say(format_args!("{}", transition_table(&measured.rows)));
    }
    Ok(exit)
}

fn planned(context: &Context, args: &Args) -> Result<Vec<Planned>, Failure> {
    let base = scenario::load(&plan::file_of(context, "process_ends")?)?;
    let mut all = Vec::new();
    for (name, process) in PROCESSES {
        if !args.only.is_empty() && !args.only.iter().any(|only| only == name) {
            continue;
        }
        for (how, ending) in ENDINGS {
            for change in CHANGES {
                let cell = base.ending_at(process, ending, change);
                for mut one in plan::of_scenario(context, &cell, &PlanOptions::default())? {
                    one.variation.cell = Some(format!("{name}/{how}/{}", label(change)));
                    one.command = Some(format!("lab kill --at-transitions --only {name} --runs 1"));
                    all.push(one);
                }
            }
        }
    }
    Ok(all)
}

fn label((from, to): (Mode, Mode)) -> String {
    format!("{} to {}", from.name(), to.name())
}

/// One row for each process and ending, a count for each change.
fn rows(trials: &[Trial]) -> Vec<TransitionRow> {
    let mut rows: Vec<TransitionRow> = Vec::new();
    for trial in trials {
        let Some((pair, change)) = trial.cell.as_deref().and_then(|cell| cell.rsplit_once('/')) else { continue };
        if rows.last().is_none_or(|row| row.pair != pair) {
            rows.push(TransitionRow { pair: pair.to_owned(), changes: BTreeMap::new() });
        }
        let Some(row) = rows.last_mut() else { continue };
        let broken = matches!(trial.outcome, Outcome::Unsafe | Outcome::Invalid | Outcome::Late);
        let kept = !broken && !trial.responses.is_empty() && trial.responses.iter().all(|r| r.in_time);
        row.count(change, trial.responses.iter().any(|r| r.required), kept, trial.outcome);
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_cover_every_process_ending_and_change() {
        assert_eq!(PROCESSES.len() * ENDINGS.len() * CHANGES.len(), 168);
        let labels: std::collections::BTreeSet<String> = CHANGES.into_iter().map(label).collect();
        assert_eq!(labels.len(), CHANGES.len());
    }
}
