//! Numbered results of one piece of work on disk, so that it resumes, and partitions of it are put together: `terms.json` identifies the
//! work, `results.jsonl` has a line for each result, written when the result is known.
//!
//! A result depends on the terms and its number alone, so folders of the same work can be put together in any order. Only an index is in
//! memory. The trials of a campaign, which are judged one by one, are left to `campaign`.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::Path;
use std::rc::Rc;

use link::files;
use parallel::progress::Stop;
use search::Counted;
use search::rare::{Repetition, StageResult};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::failure::{Exit, Failure};
use super::lines::{LineFault, LinePlace, Lines, each, lock};
use super::out;

/// The longest terms that are read.
const MAX_TERMS_BYTES: u64 = 1 << 20;
const TERMS: &str = "terms.json";
const RESULTS: &str = "results.jsonl";

/// Check of a result that is read: the fault of one that cannot be from this work.
pub type Check<T> = Rc<dyn Fn(&T) -> Result<(), LineFault>>;

/// A result that is equal on every machine except for its computing time.
pub trait Timeless: Serialize + DeserializeOwned + PartialEq {
    /// The result without its computing time.
    #[must_use]
    fn timeless(self) -> Self;
}

impl Timeless for Repetition {
    fn timeless(self) -> Self {
        Self { stages: self.stages.into_iter().map(|stage| StageResult { cpu_us: 0, ..stage }).collect() }
    }
}

impl Timeless for Counted {
    fn timeless(self) -> Self {
        Self { cpu_seconds: 0.0, ..self }
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Line<T> {
    number: u64,
    result: T,
}

/// The finished results in one folder, locked for this process.
pub struct Numbered<T> {
    terms: Value,
    /// Number of results; numbers are below it.
    count: u64,
    lines: Lines,
    index: BTreeMap<u64, LinePlace>,
    /// The kernel releases it however the process ends.
    _lock: File,
    check: Check<T>,
}

impl<T: Timeless> Numbered<T> {
    /// The results in `directory`, which may be new. `terms` has everything on which the `count` results depend; each result that is read
    /// passes `check`.
    ///
    /// # Errors
    /// When the folder has other work, or the user asks to stop while another process is at work there.
    pub fn open(
        directory: &Path,
        terms: &impl Serialize,
        count: u64,
        check: Check<T>,
        stop: &Stop,
    ) -> Result<Self, Failure> {
        let terms = serde_json::to_value(terms).map_err(Failure::internal)?;
        fs::create_dir_all(directory)?;
        let lock = lock(directory, stop)?;
        if directory.join(TERMS).exists() {
            check_terms(directory, &terms)?;
        } else {
            out::write_json(directory, "terms.json.new", &terms)?;
            fs::rename(directory.join("terms.json.new"), directory.join(TERMS))?;
        }
        let mut index = BTreeMap::new();
        let lines = Lines::open(&directory.join(RESULTS), |place, line: Line<T>| {
            check(&line.result)?;
            index.insert(check_number(line.number, count)?, place);
            Ok(())
        })?;
        Ok(Self { terms, count, lines, index, _lock: lock, check })
    }

    /// Copies the results of another folder, which stays as it is.
    ///
    /// # Errors
    /// When that folder has other work, or another result under the same number.
    pub fn add(&mut self, directory: &Path) -> Result<(), Failure> {
        check_terms(directory, &self.terms)?;
        let path = directory.join(RESULTS);
        let (count, check) = (self.count, Rc::clone(&self.check));
        let fits = |line: &Line<T>| check_number(line.number, count).and_then(|_| check(&line.result));
        each(&path, fits, |line| self.merge(&path, line.number, line.result))
    }

    /// True if the result of this number is finished.
    pub fn is_finished(&self, number: u64) -> bool {
        self.index.contains_key(&number)
    }

    /// The result of this number, if it is finished.
    ///
    /// # Errors
    /// When the file was changed since it was opened.
    pub fn get(&self, number: u64) -> Result<Option<T>, Failure> {
        let line = self.index.get(&number).map(|place| self.lines.get::<Line<T>>(*place)).transpose()?;
        Ok(line.map(|line| line.result))
    }

    /// Adds a result.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn put(&mut self, number: u64, result: T) -> Result<(), Failure> {
        let place = self.lines.put(&Line { number, result })?;
        self.index.insert(number, place);
        Ok(())
    }

    fn merge(&mut self, path: &Path, number: u64, result: T) -> Result<(), Failure> {
        let Some(known) = self.get(number)? else { return self.put(number, result) };
        if known.timeless() == result.timeless() {
            return Ok(());
        }
        let message = format!("{}: result {number} came out differently elsewhere", path.display());
        Err(Failure::new(Exit::Unexpected, message))
    }
}

fn check_number(number: u64, count: u64) -> Result<u64, LineFault> {
    if number < count { Ok(number) } else { Err(LineFault::Number { number, count }) }
}

/// Checks that a folder has the work of these terms and no other.
fn check_terms(directory: &Path, terms: &Value) -> Result<(), Failure> {
    let path = directory.join(TERMS);
    let unusable = |reason: String| {
        let remedy = "name the folder that the same command made with --out DIR";
        Failure::new(Exit::Usage, format!("{}: {reason}; {remedy}", path.display()))
    };
    let text = files::read(&path, MAX_TERMS_BYTES).map_err(|e| unusable(e.to_string()))?;
    let stored: Value = serde_json::from_slice(&text).map_err(|e| unusable(e.to_string()))?;
    if stored == *terms {
        return Ok(());
    }
    let mut keys = terms.as_object().into_iter().flatten();
    let differs = keys.find(|(key, value)| stored.get(key.as_str()) != Some(value));
    let Some((key, value)) = differs else { return Err(unusable("not the terms of this command".to_owned())) };
    let got = stored.get(key.as_str()).map_or_else(|| "nothing".to_owned(), Value::to_string);
    let message = format!("{} is of other work: {key}: expected {value}, got {got}", directory.display());
    Err(Failure::new(Exit::Usage, format!("{message}; keep each in a folder of its own")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lines::reseal;

    fn repetition(reached: u64, cpu_us: u64) -> Repetition {
        Repetition { stages: vec![StageResult { tried: 8, reached, spent: 1, cpu_us }] }
    }

    fn opened(directory: &Path, seed: u64) -> Result<Numbered<Repetition>, Failure> {
        let check = |repetition: &Repetition| match repetition.stages.is_empty() {
            true => Err(LineFault::Content("without a stage".to_owned())),
            false => Ok(()),
        };
        Numbered::open(directory, &serde_json::json!({ "seed": seed }), 4, Rc::new(check), &Stop::default())
    }

    fn message(result: Result<Numbered<Repetition>, Failure>) -> String {
        result.err().expect("refused").to_string()
    }

    /// Computing times may differ.
    #[test]
    fn folders_of_the_same_work_are_put_together() {
        let [first, second] = [(); 2].map(|()| tempfile::tempdir().expect("a folder"));
        let mut other = opened(second.path(), 1).expect("new");
        other.put(2, repetition(3, 10)).expect("written");
        other.put(0, repetition(4, 10)).expect("written");
        drop(other);
        let mut numbered = opened(first.path(), 1).expect("new");
        numbered.put(0, repetition(4, 20)).expect("written");
        numbered.add(second.path()).expect("the same work");
        drop(numbered);
        let numbered = opened(first.path(), 1).expect("the same");
        assert_eq!(numbered.get(0).expect("readable"), Some(repetition(4, 20)));
        assert_eq!((numbered.get(2).expect("readable"), numbered.is_finished(1)), (Some(repetition(3, 10)), false));
    }

    #[test]
    fn other_work_and_other_results_are_refused() {
        let [first, second] = [(); 2].map(|()| tempfile::tempdir().expect("a folder"));
        drop(opened(second.path(), 2).expect("new"));
        let message = message(opened(second.path(), 1));
        assert!(message.contains("is of other work: seed: expected 1, got 2"), "{message}");
        let mut numbered = opened(first.path(), 2).expect("new");
        numbered.put(1, repetition(3, 10)).expect("written");
        opened(second.path(), 2).expect("the same").put(1, repetition(2, 10)).expect("written");
        let failure = numbered.add(second.path()).expect_err("differs");
        assert!(
            failure.exit() == Exit::Unexpected && failure.to_string().contains("result 1 came out differently"),
            "{failure}"
        );
        fs::write(second.path().join(RESULTS), reseal(b"{\"number\":4,\"result\":{\"stages\":[]}}\n"))
            .expect("written");
        let message = numbered.add(second.path()).expect_err("too many").to_string();
        assert!(message.contains("results.jsonl:1: result 4 of 4"), "{message}");
        fs::write(second.path().join(RESULTS), reseal(b"{\"number\":3,\"result\":{\"stages\":[]}}\n"))
            .expect("written");
        let message = numbered.add(second.path()).expect_err("no result").to_string();
        assert!(message.contains("results.jsonl:1: without a stage"), "{message}");
        fs::remove_file(second.path().join(RESULTS)).expect("there");
        numbered.add(second.path()).expect("it has just begun");
    }
}
