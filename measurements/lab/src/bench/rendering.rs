//! `lab rendering`: the same seeds with rendered sensors and without, and the share of trials that end otherwise.
//!
//! A trial without rendering stands on a noise model in place of sensors and detectors; this is the cost of that in
//! conclusions. It measures and prints; no test asserts its numbers.

use std::collections::BTreeMap;
use std::path::PathBuf;

use evidence::SCHEMA_VERSION;
use evidence::trial::Trial;
use results::mode::Mode;
use results::report::started;
use runner::batch::Batch;
use runner::failure::{Exit, Failure};
use runner::plan::{PlanOptions, Planned};
use runner::{Context, out, plan};
use serde::Serialize;
use stats::Share;

/// Scenarios in which sensing decides: quiet, losses of a modality, and disguises.
const SCENARIOS: [&str; 8] = [
    "nominal",
    "thermal_loss",
    "rgb_loss",
    "track_starvation",
    "billboard",
    "decoy_cold",
    "decoy_warm",
    "decoy_thermal_lost",
];

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Scenarios, by name or by file; without any, those in which sensing decides.
    #[arg(value_name = "SCENARIO")]
    scenario: Vec<String>,
    /// Pairs of each variation.
    #[arg(long, value_name = "N", default_value_t = 299, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    runs: u64,
    /// Keep result and trials here.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

#[derive(Serialize)]
struct Measured {
    schema_version: u32,
    seed: u64,
    rows: Vec<Row>,
}

/// One variation.
#[derive(Serialize)]
struct Row {
    scenario: String,
    cell: Option<String>,
    /// Pairs that ended otherwise, with the 95 % interval of their share.
    otherwise: Share,
    /// Number of these by their classes: without rendering, and with.
    pairs: BTreeMap<String, u64>,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let out = args.out.as_ref().map(|dir| out::directory(dir, Some(dir), "bench")).transpose()?;
    let names: Vec<&str> = match args.scenario.is_empty() {
        true => SCENARIOS.to_vec(),
        false => args.scenario.iter().map(String::as_str).collect(),
    };
    let ways = [
        ("unrendered", PlanOptions::default()),
        ("rendered", PlanOptions { rendered: true, ..PlanOptions::default() }),
    ];
    let mut trials: Vec<Vec<Trial>> = Vec::new();
    let mut planned: Vec<Planned> = Vec::new();
    for (label, wanted) in &ways {
        planned.clear();
        for name in &names {
            planned.extend(plan::plan(context, &plan::file_of(context, name)?, wanted)?.1);
        }
        let (n, seed) = (args.runs, context.seed);
        let batch = Batch { label, mode: Mode::Twin, planned: &planned, n, seed, jobs: 1, out: None };
        let ran = batch.run(context.talk, &context.stop)?;
        if let Some(dir) = &out {
            out::write_trials(dir, &format!("{label}.jsonl"), &ran)?;
        }
        trials.push(ran);
    }
    let [ablated_trials, with] = &trials[..] else { return Err(Failure::internal("two ways")) };
    let chunks = ablated_trials.chunks(args.runs as usize).zip(with.chunks(args.runs as usize));
    let rows = planned
        .iter()
        .zip(chunks)
        .map(|(planned, (ablated_trials, with))| row(planned, ablated_trials, with))
        .collect();
    let measured = Measured { schema_version: SCHEMA_VERSION, seed: context.seed, rows };
    if let Some(dir) = &out {
        out::write_result(dir, "result.json", "bench-rendering", &measured)?;
    }
    if context.json {
        out::print_json("bench-rendering", &measured)?;
    } else {
        out::say(format_args!("{}", table(&measured)));
    }
    Ok(Exit::Fine)
}

/// Trials of one variation, by seed.
fn row(planned: &Planned, ablated_trials: &[Trial], trials: &[Trial]) -> Row {
    let mut pairs = BTreeMap::new();
    for (a, b) in ablated_trials.iter().zip(trials).filter(|(a, b)| a.outcome != b.outcome) {
        *pairs.entry(format!("{} > {}", a.outcome.name(), b.outcome.name())).or_insert(0) += 1;
    }
    Row {
        scenario: planned.variation.scenario.name.as_str().to_owned(),
        cell: planned.variation.cell.clone(),
        otherwise: Share::new(pairs.values().sum(), ablated_trials.len() as u64),
        pairs,
    }
}

fn table(measured: &Measured) -> String {
    let mut table = started();
    table.set_header(["scenario", "pairs", "end otherwise", "share, 95 %", "unrendered > rendered"]);
    for row in &measured.rows {
        let name = row.cell.as_ref().map_or_else(|| row.scenario.clone(), |cell| format!("{} {cell}", row.scenario));
        let rate = &row.otherwise;
        let pairs: Vec<String> = row.pairs.iter().map(|(pair, n)| format!("{pair} {n}")).collect();
        let interval = format!("{:.1} to {:.1} %", 100.0 * rate.lower_95, 100.0 * rate.upper_95);
        table.add_row([name, rate.n.to_string(), rate.hits.to_string(), interval, pairs.join(", ")]);
    }
    table.to_string()
}
