//! `lab liveness`: the operating curve of detectors of silence, latency against false trips.
//!
//! It measures a model of the stream and prints; no test asserts its numbers, and no part of the platform runs.

use std::path::PathBuf;

use crate::liveness::{Detector, Draws, Weather};
use crate::report::{LivenessObject, liveness_svg, liveness_table};
use evidence::SCHEMA_VERSION;
use parallel::progress::Progress;
use runner::failure::{Exit, Failure};
use runner::{Context, out};

/// Losses and jitters, in milliseconds, that make the weather.
const LOSSES: [f64; 7] = [0.0, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2];
const JITTERS: [f64; 3] = [0.0, 20.0, 50.0];

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Hours of stream in each weather.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..=1_000))]
    hours: u64,
    /// Keep result and plot here.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let out = args.out.as_ref().map(|dir| out::directory(dir, Some(dir), "liveness")).transpose()?;
    let draws = Draws::new(context.seed, args.hours);
    let weathers = weathers();
    let progress = Progress::new("weathers", weathers.len(), context.talk);
    let mut outcomes = Vec::new();
    for weather in weathers {
        outcomes.extend(Detector::all().into_iter().map(|detector| draws.watch(detector, weather)));
        progress.step();
    }
    progress.finish();
    let curve = LivenessObject::new(SCHEMA_VERSION, context.seed, outcomes);
    if let Some(dir) = &out {
        out::write_result(dir, "result.json", "bench-liveness", &curve)?;
        out::write_text(dir, "liveness.svg", &liveness_svg(&curve))?;
    }
    if context.json {
        out::print_json("bench-liveness", &curve)?;
    } else {
        out::say(format_args!("{}", liveness_table(&curve)));
    }
    Ok(Exit::Fine)
}

/// Steady and changing; without loss there is no changing weather.
fn weathers() -> Vec<Weather> {
    let steady = JITTERS.iter().flat_map(|j| LOSSES.iter().map(|l| (*l, *j, false)));
    let changing = JITTERS.iter().flat_map(|j| LOSSES[1..].iter().map(|l| (*l, *j, true)));
    steady.chain(changing).map(|(loss, jitter_ms, changing)| Weather { loss, jitter_ms, changing }).collect()
}
