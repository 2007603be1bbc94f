//! Finished trials on disk, so that a command that is ended in any way, `kill -9` too, goes on where it was.
//!
//! One file for each variation, mode and build, one line a trial, written when the trial is judged. A file's name holds
//! the digest of everything that the outcome depends on beside the seed (this program, scenario and scene, policy,
//! bounds, platform), so that nothing is taken for what it is not. A last line that is cut short counts for nothing.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::failure::{Exit, Failure};
use super::plan::Planned;
use crate::evidence::hex;
use crate::report::Mode;
use crate::trial::Trial;

/// The folder of finished trials.
pub(super) struct Kept {
    folder: PathBuf,
    build: String,
}

/// The finished trials of one variation in one mode.
pub(super) struct Shelf {
    done: BTreeMap<u64, Trial>,
    file: Mutex<File>,
}

/// A trial as it is kept: with what its own form leaves out of reports.
#[derive(Serialize, Deserialize)]
struct Line {
    trial: Trial,
    false_trips: u32,
    nominal_seconds: f64,
    cpu_seconds: f64,
}

impl Kept {
    /// Below `directory`, for this very program.
    pub(super) fn below(directory: &Path) -> Result<Self, Failure> {
        let folder = directory.join("kept");
        fs::create_dir_all(&folder)?;
        let program = std::env::current_exe()?;
        let mut digest = Sha256::new();
        std::io::copy(&mut File::open(program)?, &mut digest)?;
        Ok(Self { folder, build: hex(&digest.finalize()) })
    }

    /// SHA-256 of this program, hexadecimal.
    pub(super) fn build(&self) -> &str {
        &self.build
    }

    /// What is finished of `planned`, and where more of it goes.
    pub(super) fn shelf(&self, mode: Mode, planned: &Planned) -> Result<Shelf, Failure> {
        let cell = planned.variation.cell.as_deref().map(|c| format!(".{}", c.replace(['/', ' '], "-")));
        let scenario = planned.variation.scenario.name.as_str();
        let (cell, digest) = (cell.unwrap_or_default(), &self.digest(mode, planned)?[..16]);
        Shelf::open(&self.folder.join(format!("{scenario}{cell}.{}.{digest}.jsonl", mode.name())))
    }

    fn digest(&self, mode: Mode, planned: &Planned) -> Result<String, Failure> {
        let unwritable = |e: serde_json::Error| Failure::new(Exit::Internal, e.to_string());
        let (scenario, setup) = (&planned.variation.scenario, &planned.setup);
        let mut digest = Sha256::new();
        let mut part = |text: &str| {
            digest.update((text.len() as u64).to_le_bytes());
            digest.update(text);
        };
        part(&self.build);
        part(mode.name());
        part(&serde_json::to_string(scenario).map_err(unwritable)?);
        part(&serde_json::to_string(&setup.policy).map_err(unwritable)?);
        part(&format!("{:?} {:?} {}", setup.bounds, setup.platform, setup.rendered));
        Ok(hex(&digest.finalize()))
    }
}

impl Shelf {
    fn open(path: &Path) -> Result<Self, Failure> {
        let mut file = OpenOptions::new().create(true).read(true).append(true).open(path)?;
        let mut text = String::new();
        file.read_to_string(&mut text)?;
        let whole = text.rfind('\n').map_or(0, |at| at + 1);
        if whole < text.len() {
            file.set_len(whole as u64)?;
        }
        let unreadable = |(line, e)| {
            let at = format!("{}:{line}: {e}", path.display());
            Failure::new(Exit::Usage, format!("{at}; remove the file, its trials run again"))
        };
        Ok(Self { done: finished(&text[..whole]).map_err(unreadable)?, file: Mutex::new(file) })
    }

    /// The finished trial of this seed.
    pub(super) fn get(&self, seed: u64) -> Option<&Trial> {
        self.done.get(&seed)
    }

    /// How many of the seeds from `first` are not finished.
    pub(super) fn missing(&self, first: u64, n: u64) -> usize {
        (0..n).filter(|i| !self.done.contains_key(&first.wrapping_add(*i))).count()
    }

    /// Keeps a trial that has just been judged.
    pub(super) fn put(&self, trial: &Trial) -> Result<(), Failure> {
        let line = kept_line(trial).map_err(|e| Failure::new(Exit::Internal, e.to_string()))?;
        let mut file = self.file.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        Ok(file.write_all(format!("{line}\n").as_bytes())?)
    }
}

/// The trials of a file's whole lines, by seed.
///
/// # Errors
/// The number, from 1, of the first line that is none, and why.
pub fn finished(lines: &str) -> Result<BTreeMap<u64, Trial>, (usize, serde_json::Error)> {
    let read = |(i, line)| match serde_json::from_str::<Line>(line) {
        Ok(line) => Ok((line.trial.seed, line.into_trial())),
        Err(error) => Err((i + 1, error)),
    };
    lines.lines().enumerate().map(read).collect()
}

/// The line of a trial, as it is kept.
///
/// # Errors
/// When a number in it cannot be written as JSON.
pub fn kept_line(trial: &Trial) -> serde_json::Result<String> {
    serde_json::to_string(&Line::of(trial))
}

impl Line {
    fn of(trial: &Trial) -> Self {
        let (false_trips, nominal_seconds) = (trial.false_trips, trial.nominal_seconds);
        Self { trial: trial.clone(), false_trips, nominal_seconds, cpu_seconds: trial.cpu_seconds }
    }

    fn into_trial(self) -> Trial {
        let Self { trial, false_trips, nominal_seconds, cpu_seconds } = self;
        Trial { false_trips, nominal_seconds, cpu_seconds, ..trial }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::tests::trial;
    use crate::trial::Outcome;

    #[test]
    fn what_was_put_is_there_again_and_a_line_cut_short_is_not() {
        let directory = tempfile::tempdir().expect("a folder");
        let path = directory.path().join("a.jsonl");
        let shelf = Shelf::open(&path).expect("a new file");
        let mut first = trial(1, Outcome::HoldSafe);
        (first.false_trips, first.cpu_seconds) = (2, 0.25);
        shelf.put(&first).expect("written");
        shelf.put(&trial(2, Outcome::Rejected)).expect("written");
        drop(shelf);
        let text = fs::read_to_string(&path).expect("text");
        fs::write(&path, &text[..text.len() - 9]).expect("cut short");

        let shelf = Shelf::open(&path).expect("the same file");
        assert_eq!((shelf.get(1), shelf.get(2)), (Some(&first), None));
        shelf.put(&trial(2, Outcome::Rejected)).expect("written");
        drop(shelf);
        let shelf = Shelf::open(&path).expect("the same file");
        assert_eq!(shelf.get(2).map(|t| t.outcome), Some(Outcome::Rejected));
    }
}
