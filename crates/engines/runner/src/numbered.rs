//! Numbered results of one piece of work on disk, so that it resumes, and partitions of it are put together: `terms.json` says of which
//! work, `results.jsonl` has a line a result, written when the result is there.
//!
//! A result depends on the terms and its number alone, so folders of the same work can be put together in any order. Only an index is in
//! memory. The trials of a campaign, which are judged as they come, are `campaign`'s own.

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
use super::lines::{At, Lines, each, lock};
use super::out;

/// The longest terms that are read.
const MAX_TERMS_BYTES: u64 = 1 << 20;
const TERMS: &str = "terms.json";
const RESULTS: &str = "results.jsonl";

/// Fault of a result that cannot be of this work, in words.
pub type Check<T> = Rc<dyn Fn(&T) -> Result<(), String>>;

/// A result that is the same on every machine but for the time that it took.
pub trait Timeless: Serialize + DeserializeOwned + PartialEq {
    /// The same without that time.
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

/// The finished results in one folder, which no other process uses meanwhile.
pub struct Numbered<T> {
    terms: Value,
    /// Numbers are below it.
    of: u64,
    lines: Lines,
    index: BTreeMap<u64, At>,
    /// The kernel lets go of it however the process ends.
    _lock: File,
    check: Check<T>,
}

impl<T: Timeless> Numbered<T> {
    /// Those in `directory`, which may be new. `terms` are everything that `of` results depend on; each that is read passes `check`.
    ///
    /// # Errors
    /// When it holds other work, or the user asks to stop while another process is at work there.
    pub fn open(
        directory: &Path,
        terms: &impl Serialize,
        of: u64,
        check: Check<T>,
        stop: &Stop,
    ) -> Result<Self, Failure> {
        let terms = serde_json::to_value(terms).map_err(Failure::internal)?;
        fs::create_dir_all(directory)?;
        let lock = lock(directory, stop)?;
        if directory.join(TERMS).exists() {
            same(directory, &terms)?;
        } else {
            out::write_json(directory, "terms.json.new", &terms)?;
            fs::rename(directory.join("terms.json.new"), directory.join(TERMS))?;
        }
        let mut index = BTreeMap::new();
        let lines = Lines::open(&directory.join(RESULTS), |at, line: Line<T>| {
            check(&line.result)?;
            index.insert(below(line.number, of)?, at);
            Ok(())
        })?;
        Ok(Self { terms, of, lines, index, _lock: lock, check })
    }

    /// Copies those of another folder, which stays as it is.
    ///
    /// # Errors
    /// When it holds other work, or a result that came out differently here.
    pub fn add(&mut self, directory: &Path) -> Result<(), Failure> {
        same(directory, &self.terms)?;
        let path = directory.join(RESULTS);
        let (of, check) = (self.of, Rc::clone(&self.check));
        let fits = |line: &Line<T>| below(line.number, of).and_then(|_| check(&line.result));
        each(&path, fits, |line| self.take(&path, line.number, line.result))
    }

    /// True if that result is there.
    pub fn has(&self, number: u64) -> bool {
        self.index.contains_key(&number)
    }

    /// That result, if it is there.
    ///
    /// # Errors
    /// When the file was changed meanwhile.
    pub fn get(&self, number: u64) -> Result<Option<T>, Failure> {
        let line = self.index.get(&number).map(|at| self.lines.get::<Line<T>>(*at)).transpose()?;
        Ok(line.map(|line| line.result))
    }

    /// Adds a result.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn put(&mut self, number: u64, result: T) -> Result<(), Failure> {
        let at = self.lines.put(&Line { number, result })?;
        self.index.insert(number, at);
        Ok(())
    }

    fn take(&mut self, path: &Path, number: u64, result: T) -> Result<(), Failure> {
        let Some(own) = self.get(number)? else { return self.put(number, result) };
        if own.timeless() == result.timeless() {
            return Ok(());
        }
        let message = format!("{}: result {number} came out differently elsewhere", path.display());
        Err(Failure::new(Exit::Unexpected, message))
    }
}

fn below(number: u64, of: u64) -> Result<u64, String> {
    if number < of { Ok(number) } else { Err(format!("result {number} of {of}")) }
}

/// Checks that a folder holds the work of these terms and no other.
fn same(directory: &Path, terms: &Value) -> Result<(), Failure> {
    let path = directory.join(TERMS);
    let unusable = |why: String| {
        let remedy = "name the folder that the same command made with --out DIR";
        Failure::new(Exit::Usage, format!("{}: {why}; {remedy}", path.display()))
    };
    let text = files::read(&path, MAX_TERMS_BYTES).map_err(|e| unusable(e.to_string()))?;
    let there: Value = serde_json::from_slice(&text).map_err(|e| unusable(e.to_string()))?;
    if there == *terms {
        return Ok(());
    }
    let mut keys = terms.as_object().into_iter().flatten();
    let differs = keys.find(|(key, value)| there.get(key.as_str()) != Some(value));
    let Some((key, value)) = differs else { return Err(unusable("not the terms of this command".to_owned())) };
    let got = there.get(key.as_str()).map_or_else(|| "nothing".to_owned(), Value::to_string);
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
        let check = |one: &Repetition| if one.stages.is_empty() { Err("without a stage".to_owned()) } else { Ok(()) };
        Numbered::open(directory, &serde_json::json!({ "seed": seed }), 4, Rc::new(check), &Stop::default())
    }

    fn told(result: Result<Numbered<Repetition>, Failure>) -> String {
        result.err().expect("refused").to_string()
    }

    /// Whatever time it took there.
    #[test]
    fn folders_of_the_same_work_are_put_together() {
        let [ours, theirs] = [(); 2].map(|()| tempfile::tempdir().expect("a folder"));
        let mut other = opened(theirs.path(), 1).expect("new");
        other.put(2, repetition(3, 10)).expect("written");
        other.put(0, repetition(4, 10)).expect("written");
        drop(other);
        let mut own = opened(ours.path(), 1).expect("new");
        own.put(0, repetition(4, 20)).expect("written");
        own.add(theirs.path()).expect("the same work");
        drop(own);
        let own = opened(ours.path(), 1).expect("the same");
        assert_eq!(own.get(0).expect("readable"), Some(repetition(4, 20)));
        assert_eq!((own.get(2).expect("readable"), own.has(1)), (Some(repetition(3, 10)), false));
    }

    #[test]
    fn other_work_and_other_results_are_refused() {
        let [ours, theirs] = [(); 2].map(|()| tempfile::tempdir().expect("a folder"));
        drop(opened(theirs.path(), 2).expect("new"));
        let told = told(opened(theirs.path(), 1));
        assert!(told.contains("is of other work: seed: expected 1, got 2"), "{told}");
        let mut own = opened(ours.path(), 2).expect("new");
        own.put(1, repetition(3, 10)).expect("written");
        opened(theirs.path(), 2).expect("the same").put(1, repetition(2, 10)).expect("written");
        let told = own.add(theirs.path()).expect_err("differs");
        assert!(
            told.exit() == Exit::Unexpected && told.to_string().contains("result 1 came out differently"),
            "{told}"
        );
        fs::write(theirs.path().join(RESULTS), reseal(b"{\"number\":4,\"result\":{\"stages\":[]}}\n"))
            .expect("written");
        let told = own.add(theirs.path()).expect_err("too many").to_string();
        assert!(told.contains("results.jsonl:1: result 4 of 4"), "{told}");
        fs::write(theirs.path().join(RESULTS), reseal(b"{\"number\":3,\"result\":{\"stages\":[]}}\n"))
            .expect("written");
        let told = own.add(theirs.path()).expect_err("no result").to_string();
        assert!(told.contains("results.jsonl:1: without a stage"), "{told}");
        fs::remove_file(theirs.path().join(RESULTS)).expect("there");
        own.add(theirs.path()).expect("it has just begun");
    }
}
