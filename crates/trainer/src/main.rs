//! Trains the detector of `perception` on the project's own rendered frames.
//!
//! `trainer train DIR [STEPS] [FRAMES]` renders, trains and writes `DIR/detector.onnx`; `trainer measure DIR` runs that
//! file through the pure-Rust runtime on held-out seeds and writes its card and manifest. Not part of the normal build: nothing depends on this package.

mod card;
mod data;
mod measure;
mod net;
mod scenes;
mod train;

use std::path::PathBuf;
use std::process::ExitCode;

/// Seed of the weights and of the batches.
const SEED: u64 = 20_260;
/// Scenes learnt from.
const TRAINING: std::ops::Range<u64> = 1..2_801;

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
    match words.as_slice() {
        ["train", directory, rest @ ..] => {
            let number = |at: usize, default: u64| rest.get(at).map_or(Ok(default), |word| word.parse());
            let (steps, frames) = (number(0, 1_500)?, number(1, TRAINING.end - TRAINING.start)?);
            let (examples, data_sha256) = data::examples(TRAINING.start..TRAINING.start + frames)?;
            let objects = examples.iter().map(|e| e.labels.len() as u64).sum();
            let training = card::Training { seed: SEED, steps, frames, objects, data_sha256 };
            let directory = PathBuf::from(directory);
            std::fs::write(directory.join("training.toml"), toml::to_string(&training)?)?;
            train::train(&examples, steps as usize, SEED, &directory.join("detector.onnx"))
        }
        ["measure", directory] => card::write(&PathBuf::from(directory)),
        _ => Err("usage: trainer train DIR [STEPS] [FRAMES] | trainer measure DIR".into()),
    }
}
