//! Outcomes of one variation beside those stated beforehand, whatever kind of result it is a row of. Writing a summary
//! of them is left to `closing`.

use evidence::trial::{Outcome, Outcomes};
use results::report::{CampaignRow, MatrixRun, ReferenceRow};

/// Outcomes of one variation.
#[derive(Clone, Debug)]
pub struct Ended {
    /// Trials by class.
    pub outcomes: Outcomes,
    /// Trials outside the classes that were stated beforehand; `None` where none was stated.
    pub unexpected: Option<u64>,
}

impl Ended {
    /// Number of trials.
    pub(crate) fn trials(&self) -> u64 {
        self.outcomes.values().sum()
    }

    /// Number of trials of a class.
    pub(crate) fn count(&self, class: Outcome) -> u64 {
        self.outcomes.get(&class).copied().unwrap_or(0)
    }
}

impl From<&MatrixRun> for Ended {
    fn from(run: &MatrixRun) -> Self {
        let odd = if run.is_as_expected() { 0 } else { run.unexpected };
        Self { outcomes: run.summary.outcomes.clone(), unexpected: (!run.expected.is_empty()).then_some(odd) }
    }
}

impl From<&ReferenceRow> for Ended {
    fn from(row: &ReferenceRow) -> Self {
        // A run that the host spoilt is not judged, and counts as INVALID.
        let odd = if row.is_as_expected() { 0 } else { row.unexpected };
        Self { outcomes: row.summary.outcomes.clone(), unexpected: (!row.expected.is_empty()).then_some(odd) }
    }
}

impl From<&CampaignRow> for Ended {
    fn from(row: &CampaignRow) -> Self {
        Self { outcomes: row.outcomes.clone(), unexpected: (!row.expected.is_empty()).then_some(row.unexpected) }
    }
}
