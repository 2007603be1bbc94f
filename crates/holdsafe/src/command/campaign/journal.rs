//! The finished trials of a campaign on disk: a set that only grows. `plan.json` identifies the campaign,
//! `trials.jsonl` has a line a trial in the order in which they were judged, for every process and partition.
//!
//! Only an index is in memory, about fifty bytes a trial; one process at a time has the folder.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use evidence::trial::Outcome;
use link::files;
use parallel::progress::Stop;
use results::campaign::Plan;
use results::campaign::row::TrialRow;
use runner::failure::{Exit, Failure};
use runner::lines::{LineFault, LinePlace, Lines};
use runner::{lines, out};

/// The longest plan that is read.
const MAX_PLAN_BYTES: u64 = 64 << 20;
const PLAN: &str = "plan.json";
const TRIALS: &str = "trials.jsonl";

/// The finished trials of one campaign.
#[derive(Debug)]
pub(super) struct Journal {
    lines: Lines,
    index: Mutex<BTreeMap<u64, (LinePlace, Outcome)>>,
    /// Held while the folder is in use; the kernel releases it however the process ends.
    _lock: File,
}

impl Journal {
    /// The journal of `plan` in `directory`, which may be new, or hold finished trials of the same campaign and of no other.
    /// Another process that has it is waited for.
    pub(super) fn open(directory: &Path, plan: &Plan, stop: &Stop) -> Result<Self, Failure> {
        fs::create_dir_all(directory)?;
        let lock = lines::lock(directory, stop)?;
        if directory.join(PLAN).exists() {
            same(directory, plan, &read_plan(directory)?)?;
        } else {
            // By a rename: a process that is killed while it writes leaves no half plan.
            out::write_json(directory, "plan.json.new", plan)?;
            fs::rename(directory.join("plan.json.new"), directory.join(PLAN))?;
        }
        let mut index = BTreeMap::new();
        let lines = Lines::open(&directory.join(TRIALS), |place, row: TrialRow| {
            belongs(plan, &row)?;
            index.insert(row.trial, (place, row.outcome));
            Ok(())
        })?;
        Ok(Self { lines, index: Mutex::new(index), _lock: lock })
    }

    /// The class of a finished trial.
    pub(super) fn outcome(&self, trial: u64) -> Option<Outcome> {
        self.index().get(&trial).map(|(_, outcome)| *outcome)
    }

    /// A finished trial.
    pub(super) fn row(&self, trial: u64) -> Result<Option<TrialRow>, Failure> {
        let at = self.index().get(&trial).map(|(place, _)| *place);
        at.map(|place| self.lines.get(place)).transpose()
    }

    /// Number of finished trials.
    pub(super) fn len(&self) -> usize {
        self.index().len()
    }

    /// Adds a finished trial. One that is there already has to be the same in everything.
    pub(super) fn add(&self, plan: &Plan, row: &TrialRow) -> Result<(), Failure> {
        let Some(known) = self.row(row.trial)? else {
            let place = self.lines.put(row)?;
            self.index().insert(row.trial, (place, row.outcome));
            return Ok(());
        };
        if known == *row {
            return Ok(());
        }
        let (v, i) = plan.place(row.trial);
        let name = plan.variations.get(v).map(|variation| variation.name()).unwrap_or_default();
        let describe = |row: &TrialRow| format!("{} with log {}", row.outcome.name(), row.log_hash);
        let message = format!(
            "trial of seed {} of `{name}`: expected {}, got {}; the same trial came out differently",
            plan.seed(i),
            describe(&known),
            describe(row)
        );
        Err(Failure::new(Exit::Usage, message).reproduced_by(plan.reproduce(v, i)))
    }

    fn index(&self) -> MutexGuard<'_, BTreeMap<u64, (LinePlace, Outcome)>> {
        self.index.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The plan in a campaign's folder.
pub(super) fn read_plan(directory: &Path) -> Result<Plan, Failure> {
    let path = directory.join(PLAN);
    let unusable = |reason: String| {
        let remedy = "name the folder that `holdsafe campaign run --out DIR` made";
        Failure::new(Exit::Usage, format!("{}: {reason}; {remedy}", path.display()))
    };
    let text = files::read(&path, MAX_PLAN_BYTES).map_err(|e| unusable(e.to_string()))?;
    let plan: Plan = serde_json::from_slice(&text).map_err(|e| unusable(e.to_string()))?;
    plan.bounded().map_err(unusable)?;
    Ok(plan)
}

/// True if a folder has finished trials of a campaign.
pub(super) fn has_journal(directory: &Path) -> bool {
    [PLAN, TRIALS].iter().all(|name| directory.join(name).is_file())
}

/// Gives each finished trial in a folder of the campaign to `take`; the folder stays as it is.
pub(super) fn each_row(
    directory: &Path,
    plan: &Plan,
    take: impl FnMut(TrialRow) -> Result<(), Failure>,
) -> Result<(), Failure> {
    lines::each(&directory.join(TRIALS), |row| belongs(plan, row), take)
}

/// Checks that a folder holds the campaign of `plan` and no other.
pub(super) fn same(directory: &Path, plan: &Plan, stored: &Plan) -> Result<(), Failure> {
    let Some(difference) = plan.difference(stored) else { return Ok(()) };
    let message = format!("{} is of another campaign: {difference}", directory.display());
    Err(Failure::new(Exit::Usage, format!("{message}; keep each campaign in a folder of its own")))
}

fn belongs(plan: &Plan, row: &TrialRow) -> Result<(), LineFault> {
    let total = plan.total();
    let outside = || LineFault::Content(format!("trial {} of a campaign of {total}", row.trial));
    (row.trial < total).then_some(()).ok_or_else(outside)
}

#[cfg(test)]
mod tests {
    use super::*;
    use evidence::trial::Trial;
    use results::campaign::example::plan;

    fn row(number: u64, outcome: Outcome) -> TrialRow {
        TrialRow::from_trial(number, &Trial::example(number, outcome))
    }

    fn open(directory: &Path, plan: &Plan) -> Result<Journal, Failure> {
        Journal::open(directory, plan, &Stop::default())
    }

    /// The journal has each trial once; one that differs is refused, and the refusal shows both.
    #[test]
    fn journal_refuses_a_trial_that_differs() {
        let (directory, plan) = (tempfile::tempdir().expect("a folder"), plan(10));
        let journal = open(directory.path(), &plan).expect("new");
        journal.add(&plan, &row(3, Outcome::HoldSafe)).expect("new");
        journal.add(&plan, &row(3, Outcome::HoldSafe)).expect("the same again");
        let text = journal.add(&plan, &row(3, Outcome::Unsafe)).expect_err("another").to_string();
        assert!(
            text.starts_with("trial of seed 10 of `loss @ loss.0.share=0.5`: expected HOLD_SAFE with log"),
            "{text}"
        );
        drop(journal);
        let journal = open(directory.path(), &plan).expect("the same");
        assert_eq!((journal.len(), journal.outcome(3), journal.outcome(4)), (1, Some(Outcome::HoldSafe), None));
        assert_eq!(journal.row(3).expect("readable"), Some(row(3, Outcome::HoldSafe)));
    }

    #[test]
    fn folder_belongs_to_one_campaign() {
        let directory = tempfile::tempdir().expect("a folder");
        drop(open(directory.path(), &plan(10)).expect("new"));
        let text = open(directory.path(), &plan(11)).expect_err("other").to_string();
        assert!(text.contains("is of another campaign: trials: expected 11, got 10"), "{text}");
    }

    /// The refusal names the line of the trial.
    #[test]
    fn trial_outside_the_campaign_is_refused() {
        let (directory, plan) = (tempfile::tempdir().expect("a folder"), plan(1));
        let line = serde_json::to_string(&row(2, Outcome::HoldSafe)).expect("a line");
        fs::write(directory.path().join(TRIALS), lines::reseal((line + "\n").as_bytes())).expect("written");
        let text = open(directory.path(), &plan).expect_err("refused").to_string();
        assert!(text.contains("trials.jsonl:1: trial 2 of a campaign of 2"), "{text}");
    }
}
