//! Trains the networks of `perception` on the project's own rendered frames, and attacks them.
//!
//! `trainer train colour|thermal|fused DIR [STEPS] [FRAMES]` renders, trains and writes a model, `trainer refine` goes on from there
//! with other frames at a lower rate, `trainer harden` does so with half of them made harder on purpose (for warmth: with fakes
//! that bear heat made against it), `trainer calibrate` calibrates scores. `trainer measure DIR [FRAMES]` runs both files through
//! the pure-Rust runtime on frames that were not learnt from and writes their card and manifest; `trainer pixels DIR [FRAMES]`
//! changes the image before the colour network with its own gradients, `trainer prints DIR OTHER [VIEWS]` prints on decoys,
//! `trainer perturbations DIR OTHER [VIEWS]` adds one pattern to every image, `trainer joint` prints on them and heats them
//! against all stages at once. `trainer aloft`, before one of the first five, looks from where the air platform's camera is. Built with
//! `--features burn/wgpu` it learns on a GPU, whose weights differ from a CPU's in their last digits. Not part of the normal build: no crate depends on this package.

mod calibrate;
mod card;
mod data;
mod descent;
mod harden;
mod heats;
mod interval;
mod joint;
mod means;
mod net;
mod pixels;
mod sense;
mod shifts;
mod train;
mod victim;
mod views;
mod worse;

use std::path::Path;
use std::process::ExitCode;

use config::platform::Sensors;
use perception::model::hex_digest;

use crate::card::{Round, Training};
use crate::means::Means;
use crate::sense::Sense;
use crate::train::Kind;
use crate::victim::Victim;

const USAGE: &str = "usage: trainer [aloft] train|refine colour|thermal|fused DIR [STEPS] [FRAMES] | trainer harden colour|thermal|fused DIR [STEPS] [FRAMES] \
                     [STRENGTH] | trainer calibrate colour|thermal|fused DIR | trainer measure DIR [FRAMES] | trainer pixels DIR [FRAMES] | trainer prints|perturbations DIR OTHER [VIEWS] | \
                     trainer joint COLOUR_DIR THERMAL_DIR OTHER_COLOUR_DIR OTHER_THERMAL_DIR PAGE [VIEWS]";
/// Seed of the weights and of the batches of the first round; each that follows has the next.
const SEED: u64 = 20_261;
/// Batches, and frames learnt from, unless others are asked for.
const STEPS: u64 = 2_000;
const FRAMES: u64 = 5_400;
/// Largest change by which frames are made harder, of 255.
const STRENGTH: u8 = 102;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("trainer: {why}");
            ExitCode::from(2)
        }
    }
}

fn run(arguments: &[String]) -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let (sensors, words) = match words.split_first() {
        Some((&"aloft", rest)) if matches!(rest, ["train" | "refine" | "harden" | "calibrate" | "measure", ..]) => {
            (&Sensors::ALOFT, rest)
        }
        _ => (&Sensors::GROUND, words.as_slice()),
    };
    let number = |word: Option<&&str>| word.map(|word| word.parse::<u64>()).transpose();
    match words {
        [verb @ ("train" | "refine" | "harden"), what, directory, rest @ ..]
            if rest.len() <= 2 + usize::from(*verb == "harden") =>
        {
            let most = number(rest.get(2))?.map_or(Ok(STRENGTH), u8::try_from)?;
            let kind = match *verb {
                "train" => Kind::New,
                "refine" => Kind::Again,
                _ => Kind::Hardened(most),
            };
            let (steps, frames) = (number(rest.first())?.unwrap_or(STEPS), number(rest.get(1))?.unwrap_or(FRAMES));
            train(sense(what)?, sensors, Path::new(directory), kind, steps, frames)
        }
        ["calibrate", what, directory] => calibrate::write(sense(what)?, sensors, Path::new(directory)),
        ["measure", directory, rest @ ..] if rest.len() <= 1 => {
            card::write(sensors, Path::new(directory), number(rest.first())?)
        }
        ["pixels", directory, rest @ ..] if rest.len() <= 1 => {
            pixels::write(Path::new(directory), number(rest.first())?)
        }
        [what @ ("prints" | "perturbations"), directory, other, rest @ ..] if rest.len() <= 1 => {
            let means = if *what == "prints" { Means::Print } else { Means::Perturbation };
            shifts::write(means, Path::new(directory), Path::new(other), number(rest.first())?)
        }
        ["joint", colour, thermal, other_colour, other_thermal, page, rest @ ..] if rest.len() <= 1 => {
            let paths = [colour, thermal, other_colour, other_thermal].map(|directory| Path::new(*directory));
            joint::write(paths, Path::new(page), number(rest.first())?)
        }
        _ => Err(USAGE.into()),
    }
}

fn sense(name: &str) -> Result<Sense, String> {
    Sense::named(name).ok_or_else(|| format!("{name}: colour, thermal or fused"))
}

/// One round: from new weights, or from the weights of the round before with frames that follow its own.
fn train(
    sense: Sense,
    sensors: &Sensors,
    directory: &Path,
    kind: Kind,
    steps: u64,
    frames: u64,
) -> Result<(), Box<dyn std::error::Error>> {
    let mut training = if kind == Kind::New { Training::default() } else { Training::read(sense, directory)? };
    let first = training.round.iter().map(|round| round.frames).sum();
    // Heat is made harder before frames are rendered, colours while they are learnt.
    let hardens_heat = sense == Sense::Thermal && matches!(kind, Kind::Hardened(_));
    let pool = match sense {
        _ if hardens_heat => heats::pool(&Victim::read(sense, directory)?.net)?,
        Sense::Fused => heats::drawn(),
        Sense::Colour | Sense::Thermal => Vec::new(),
    };
    let kind = if hardens_heat { Kind::Again } else { kind };
    let (examples, data_sha256) = data::examples(sense, sensors, first..first + frames, &pool)?;
    eprintln!("{frames} frames rendered");
    let seed = SEED + training.round.len() as u64;
    let cpu = train::train(sense, &examples, steps as usize, seed, kind, &sense.model(directory))?;
    training.round.push(Round {
        seed,
        steps,
        batch: train::BATCH as u64,
        hardened: if let Kind::Hardened(most) = kind { most } else { 0 },
        patterns: pool.len() as u64,
        frames,
        objects: examples.iter().map(|e| e.labels.len() as u64).sum(),
        data_sha256,
        cells_sha256: hex_digest(dataset::cells::text().as_bytes()),
        cpu_minutes: cpu.as_secs() / 60,
    });
    training.write(sense, directory)
}
