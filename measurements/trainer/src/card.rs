//! The model card and the manifest that stand beside the model: its training and its measurements.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

use config::platform::Sensors;
use dataset::cells::{self, Cell, Split};
use dataset::example::ExampleError;
use dataset::quality::{Quality, QualityError, measure};
use dataset::sightings::Sightings;
use dataset::warmth::Claims;
use perception::corroborate::CorroborationLimits;
use perception::model::{Model, hex_digest};
use perception::stages::Stages;
use perception::{detector::Detector, head::Head, runtime};
use wire::sensor::Class;

use crate::data::heated;
use crate::interval::wilson;
use crate::sense::Sense;

/// Frames of each cell and split that the card rests on.
const FRAMES: u64 = 300;

/// Score thresholds that the card compares, permille, on tuning frames.
const THRESHOLDS: [u16; 6] = [250, 350, 400, 450, 500, 600];
/// Frames of each cell that is learnt from, for that.
const TUNING: u64 = 60;

/// Record of a model's training, left beside the model.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Training {
    /// Rounds in order.
    pub(crate) round: Vec<Round>,
}

/// One round of training.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Round {
    /// Seed of new weights and of batches.
    pub(crate) seed: u64,
    /// Batches.
    pub(crate) steps: u64,
    /// Frames in a batch.
    pub(crate) batch: u64,
    /// Largest change, of 255, by which half of each batch was made harder.
    #[serde(default)]
    pub(crate) hardened: u8,
    /// Patterns of heat, made against the weights of the round before or at random, that some fakes bore.
    #[serde(default)]
    pub(crate) patterns: u64,
    /// Frames learnt from.
    pub(crate) frames: u64,
    /// Objects on them.
    pub(crate) objects: u64,
    /// SHA-256 over images and labels.
    pub(crate) data_sha256: String,
    /// SHA-256 of the cells.
    pub(crate) cells_sha256: String,
    /// Processor time, minutes.
    pub(crate) cpu_minutes: u64,
}

impl Training {
    /// The record beside a model.
    pub(crate) fn read(sense: Sense, directory: &Path) -> Result<Self, Box<dyn std::error::Error>> {
        Ok(toml::from_str(&std::fs::read_to_string(sense.training(directory))?)?)
    }

    /// Writes it there.
    pub(crate) fn write(&self, sense: Sense, directory: &Path) -> Result<(), Box<dyn std::error::Error>> {
        Ok(std::fs::write(sense.training(directory), toml::to_string(self)?)?)
    }
}

/// A model of a directory, loaded, with the record of its training.
struct Made {
    bytes: usize,
    sha256: String,
    training: Training,
    detector: Arc<Detector>,
}

impl Made {
    fn read(sense: Sense, directory: &Path) -> Result<Self, Box<dyn std::error::Error>> {
        let bytes = std::fs::read(sense.model(directory))?;
        let sha256 = hex_digest(&bytes);
        let detector = Arc::new(Detector::with_planes(sense.inputs(), Model::pinned(&bytes, &sha256)?, Head::Grid)?);
        Ok(Made { bytes: bytes.len(), sha256, training: Training::read(sense, directory)?, detector })
    }
}

/// Measures the models of `directory` and writes `manifest.toml`, `detector.md`, `thermal.md` and, of a fused one, `fused.md` beside
/// them.
pub(crate) fn write(
    sensors: &Sensors,
    directory: &Path,
    frames: Option<u64>,
) -> Result<(), Box<dyn std::error::Error>> {
    let frames = frames.unwrap_or(FRAMES);
    let [colour, thermal] = [Made::read(Sense::Colour, directory)?, Made::read(Sense::Thermal, directory)?];
    let stages = Stages::new(sensors, colour.detector.clone(), Arc::clone(&thermal.detector));
    let rows = qualities(&stages, frames)?;
    let warm = parallel::map(parallel::cores(), &all_cells()?, |(split, cell)| -> Result<_, ExampleError> {
        let mut claims = Claims::default();
        for number in 0..frames {
            let (frame, which) = heated(sensors, cell, *split, number, &[])?;
            claims.add(&thermal.detector, &frame, |object| which.contains(&object));
        }
        Ok(claims)
    })?;
    let fused = Sense::Fused.model(directory).is_file().then(|| Made::read(Sense::Fused, directory)).transpose()?;
    let runtime = runtime::describe()?;
    std::fs::write(directory.join("manifest.toml"), manifest(&colour, &thermal, fused.as_ref(), &rows, runtime)?)?;
    let mut cards = vec![
        ("detector.md", card(sensors, &colour, &rows, &points(&stages)?, runtime)),
        ("thermal.md", thermal_card(&thermal, &rows, &warm)),
    ];
    if let Some(fused) = &fused {
        let stages = stages.proposing(Arc::clone(&fused.detector));
        let rows = qualities(&stages, frames)?;
        cards.push(("fused.md", fused_card(fused, &rows, &points(&stages)?, runtime)));
    }
    for (name, card) in cards {
        std::fs::write(directory.join(name), &card)?;
        println!("{card}");
    }
    Ok(())
}

/// Every cell, of the split with seeds held out and of the novel one.
fn all_cells() -> Result<Vec<(Split, &'static Cell)>, ExampleError> {
    let cells = cells::all()?;
    Ok([Split::HeldOut, Split::Novel]
        .into_iter()
        .flat_map(|split| cells.iter().map(move |cell| (split, cell)))
        .collect())
}

/// Measurements of each of [`all_cells`].
fn qualities(stages: &Stages, frames: u64) -> Result<Vec<Quality>, QualityError> {
    parallel::map(parallel::cores(), &all_cells()?, |(split, cell)| {
        let row = measure(stages, cell, *split, 0..frames, &CorroborationLimits::default())?;
        eprintln!("{} {}: {:.3}", row.split, row.cell, row.mean_average_precision);
        Ok(row)
    })
}

#[derive(serde::Serialize)]
struct Manifest<'a> {
    sha256: &'a str,
    thermal_sha256: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    fused_sha256: Option<&'a str>,
    runtime: &'a str,
    training: &'a Training,
    thermal_training: &'a Training,
    #[serde(skip_serializing_if = "Option::is_none")]
    fused_training: Option<&'a Training>,
    measured: Vec<Measured<'a>>,
}

#[derive(serde::Serialize)]
struct Measured<'a> {
    cell: &'a str,
    split: &'a str,
    frames: u32,
    mean_average_precision: f64,
    calibration_error: f64,
}

fn manifest(
    colour: &Made,
    thermal: &Made,
    fused: Option<&Made>,
    rows: &[Quality],
    runtime: &str,
) -> Result<String, toml::ser::Error> {
    let round = |v: f64| (v * 1000.0).round() / 1000.0;
    let measured = rows.iter().map(|row| Measured {
        cell: &row.cell,
        split: row.split,
        frames: row.frames,
        mean_average_precision: round(row.mean_average_precision),
        calibration_error: round(row.calibration_error),
    });
    let manifest = Manifest {
        sha256: &colour.sha256,
        thermal_sha256: &thermal.sha256,
        fused_sha256: fused.map(|fused| fused.sha256.as_str()),
        runtime,
        training: &colour.training,
        thermal_training: &thermal.training,
        fused_training: fused.map(|fused| &fused.training),
        measured: measured.collect(),
    };
    let head = "# Written by `trainer measure`; perception refuses a model if its hash is not the one below.\n";
    Ok(format!("{head}{}", toml::to_string(&manifest)?))
}

fn card(sensors: &Sensors, made: &Made, rows: &[Quality], points: &str, runtime: &str) -> String {
    let Made { bytes, sha256, .. } = made;
    let frames = rows.first().map_or(0, |row| row.frames);
    let (height, attacks) = if sensors == &Sensors::GROUND {
        (String::new(), "How it fares under attack is in `robustness.md` and `prints.md`.")
    } else {
        let from = sensors.camera.up_m;
        (
            format!(", the last of them and all that is measured from {from} m above the ground"),
            "No attack was made on it.",
        )
    };
    format!(
        "# Model card: the colour detector\n\n\
         A single-shot convolutional detector, 160 × 120 RGB to a grid of cells of objectness, four classes (vehicle, \
         person, decoy, obstacle) and a box. {bytes} bytes, SHA-256 `{sha256}`.\n\n\
         **Made by** `trainer train`, `refine`, `harden`, `calibrate` and `measure` from rendered frames of the cells marked as learnt in \
         `measurements/dataset/cells.toml`{height}; rounds and hashes of the data are in `training.toml`.\n\n\
         **Measured** through `{runtime}` on {frames} frames of each cell that were not learnt from: seeds held out, and *novel* shapes, paints \
         and grounds; cells marked * are conditions that were not learnt from. An object counts from 3 columns, 6 rows \
         and 20 pixels. mAP: mean average precision at an intersection over union of 0.5, 95 % bootstrap interval over \
         frames; ECE: expected calibration error of scores from the threshold in force ({} permille); thermal: \
         balanced accuracy of the thermal veto with true boxes. Corroborated: sightings of single frames without a \
         veto, right within 2 m of an object of their class; error: their root mean square.\n\n{}\n\
         **The threshold** beside others, on {TUNING} tuning frames of each learnt cell, none of them measured \
         above.\n\n{points}\n\
         **Not for** anything but this simulation. It knows one camera, one sun and the paints of these classes, \
         and no photograph. {attacks}\n",
        CorroborationLimits::default().score,
        table(rows),
    )
}

fn fused_card(made: &Made, rows: &[Quality], points: &str, runtime: &str) -> String {
    format!(
        "# Model card: the fused detector\n\n\
         A single-shot convolutional detector of the colour detector's form over seven planes of 160 × 120 (colour, three bands of warmth as the \
         thermal stage has them, nearness by depth) to the same grid. {} bytes, SHA-256 `{}`.\n\n\
         **Made by** `trainer train`, `refine` and `calibrate fused` from rendered frames of the cells marked as learnt in `measurements/dataset/cells.toml`, a third of \
         their decoys and obstacles heated evenly; from the second round on half of the decoys are painted like vehicles, and a third bears patterns of \
         heat, half of those with a shifted coat. Planes are made worse at random: noise, haze, faint warmth, depth that ends early, a \
         sense that is missing (`measurements/trainer/src/worse.rs`); rounds and hashes of the data are in `fused-training.toml`.\n\n\
         **Measured** by its own proposals, and corroborated with the colour detector's disputes (`perception::fused`), through `{runtime}`, as the colour \
         detector's card says.\n\n{}\n\
         **The threshold** beside others, on {TUNING} tuning frames of each learnt cell.\n\n{points}\n\
         **Not for** anything but this simulation. How it fares under attack is in `docs/researcher/perception.md`.\n",
        made.bytes,
        made.sha256,
        table(rows),
    )
}

fn thermal_card(made: &Made, rows: &[Quality], warm: &[Claims]) -> String {
    let mut table = String::from(
        "| split | cell | vehicles and persons borne out | fakes found out | balanced accuracy | heated fakes found out |\n\
         |---|---|---|---|---|---|\n",
    );
    let share = |k: u32, n: u32| {
        let [low, high] = wilson(k, n);
        format!("{:.3}/{n} ({low:.3}–{high:.3})", f64::from(k) / f64::from(n.max(1)))
    };
    for (row, warm) in rows.iter().zip(warm) {
        let (claims, mark) = (&row.claims, if row.learnt { "" } else { " *" });
        let balanced = row.thermal_balanced_accuracy.map_or("–".to_owned(), |a| format!("**{a:.3}**"));
        let [honest, cold, heated] = [
            share(claims.supported, claims.honest),
            share(claims.contradicted, claims.false_claims),
            share(warm.contradicted, warm.false_claims),
        ];
        // Writing to a String cannot fail.
        let _ = writeln!(table, "| {} | {}{mark} | {honest} | {cold} | {balanced} | {heated} |", row.split, row.cell);
    }
    format!(
        "# Model card: the thermal stage\n\n\
         A network of the colour detector's form and half its channels over three bands of the thermal image (warmth above the ground in \
         two spans, absolute temperature). It finds vehicles and persons by where they are warm; what is warm and neither it calls an \
         obstacle. {} bytes, SHA-256 `{}`.\n\n\
         **Made by** `trainer train thermal`, `calibrate thermal` and `measure` from rendered frames of the learnt cells, in which a third of decoys \
         and obstacles are heated evenly, to between 8 and 45 K above the ground, and in rounds with patterns (`trainer harden thermal`) \
         another third field by field; rounds and hashes of the data are in `thermal-training.toml`.\n\n\
         **Measured** with true boxes on frames that were not learnt from; cells marked * are conditions that were not learnt from. A vehicle or \
         person under its own name should be borne out, a decoy or obstacle that is called a vehicle found out. *Heated fakes* are decoys \
         and obstacles heated as in training, on frames of their own. A cell has share/n and Wilson's interval, 95 %.\n\n{table}\n\
         **Not for** a decoy that is warm where a vehicle is, which it takes for one (`decoy_warm`).\n",
        made.bytes, made.sha256,
    )
}

/// Corroborated recall and precision by threshold.
fn points(stages: &Stages) -> Result<String, Box<dyn std::error::Error>> {
    let mut table = String::from("| threshold | corroborated recall | precision |\n|---|---|---|\n");
    for score in THRESHOLDS {
        let limits = CorroborationLimits { score, ..CorroborationLimits::default() };
        let learnt: Vec<_> = cells::all()?.iter().filter(|cell| cell.learnt).collect();
        let sightings = parallel::map(parallel::cores(), &learnt, |cell| {
            measure(stages, cell, Split::Tuning, 1_000..1_000 + TUNING, &limits).map(|quality| quality.sightings)
        })?;
        let all = sightings.iter().fold(Sightings::default(), |all, sightings| all.merged(sightings));
        writeln!(table, "| {score} | {:.3} | {:.3} |", all.recall(), all.precision())?;
    }
    Ok(table)
}

fn table(rows: &[Quality]) -> String {
    let mut table = format!(
        "| split | cell | objects | mAP | {} | ECE | thermal | corroborated recall | precision | error, m |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
        Class::ALL.map(Class::name).join(" | ")
    );
    for row in rows {
        let classes = row.average_precision.map(|p| p.map_or("–".to_owned(), |p| format!("{p:.2}")));
        // Writing to a String cannot fail.
        let _ = writeln!(
            table,
            "| {} | {}{} | {} | **{:.3}** ({:.3}–{:.3}) | {} | {:.3} | {} | {:.3} | {:.3} | {:.2} |",
            row.split,
            row.cell,
            if row.learnt { "" } else { " *" },
            row.objects,
            row.mean_average_precision,
            row.interval[0],
            row.interval[1],
            classes.join(" | "),
            row.calibration_error,
            row.thermal_balanced_accuracy.map_or("–".to_owned(), |a| format!("{a:.3}")),
            row.sightings.recall(),
            row.sightings.precision(),
            row.sightings.error_m(),
        );
    }
    table
}
