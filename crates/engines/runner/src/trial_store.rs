//! Finished trials on disk, so that a command resumes after any interruption, `kill -9` too.
//!
//! A file for each variation, mode and build has a line for each trial, written when the trial is judged. A file's name has the digest of
//! everything but the seed on which the outcome depends (this program, scenario and scene, policy, bounds, platform), so that no trial is
//! mistaken for another. A live trial that the host spoilt has a line and is not finished: it runs again, and the trial that replaces it
//! counts it.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};

use evidence::log::hex;
use evidence::trial::Trial;
use results::mode::Mode;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::failure::{Exit, Failure};
use super::lines::{Lines, scan};
use super::plan::Planned;

/// The folder of finished trials.
pub struct TrialStore {
    folder: PathBuf,
    /// Stores of the same command's partitions.
    parts: Vec<PathBuf>,
    build: String,
}

/// The finished trials of one variation in one mode.
pub struct Shelf {
    done: BTreeMap<u64, Trial>,
    /// Stalls of the host that spoilt earlier attempts, by seed.
    spoilt: BTreeMap<u64, Vec<f64>>,
    lines: Lines,
}

/// A trial as it is kept: with the fields that its form in reports leaves out.
#[derive(Serialize, Deserialize)]
struct Line {
    trial: Trial,
    false_trips: u32,
    nominal_seconds: f64,
    cpu_seconds: f64,
}

impl TrialStore {
    /// Opens the store in `directory`, for this very program.
    pub fn open(directory: &Path) -> Result<Self, Failure> {
        let folder = directory.join("kept");
        fs::create_dir_all(&folder)?;
        let program = std::env::current_exe()?;
        let mut digest = Sha256::new();
        std::io::copy(&mut File::open(program)?, &mut digest)?;
        Ok(Self { folder, parts: Vec::new(), build: hex(&digest.finalize()) })
    }

    /// Adds the stores of partitions in `directories`, whose finished trials are copied.
    ///
    /// # Errors
    /// When a directory has no finished trials.
    pub fn with_parts(mut self, directories: &[PathBuf]) -> Result<Self, Failure> {
        for directory in directories {
            let part = directory.join("kept");
            if !part.is_dir() {
                let message =
                    format!("{}: no finished trials; --partition i/N --out DIR keeps some", directory.display());
                return Err(Failure::new(Exit::Usage, message));
            }
            self.parts.push(part);
        }
        Ok(self)
    }

    /// SHA-256 of this program, hexadecimal.
    pub fn build(&self) -> &str {
        &self.build
    }

    /// Finished trials of `planned`, and the file for more.
    pub fn shelf(&self, mode: Mode, planned: &Planned) -> Result<Shelf, Failure> {
        let cell = planned.variation.cell.as_deref().map(|c| format!(".{}", c.replace(['/', ' '], "-")));
        let scenario = planned.variation.scenario.name.as_str();
        let (cell, digest) = (cell.unwrap_or_default(), &self.digest(mode, planned)?[..16]);
        let name = format!("{scenario}{cell}.{}.{digest}.jsonl", mode.name());
        let mut shelf = Shelf::open(&self.folder.join(&name))?;
        for part in self.parts.iter().map(|part| part.join(&name)).filter(|part| part.is_file()) {
            shelf.add(&part, mode)?;
        }
        Ok(shelf)
    }

    fn digest(&self, mode: Mode, planned: &Planned) -> Result<String, Failure> {
        let content = planned.content()?;
        let mut digest = Sha256::new();
        for part in [self.build.as_str(), mode.name(), &content.scenario, &content.policy, &content.platform] {
            digest.update((part.len() as u64).to_le_bytes());
            digest.update(part);
        }
        Ok(hex(&digest.finalize()))
    }
}

impl Shelf {
    fn open(path: &Path) -> Result<Self, Failure> {
        let (mut done, mut spoilt) = (BTreeMap::new(), BTreeMap::new());
        let lines = Lines::open(path, |_, line: Line| {
            take_line(line, &mut done, &mut spoilt);
            Ok(())
        })?;
        Ok(Self { done, spoilt, lines })
    }

    /// Adds the trials of another file. In the twin a trial has one result, on any machine.
    fn add(&mut self, path: &Path, mode: Mode) -> Result<(), Failure> {
        let mut added = Vec::new();
        scan(path, File::open(path)?, |_, line: Line| {
            added.push(line.into_trial());
            Ok(())
        })?;
        for trial in added.into_iter().filter(|trial| trial.host_stall_ms.is_none()) {
            let timeless = |trial: &Trial| Trial { cpu_seconds: 0.0, ..trial.clone() };
            match self.done.get(&trial.seed) {
                Some(known) if mode != Mode::Live && timeless(known) != timeless(&trial) => {
                    let message =
                        format!("{}: the trial of seed {} came out differently elsewhere", path.display(), trial.seed);
                    return Err(Failure::new(Exit::Unexpected, message));
                }
                Some(_) => {}
                None => {
                    self.put(&trial)?;
                    self.done.insert(trial.seed, trial);
                }
            }
        }
        Ok(())
    }

    /// The finished trial of this seed.
    pub fn get(&self, seed: u64) -> Option<&Trial> {
        self.done.get(&seed)
    }

    /// Stalls of the host that spoilt earlier attempts at the trial of this seed, in milliseconds.
    pub(crate) fn spoilt_ms(&self, seed: u64) -> &[f64] {
        self.spoilt.get(&seed).map_or(&[], Vec::as_slice)
    }

    /// Number of the seeds from `first` without a finished trial.
    pub fn missing(&self, first: u64, n: u64) -> usize {
        (0..n).filter(|i| !self.done.contains_key(&first.wrapping_add(*i))).count()
    }

    /// Keeps a trial that has just been judged.
    pub fn put(&self, trial: &Trial) -> Result<(), Failure> {
        self.lines.put(&Line::from_trial(trial)).map(|_| ())
    }
}

/// The trials of a file's whole lines, by seed.
///
/// # Errors
/// The first line that is not as it was written.
pub fn finished(text: &[u8]) -> Result<BTreeMap<u64, Trial>, Failure> {
    let (mut done, mut spoilt) = (BTreeMap::new(), BTreeMap::new());
    scan(Path::new("kept"), text, |_, line: Line| {
        take_line(line, &mut done, &mut spoilt);
        Ok(())
    })?;
    Ok(done)
}

/// Takes a line: a finished trial, or the stalls that spoilt one.
fn take_line(line: Line, done: &mut BTreeMap<u64, Trial>, spoilt: &mut BTreeMap<u64, Vec<f64>>) {
    let trial = line.into_trial();
    match trial.host_stall_ms {
        // The line of a later attempt has the earlier ones, too.
        Some(ms) => drop(spoilt.insert(trial.seed, [trial.host_spoilt_ms.as_slice(), &[ms]].concat())),
        None => drop(done.insert(trial.seed, trial)),
    }
}

/// The line of a trial, as it is kept.
///
/// # Errors
/// When a number in it cannot be written as JSON.
pub fn kept_line(trial: &Trial) -> serde_json::Result<String> {
    serde_json::to_string(&Line::from_trial(trial))
}

impl Line {
    fn from_trial(trial: &Trial) -> Self {
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
    use evidence::trial::Outcome;

    #[test]
    fn kept_trials_return_and_truncated_lines_do_not() {
        let directory = tempfile::tempdir().expect("a folder");
        let path = directory.path().join("a.jsonl");
        let shelf = Shelf::open(&path).expect("a new file");
        let mut first = Trial::example(1, Outcome::HoldSafe);
        (first.false_trips, first.cpu_seconds) = (2, 0.25);
        shelf.put(&first).expect("written");
        shelf.put(&Trial::example(2, Outcome::Rejected)).expect("written");
        drop(shelf);
        let text = fs::read_to_string(&path).expect("text");
        fs::write(&path, &text[..text.len() - 9]).expect("cut short");

        let shelf = Shelf::open(&path).expect("the same file");
        assert_eq!((shelf.get(1), shelf.get(2)), (Some(&first), None));
        shelf.put(&Trial::example(2, Outcome::Rejected)).expect("written");
        drop(shelf);
        let shelf = Shelf::open(&path).expect("the same file");
        assert_eq!(shelf.get(2).map(|t| t.outcome), Some(Outcome::Rejected));
    }

    #[test]
    fn spoilt_trial_is_missing_and_counted() {
        let directory = tempfile::tempdir().expect("a folder");
        let path = directory.path().join("a.jsonl");
        let mut spoilt = Trial::example(1, Outcome::Invalid);
        (spoilt.host_stall_ms, spoilt.host_spoilt_ms) = (Some(312.0), vec![140.0]);
        Shelf::open(&path).expect("a new file").put(&spoilt).expect("written");
        let shelf = Shelf::open(&path).expect("the same file");
        assert_eq!((shelf.get(1), shelf.missing(1, 1), shelf.spoilt_ms(1)), (None, 1, [140.0, 312.0].as_slice()));
        shelf.put(&Trial::example(1, Outcome::HoldSafe)).expect("written");
        let shelf = Shelf::open(&path).expect("the same file");
        assert_eq!((shelf.missing(1, 1), shelf.spoilt_ms(2)), (0, [].as_slice()));
    }
}
