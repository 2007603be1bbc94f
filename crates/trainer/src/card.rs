//! The model card and the manifest that stand beside the model: what it was made from and what it was measured at.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

use perception::corroborate::Limits;
use perception::model::{Model, hex_digest};
use perception::{detector::Detector, runtime};
use wire::sensor::Class;

use crate::measure::{Measured, Tally, measure, overall};

/// Scenes that the detector never saw.
const HELD_OUT: std::ops::Range<u64> = 1_000_001..1_000_401;

/// Score thresholds that the card compares, permille.
const THRESHOLDS: [u16; 5] = [250, 350, 450, 550, 650];

/// How a model was made, as `train` left it beside the model.
#[derive(Debug, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Training {
    /// Seed of weights and batches.
    pub(crate) seed: u64,
    /// Batches.
    pub(crate) steps: u64,
    /// Frames rendered; seeds from 1.
    pub(crate) frames: u64,
    /// Objects on them.
    pub(crate) objects: u64,
    /// SHA-256 over images and labels.
    pub(crate) data_sha256: String,
}

/// Measures `directory/detector.onnx` and writes `manifest.toml` and `detector.md` beside it.
pub(crate) fn write(directory: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let training: Training = toml::from_str(&std::fs::read_to_string(directory.join("training.toml"))?)?;
    let bytes = std::fs::read(directory.join("detector.onnx"))?;
    let sha256 = hex_digest(&bytes);
    let detector = Arc::new(Detector::new(Model::pinned(&bytes, &sha256)?)?);
    let measured = measure(&detector, HELD_OUT, Limits::default().score)?;
    let mut points = String::from(
        "| threshold | recall | precision | corroborated recall | corroborated precision |\n|---|---|---|---|---|\n",
    );
    for least in THRESHOLDS {
        let at = measure(&detector, HELD_OUT, least)?;
        let (all, placed) = (overall(&at.detector), overall(&at.sightings));
        let shares = [all.recall(), all.precision(), placed.recall(), placed.precision()];
        let shares = shares.map(|share| format!("{share:.3}")).join(" | ");
        writeln!(points, "| {least} | {shares} |")?;
    }
    let runtime = runtime::describe()?;
    std::fs::write(directory.join("manifest.toml"), manifest(&sha256, &training, &measured, runtime))?;
    let card = card(&sha256, bytes.len(), &training, &measured, &points, runtime);
    std::fs::write(directory.join("detector.md"), &card)?;
    println!("{card}");
    Ok(())
}

fn manifest(sha256: &str, training: &Training, measured: &Measured, runtime: &str) -> String {
    let (all, placed) = (overall(&measured.detector), overall(&measured.sightings));
    format!(
        "# Written by `trainer measure`; perception refuses detector.onnx if its hash is not the one below.\n\
         sha256 = \"{sha256}\"\nseed = {}\nsteps = {}\nframes = {}\nobjects = {}\ndata_sha256 = \"{}\"\n\
         held_out_seeds = [{}, {}]\nheld_out_objects = {}\nrecall = {:.3}\nprecision = {:.3}\n\
         corroborated_recall = {:.3}\ncorroborated_precision = {:.3}\nruntime = \"{}\"\n",
        training.seed,
        training.steps,
        training.frames,
        training.objects,
        training.data_sha256,
        HELD_OUT.start,
        HELD_OUT.end - 1,
        all.objects,
        all.recall(),
        all.precision(),
        placed.recall(),
        placed.precision(),
        runtime.replace('"', "'"),
    )
}

fn card(sha256: &str, bytes: usize, training: &Training, measured: &Measured, points: &str, runtime: &str) -> String {
    format!(
        "# Model card: the colour detector\n\n\
         A single-shot convolutional detector, 160 × 120 RGB to a grid of 20 × 15 cells of objectness, four classes \
         (vehicle, person, decoy, obstacle) and a box. {bytes} bytes, SHA-256 `{sha256}`.\n\n\
         **Made by** `trainer train` and `trainer measure`: {} rendered scenes (seeds 1 to {}, {} objects, data SHA-256 \
         `{}`), {} steps of 24 frames, seed {}. The scenes are random: 1 to 6 objects at 4 to 25 m, free paints, \
         headings, sizes and relief, occlusion included.\n\n\
         **Measured** on {} held-out scenes (seeds {} to {}) through `{runtime}`, at the score threshold in force ({} permille). An \
         object counts if it shows at least 12 pixels, 2 columns and 4 rows; a detection is right at an intersection \
         over union of 0.5 with an object of its class.\n\n{}\n\
         **After corroboration** with depth, LiDAR and thermal, one frame, no tracking: a sighting that nothing \
         vetoes is right within 2 m of a true object of its class.\n\n{}\n\
         **Operating points**, all classes, by score threshold in permille.\n\n{}\n\
         **Not for** anything but this simulation. It knows one camera, one sun and the paints of these classes; \
         nothing here says how it would do on a photograph. Adversarial robustness has not been measured.\n",
        training.frames,
        training.frames,
        training.objects,
        training.data_sha256,
        training.steps,
        training.seed,
        measured.frames,
        HELD_OUT.start,
        HELD_OUT.end - 1,
        Limits::default().score,
        table(&measured.detector),
        table(&measured.sightings),
        points,
    )
}

fn table(tallies: &[Tally; 4]) -> String {
    let mut table = String::from("| class | objects | recall | given | precision |\n|---|---|---|---|---|\n");
    let names = Class::ALL.iter().map(|c| format!("{c:?}").to_lowercase());
    for (name, tally) in names.zip(tallies).chain([("all".to_owned(), &overall(tallies))]) {
        let (recall, precision) = (tally.recall(), tally.precision());
        // Writing to a String cannot fail.
        let _ = writeln!(table, "| {name} | {} | {recall:.3} | {} | {precision:.3} |", tally.objects, tally.given);
    }
    table
}
