//! `lab faults`: the platform under faults of its processes, clocks, disk, memory, links and files, one row each, and a count of anything of
//! ours that is on the machine afterwards.
//!
//! Faults of processes are those of a scenario, at moments that the seed draws, and are judged by the oracle's table of required responses.
//! Clocks and limits are set around a service by a script that starts it. Each row is numbered as the plan of faults is
//! (`docs/reviewer/faults.md`).

mod machine;

use std::path::PathBuf;

use evidence::SCHEMA_VERSION;
use evidence::trial::Trial;
use results::mode::Mode;
use runner::batch::Batch;
use runner::failure::{Exit, Failure};
use runner::plan::{PlanOptions, Planned};
use runner::{Context, batch, out, plan};
use scenario::{Process, Scenario};
use serde::Serialize;

use self::machine::{Around, left};
use super::kill::PROCESSES;
use super::tamper;
use crate::report::{Attempts, FaultRow, Left, fault_table, survived};

/// Lengths of stops, seconds.
const STOPS_S: [f64; 3] = [0.2, 1.0, 5.0];
/// Pairs of processes that are killed, and the seconds between.
const PAIRS: [(Process, Process, f64); 4] = [
    (Process::Broker, Process::Perception, 0.1),
    (Process::Gateway, Process::Recorder, 0.05),
    (Process::Perception, Process::Gateway, 0.2),
    (Process::Recorder, Process::Autonomy, 0.1),
];
/// Shares of lost datagrams, and longest delays in milliseconds.
const LINKS: ([f64; 7], [i64; 6]) = ([0.0, 0.01, 0.05, 0.1, 0.2, 0.3, 0.5], [0, 10, 50, 100, 200, 500]);
/// Scenarios that are a row as they are, with the fault's number.
const SCENARIOS: [(&str, &str); 7] = [
    ("F4", "disk_full"),
    ("F6", "malformed"),
    ("F7", "silent_hello"),
    ("F7", "hello_storm"),
    ("F8", "command_stall"),
    ("F8", "slow_inference"),
    ("F9", "certificates"),
];

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Live runs of each fault; of faults of links as many twin trials.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=1_000))]
    runs: u64,
    /// Only these faults, such as F1,F3,combined.
    #[arg(long, value_delimiter = ',', value_name = "FAULT")]
    only: Vec<String>,
    /// Live runs at a time.
    #[arg(long, value_name = "J", default_value_t = 1, value_parser = batch::jobs)]
    jobs: usize,
    /// Repeat a live trial up to N times when a stall of the host alone makes it INVALID.
    #[arg(long, value_name = "N", default_value_t = 2)]
    retries: u32,
    /// Keep the result here.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

#[derive(Serialize)]
struct Measured {
    schema_version: u32,
    seed: u64,
    rows: Vec<FaultRow>,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let out = args.out.as_ref().map(|dir| out::directory(dir, Some(dir), "faults")).transpose()?;
    let mut measuring = Measuring { context, args, before: left()?, rows: Vec::new() };
    measuring.processes()?;
    measuring.scenarios()?;
    measuring.links()?;
    measuring.measure()?;
    measuring.files()?;
    let measured = Measured { schema_version: SCHEMA_VERSION, seed: context.seed, rows: measuring.rows };
    if let Some(dir) = &out {
        out::write_result(dir, "result.json", "bench-faults", &measured)?;
    }
    if context.json {
        out::print_json("bench-faults", &measured)?;
    } else {
        out::say(format_args!("{}", fault_table(&measured.rows)));
    }
    let whole = measured.rows.iter().all(|row| row.lost == 0 && row.left == Default::default());
    Ok(if whole { Exit::Fine } else { Exit::Unexpected })
}

struct Measuring<'a> {
    context: &'a Context,
    args: &'a Args,
    /// Things of other runs on the machine.
    before: Left,
    rows: Vec<FaultRow>,
}

impl Measuring<'_> {
    fn wanted(&self, fault: &str) -> bool {
        self.args.only.is_empty() || self.args.only.iter().any(|only| only == fault)
    }

    /// Things of ours that were not there before.
    fn left(&self) -> Result<Left, Failure> {
        let (now, before) = (left()?, self.before);
        Ok(Left {
            processes: now.processes.saturating_sub(before.processes),
            segments: now.segments.saturating_sub(before.segments),
            folders: now.folders.saturating_sub(before.folders),
            namespaces: now.namespaces.saturating_sub(before.namespaces),
        })
    }

    fn add(
        &mut self,
        fault: &'static str,
        name: String,
        mode: &'static str,
        attempts: &Attempts,
    ) -> Result<(), Failure> {
        let row = FaultRow::new(fault, name, mode, attempts, self.left()?);
        for trial in attempts.trials.iter().filter(|trial| !survived(trial)) {
            let broken = trial.responses.iter().filter(|response| !response.in_time);
            let broken: Vec<String> = broken.map(|response| format!("{response:?}")).collect();
            let reason = [trial.findings.clone(), broken].concat().join("; ");
            link::note!("{fault} {}: seed {}, {} ({reason})", row.what, trial.seed, trial.outcome.name());
        }
        link::note!("{fault} {}: {} attempts, {} lost", row.what, row.attempts, row.lost);
        self.rows.push(row);
        Ok(())
    }

    /// One row of trials of a scenario.
    fn trials(&mut self, fault: &'static str, name: String, scenario: &Scenario, mode: Mode) -> Result<(), Failure> {
        let rendered = mode == Mode::Live;
        let wanted = PlanOptions { rendered, where_trained: rendered, ..PlanOptions::default() };
        let mut planned: Vec<Planned> = plan::of_scenario(self.context, scenario, &wanted)?;
        for one in &mut planned {
            one.setup.retries = self.args.retries;
            one.command = Some(format!("lab faults --only {fault} --runs 1"));
        }
        let (n, seed, jobs) = (self.args.runs, self.context.seed, self.args.jobs);
        let batch = Batch { label: &name, mode, planned: &planned, n, seed, jobs, out: None };
        let trials: Vec<Trial> = batch.run(self.context.talk, &self.context.stop)?;
        self.add(fault, name, mode.name(), &Attempts { trials, refused: 0 })
    }

    fn processes(&mut self) -> Result<(), Failure> {
        let nominal = scenario::load(&plan::file_of(self.context, "nominal")?)?;
        let [kills, stops, pairs] = ["F1", "F2", "combined"].map(|fault| self.wanted(fault));
        for (name, process) in PROCESSES.into_iter().filter(|_| kills) {
            self.trials("F1", format!("kill of {name}"), &nominal.killing(process, &[]), Mode::Live)?;
        }
        for (name, process) in PROCESSES.into_iter().filter(|_| stops) {
            for seconds in STOPS_S {
                self.trials(
                    "F2",
                    format!("{name} stopped for {seconds} s"),
                    &nominal.hanging(process, seconds),
                    Mode::Live,
                )?;
            }
        }
        if self.wanted("F10") {
            let label = "broker killed within 50 ms of a HOLD".to_owned();
            self.trials("F10", label, &nominal.killing_broker_at_hold(), Mode::Live)?;
        }
        for (first, second, apart_s) in PAIRS.into_iter().filter(|_| pairs) {
            let label = format!("kill of {first:?}, and of {second:?} {apart_s} s later").to_lowercase();
            self.trials("combined", label, &nominal.killing_both(first, second, apart_s), Mode::Live)?;
        }
        Ok(())
    }

    fn scenarios(&mut self) -> Result<(), Failure> {
        for (fault, name) in SCENARIOS {
            if !self.wanted(fault) {
                continue;
            }
            let scenario = scenario::load(&plan::file_of(self.context, name)?)?;
            let mode = if scenario.is_of_stacks() { Mode::Stack } else { Mode::Live };
            self.trials(fault, name.replace('_', " "), &scenario, mode)?;
        }
        Ok(())
    }

    fn links(&mut self) -> Result<(), Failure> {
        let nominal = scenario::load(&plan::file_of(self.context, "nominal")?)?;
        let (losses, jitters) = LINKS;
        let links = self.wanted("F5");
        for loss in losses.into_iter().filter(|_| links) {
            let name = format!("loss {} %, delays up to 500 ms", loss * 100.0);
            let (n, seed, jobs) = (self.args.runs, self.context.seed, self.args.jobs);
            let mut trials = Vec::new();
            for bad in jitters.into_iter().filter_map(|jitter| nominal.on_a_bad_link(loss, jitter)) {
                let planned = plan::of_scenario(self.context, &bad, &PlanOptions::default())?;
                let batch = Batch { label: &name, mode: Mode::Twin, planned: &planned, n, seed, jobs, out: None };
                trials.extend(batch.run(self.context.talk, &self.context.stop)?);
            }
            self.add("F5", name, Mode::Twin.name(), &Attempts { trials, refused: 0 })?;
        }
        Ok(())
    }

    /// Clocks, descriptors, memory, and shared memory that is full, around one service or all.
    fn measure(&mut self) -> Result<(), Failure> {
        for around in Around::all() {
            if !self.wanted(around.fault) {
                continue;
            }
            let attempts = around.attempts(self.context, self.args.runs, self.args.retries)?;
            let Some(attempts) = attempts else {
                link::note!("{} {}: not tried, {}", around.fault, around.what, around.needs);
                continue;
            };
            self.add(around.fault, around.what, Mode::Live.name(), &attempts)?;
        }
        Ok(())
    }

    fn files(&mut self) -> Result<(), Failure> {
        if !self.wanted("F13") {
            return Ok(());
        }
        let (attempts, survived) = tamper::power_cuts(self.context)?;
        let name = "recording cut at each byte: read up to its last seal".to_owned();
        let mut row =
            FaultRow::new("F13", name, "files", &Attempts { trials: Vec::new(), refused: attempts }, self.left()?);
        (row.survived, row.refused, row.lost) = (survived, 0, attempts - survived);
        row.lost_upper_95 = stats::rate_upper(row.lost, attempts, stats::LEVEL);
        self.rows.push(row);
        Ok(())
    }
}
