//! Comparison of a row with its trials run again. Running them is left to the caller.

use evidence::trial::Outcome;
use serde::{Deserialize, Serialize};
use stats::Share;

use crate::row::{BoardRow, BoardTrial};

/// The most differing trials that are named.
const MAX_NAMED: usize = 20;

/// Result of a comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ReplayVerdict {
    /// Every log and class is the row's.
    Reproduced,
    /// The guest is not repeatable. For each class, the 95 % intervals of the row and of the trials meet.
    WithinInterval,
    /// A log of a repeatable guest differs, or the interval of a class.
    Differs,
}

/// A trial that ended otherwise.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Differing {
    /// Seed.
    pub seed: u64,
    /// Class in the row.
    pub stated: Outcome,
    /// Class of the trial that was run again; the row's, where the log alone differs.
    pub got: Outcome,
}

/// A class in the row and in the trials that were run again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClassPair {
    /// Class.
    pub class: Outcome,
    /// Share in the row, of the same seeds.
    pub stated: Share,
    /// Share of the trials that were run again.
    pub got: Share,
}

impl ClassPair {
    fn meets(&self) -> bool {
        self.stated.lower_95 <= self.got.upper_95 && self.got.lower_95 <= self.stated.upper_95
    }
}

/// A row beside its trials, run again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Replay {
    /// Result.
    pub verdict: ReplayVerdict,
    /// Trials that were run.
    pub trials: usize,
    /// Trials of the row.
    pub of: usize,
    /// Trials with the row's log.
    pub same_logs: usize,
    /// Trials with another log or class, at most 20.
    pub differing: Vec<Differing>,
    /// Each class that one of the two has.
    pub classes: Vec<ClassPair>,
}

impl Replay {
    /// The comparison of `row` with `trials`, which have its first seeds.
    pub fn new(row: &BoardRow, trials: &[BoardTrial]) -> Self {
        let stated = &row.trials[..trials.len().min(row.trials.len())];
        let pairs = || stated.iter().zip(trials).zip(row.seed..);
        let differing = pairs().filter(|((stated, got), _)| stated != got).map(|((stated, got), seed)| Differing {
            seed,
            stated: stated.class,
            got: got.class,
        });
        let differing: Vec<Differing> = differing.collect();
        let classes = classes(stated, trials);
        let verdict = match (differing.is_empty(), row.repeatable) {
            (true, _) => ReplayVerdict::Reproduced,
            (false, false) if classes.iter().all(ClassPair::meets) => ReplayVerdict::WithinInterval,
            (false, _) => ReplayVerdict::Differs,
        };
        Self {
            verdict,
            trials: trials.len(),
            of: row.trials.len(),
            same_logs: pairs().filter(|((stated, got), _)| stated.log == got.log).count(),
            differing: differing.into_iter().take(MAX_NAMED).collect(),
            classes,
        }
    }
}

fn classes(stated: &[BoardTrial], got: &[BoardTrial]) -> Vec<ClassPair> {
    let count = |trials: &[BoardTrial], class| trials.iter().filter(|trial| trial.class == class).count() as u64;
    let share = |trials: &[BoardTrial], class| Share::new(count(trials, class), trials.len() as u64);
    let pair = |class| ClassPair { class, stated: share(stated, class), got: share(got, class) };
    Outcome::ALL.into_iter().map(pair).filter(|pair| pair.stated.hits + pair.got.hits > 0).collect()
}
