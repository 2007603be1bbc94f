//! `lab stages`: duration of each stage live and in the twin, and the gap between the two.
//!
//! It measures the null attack and prints; no test asserts its numbers.

use crate::stages::{Delays, Quantiles, Row};
use evidence::SCHEMA_VERSION;
use parallel::progress::Progress;
use results::report::started;
use runner::custom_detector::DetectorOptions;
use runner::failure::{Exit, Failure};
use runner::plan::PlanOptions;
use runner::{Context, out, plan};
use serde::Serialize;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Live runs, and as many trials in the twin.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..=100))]
    runs: u64,
    #[command(flatten)]
    bring: DetectorOptions,
}

#[derive(Serialize)]
struct Measured {
    schema_version: u32,
    scenario: &'static str,
    seed: u64,
    runs: u64,
    stages: Vec<Row>,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let wanted = PlanOptions { rendered: true, detector: args.bring.load()?, ..PlanOptions::default() };
    let (_, planned) = plan::plan(context, &plan::file_of(context, "nominal")?, &wanted)?;
    let Some(one) = planned.first() else {
        return Err(Failure::new(Exit::NoEvidence, "nothing to run"));
    };
    let (mut live, mut twin) = (Delays::default(), Delays::default());
    let progress = Progress::new("stages", args.runs as usize, context.talk);
    for seed in (0..args.runs).map(|i| context.seed + i) {
        let scenario = &one.variation.scenario;
        crate::measured::twin_stages(scenario, &one.setup, seed, &mut twin)?;
        crate::measured::live_stages(scenario, &one.setup, seed, &context.stop, &mut live)?;
        progress.step();
    }
    progress.finish();
    let stages = Delays::compare(&live, &twin);
    let measured =
        Measured { schema_version: SCHEMA_VERSION, scenario: "nominal", seed: context.seed, runs: args.runs, stages };
    if context.json {
        out::print_json("bench-stages", &measured)?;
    } else {
        out::say(format_args!("{}", table(&measured)));
    }
    Ok(Exit::Fine)
}

fn table(measured: &Measured) -> String {
    let mut table = started();
    table.set_header(["stage", "live: n", "p5 / p50 / p95, us", "twin: n", "p5 / p50 / p95, us", "gap p50", "gap p95"]);
    let quantiles = |q: Quantiles| format!("{} / {} / {}", q.p5_us, q.p50_us, q.p95_us);
    for row in &measured.stages {
        table.add_row([
            format!("{} > {} ({})", row.from, row.to, row.way),
            row.live.n.to_string(),
            quantiles(row.live),
            row.twin.n.to_string(),
            quantiles(row.twin),
            format!("{:+}", row.gap_p50_us),
            format!("{:+}", row.gap_p95_us),
        ]);
    }
    format!("{table}\n{} runs of {} each, rendered; the gap is twin minus live", measured.runs, measured.scenario)
}
