//! `lab detector`: quality of the detector and of the stages beside it, cell by cell, on frames that were not used in
//! training.
//!
//! It measures and prints; no test asserts its numbers.

use dataset::cells::{self, Split};
use dataset::quality::{Quality, measure};
use evidence::SCHEMA_VERSION;
use parallel::progress::Progress;
use perception::corroborate::CorroborationLimits;
use perception::runtime;
use results::report::started;
use runner::custom_detector::DetectorOptions;
use runner::failure::{Exit, Failure};
use runner::{Context, out};
use serde::Serialize;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Frames of each cell and split; the first has the number that --seed gives.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u64).range(2..=100_000))]
    frames: u64,
    /// Conditions, as in measurements/dataset/cells.toml; all of them without it.
    #[arg(long, value_name = "NAME")]
    cell: Vec<String>,
    #[command(flatten)]
    bring: DetectorOptions,
}

#[derive(Serialize)]
struct Measured {
    schema_version: u32,
    seed: u64,
    runtime: String,
    rows: Vec<Quality>,
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Exit, Failure> {
    let (cells, splits) = (
        cells::chosen(&args.cell).map_err(|e| Failure::new(Exit::Usage, e.to_string()))?,
        [Split::HeldOut, Split::Novel],
    );
    let stages = args.bring.stages()?;
    let progress = Progress::new("cells", cells.len() * splits.len(), context.talk);
    let mut rows = Vec::new();
    for split in splits {
        for cell in &cells {
            if context.stop.is_requested() {
                return Err(Failure::new(Exit::Interrupted, "interrupted"));
            }
            let numbers = context.seed..context.seed + args.frames;
            rows.push(
                measure(&stages, cell, split, numbers, &CorroborationLimits::default()).map_err(Failure::internal)?,
            );
            progress.step();
        }
    }
    progress.finish();
    let runtime = runtime::describe().map_err(Failure::internal)?.to_owned();
    let measured = Measured { schema_version: SCHEMA_VERSION, seed: context.seed, runtime, rows };
    if context.json {
        out::print_json("bench-detector", &measured)?;
    } else {
        out::say(format_args!("{}", table(&measured)));
    }
    Ok(Exit::Fine)
}

fn table(measured: &Measured) -> String {
    let mut table = started();
    table.set_header([
        "split",
        "cell",
        "objects",
        "mAP@0.5 (95 %)",
        "ECE",
        "thermal",
        "corroborated",
        "right",
        "off, m",
    ]);
    for row in &measured.rows {
        table.add_row([
            row.split.to_owned(),
            format!("{}{}", row.cell, if row.learnt { "" } else { " *" }),
            row.objects.to_string(),
            format!("{:.3} ({:.3} to {:.3})", row.mean_average_precision, row.interval[0], row.interval[1]),
            format!("{:.3}", row.calibration_error),
            row.thermal_balanced_accuracy.map_or("–".to_owned(), |share| format!("{share:.3}")),
            format!("{:.3}", row.sightings.recall()),
            format!("{:.3}", row.sightings.precision()),
            format!("{:.2}", row.sightings.error_m()),
        ]);
    }
    let frames = measured.rows.first().map_or(0, |row| row.frames);
    format!("{table}\n{frames} frames a row, {}; * nothing was learnt from such conditions", measured.runtime)
}
