//! `lab soak`: one long live run of the null attack, with the memory and the descriptors of every process sampled, and their growth.
//!
//! Samples of the first tenth are left out: caches and windows fill then. Descriptors of a confined process are seen by root alone.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::slope::Slope;
use evidence::SCHEMA_VERSION;
use evidence::trial::Outcome;
use results::report::new_table;
use runner::engine::{View, run_live};
use runner::failure::{Exit, Failure};
use runner::plan::PlanOptions;
use runner::{Context, out, plan};
use serde::Serialize;

/// Time between samples.
const EVERY: Duration = Duration::from_secs(2);
/// Bytes of a page.
const PAGE: f64 = 4096.0;
const MIB: f64 = 1_048_576.0;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Minutes of the run, at most the two hours of a scenario.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..=120))]
    minutes: u64,
    /// Keep the result here.
    #[arg(long, value_name = "DIR")]
    out: Option<std::path::PathBuf>,
}

/// Growth of one process.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Row {
    process: String,
    samples: usize,
    /// Resident memory at the first sample and the last, MiB.
    memory_mib: [f64; 2],
    /// MiB an hour.
    growth_mib: Option<Slope>,
    /// Descriptors at the first sample and the last.
    descriptors: Option<[usize; 2]>,
}

#[derive(Serialize)]
struct Measured {
    schema_version: u32,
    seed: u64,
    minutes: u64,
    outcome: Outcome,
    findings: Vec<String>,
    false_trips: u32,
    rows: Vec<Row>,
}

/// A process at one moment: seconds since the first sample, pages, descriptors.
type Sample = (f64, f64, Option<usize>);

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let nominal = scenario::load(&plan::file_of(context, "nominal")?)?;
    let long = nominal.soak(args.minutes as f64 * 60.0, 0.0);
    let planned = plan::of_scenario(context, &long, &PlanOptions { rendered: true, ..PlanOptions::default() })?;
    let Some(one) = planned.first() else { return Err(Failure::new(Exit::NoEvidence, "nothing to run")) };
    let bool = AtomicBool::new(false);
    let (run, samples) = std::thread::scope(|scope| {
        let sampler = scope.spawn(|| sample(&bool));
        let run = run_live(&long, &one.setup, context.seed, &context.stop, View::unattended(&mut |_| {}));
        bool.store(true, Ordering::Relaxed);
        (run, sampler.join().unwrap_or_default())
    });
    let run = run?;
    let trial = oracle::judged::trial(context.seed, long.level(), &run.evidence, &run.verdict);
    let rows = samples.into_iter().map(|(process, samples)| row(process, &samples)).collect();
    let measured = Measured {
        schema_version: SCHEMA_VERSION,
        seed: context.seed,
        minutes: args.minutes,
        outcome: trial.outcome,
        findings: trial.findings,
        false_trips: trial.false_trips,
        rows,
    };
    if let Some(dir) = &args.out {
        let dir = out::directory(dir, Some(dir), "soak")?;
        out::write_result(&dir, "result.json", "bench-soak", &measured)?;
    }
    match context.json {
        true => out::print_json("bench-soak", &measured)?,
        false => show(&measured),
    }
    Ok(if measured.outcome == Outcome::Nominal { Exit::Fine } else { Exit::Unexpected })
}

/// Every service of this program until the run is over, by name and number of its process.
fn sample(bool: &AtomicBool) -> BTreeMap<String, Vec<Sample>> {
    let (mut samples, mut at) = (BTreeMap::<String, Vec<Sample>>::new(), 0.0);
    while !bool.load(Ordering::Relaxed) {
        for entry in fs::read_dir("/proc").into_iter().flatten().filter_map(Result::ok) {
            let process = entry.path();
            let Some(name) = service(&process) else { continue };
            let pages = fs::read_to_string(process.join("statm")).ok().and_then(|text| {
                let resident = text.split(' ').nth(1)?;
                resident.parse::<f64>().ok()
            });
            let descriptors = fs::read_dir(process.join("fd")).ok().map(Iterator::count);
            if let Some(pages) = pages {
                let name = format!("{name} {}", entry.file_name().to_string_lossy());
                samples.entry(name).or_default().push((at, pages, descriptors));
            }
        }
        link::clock::pause(EVERY);
        at += EVERY.as_secs_f64();
    }
    samples
}

/// The name of the service that a process of this program is.
fn service(process: &Path) -> Option<String> {
    let words = fs::read(process.join("cmdline")).ok()?;
    let mut words = words.split(|byte| *byte == 0);
    let own_path = std::env::current_exe().ok()?;
    let ours = words.next()? == own_path.as_os_str().as_encoded_bytes() && words.next()? == b"service";
    let name = words.next().filter(|_| ours)?;
    Some(String::from_utf8_lossy(name).into_owned())
}

fn row(process: String, samples: &[Sample]) -> Row {
    let settled = &samples[samples.len() / 10..];
    let points: Vec<(f64, f64)> = settled.iter().map(|(at, pages, _)| (at / 3600.0, pages * PAGE / MIB)).collect();
    let ends = |get: &dyn Fn(&Sample) -> f64| [settled.first(), settled.last()].map(|s| s.map_or(0.0, get));
    let descriptors = settled.first().zip(settled.last()).and_then(|(first, last)| Some([first.2?, last.2?]));
    Row {
        process,
        samples: settled.len(),
        memory_mib: ends(&|(_, pages, _)| pages * PAGE / MIB),
        growth_mib: Slope::from_points(&points),
        descriptors,
    }
}

fn show(measured: &Measured) {
    let Measured { minutes, outcome, findings, false_trips, rows, .. } = measured;
    let mut table = new_table(&["process", "samples", "MiB", "MiB an hour, 95 %", "descriptors"]);
    for row in rows {
        let growth = row.growth_mib.map_or_else(
            || "-".to_owned(),
            |slope| format!("{:.2} ({:.2} to {:.2})", slope.each, slope.interval[0], slope.interval[1]),
        );
        let descriptors = row.descriptors.map_or_else(|| "-".to_owned(), |[first, last]| format!("{first} to {last}"));
        let [first, last] = row.memory_mib;
        table.add_row(vec![
            row.process.clone(),
            row.samples.to_string(),
            format!("{first:.1} to {last:.1}"),
            growth,
            descriptors,
        ]);
    }
    out::say(format_args!("{table}"));
    let reason = if findings.is_empty() { String::new() } else { format!(" ({})", findings.join("; ")) };
    out::say(format_args!("{minutes} min: {}{reason}, {false_trips} false trips", outcome.name()));
}
