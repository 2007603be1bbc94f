//! Results against themselves: counts, bounds and latencies of a summary follow from its trials, its number of unexpected ones from its
//! classes. A result that was changed by hand at one place contradicts the other.
//!
//! Figures that no trial of an object has (CPU time, false trips, time in nominal control) are left as they are. Whether recordings agree
//! with a result is left to the crate `runner`.

use evidence::trial::{Outcome, Outcomes, Trial};
use stats::{LEVEL, rate_upper};

use super::AcceptedRate;
use super::campaign::{CampaignObject, CampaignRow};
use super::matrix::{Matrix, MatrixRun};
use super::mission::MissionSummary;
use super::reference::{Reference, ReferenceRow};
use super::run::{RunObject, Summary};

impl RunObject {
    /// The first contradiction between its trials and the figures folded of them.
    pub fn contradiction(&self) -> Option<String> {
        let all: Vec<&Trial> = self.trials.iter().collect();
        let of_cell = |cell: &str| all.iter().copied().filter(|t| t.cell.as_deref() == Some(cell)).collect::<Vec<_>>();
        let whole = self.summary.difference(&all).map(|name| format!("{}: {name}", self.scenario));
        let mission = || {
            let differs = self.mission != MissionSummary::from_trials(&self.trials);
            differs.then(|| format!("{}: the mission's summary does not follow from its trials", self.scenario))
        };
        let cells = || {
            let mut cells = self.cells.iter();
            cells.find_map(|row| Some(format!("{}: {}", row.cell, row.summary.difference(&of_cell(&row.cell))?)))
        };
        whole.or_else(mission).or_else(cells)
    }
}

impl Summary {
    /// The difference between this and the summary folded of `trials`.
    fn difference(&self, trials: &[&Trial]) -> Option<String> {
        let folded = Summary {
            false_trips_per_hour: self.false_trips_per_hour,
            false_trips_per_hour_upper_95: self.false_trips_per_hour_upper_95,
            nominal_share: self.nominal_share,
            cpu_seconds: self.cpu_seconds,
            ..Summary::from_trials(trials)
        };
        if self.outcomes != folded.outcomes {
            return Some(format!(
                "its trials are {}, its summary says {}",
                named(&folded.outcomes),
                named(&self.outcomes)
            ));
        }
        (*self != folded).then(|| "the summary does not follow from its trials".to_owned())
    }

    /// The difference between its counts, its bounds, and the number of `unexpected` trials beside it.
    fn count_difference(&self, expected: &[Outcome], unexpected: u64, spoilt: u64) -> Option<String> {
        let count = |class: Outcome| self.outcomes.get(&class).copied().unwrap_or_default();
        let (n, harmful, invalid) = (self.n as u64, count(Outcome::Unsafe), count(Outcome::Invalid));
        let bounds = || {
            let valid = n.checked_sub(invalid)?;
            let stated = [self.unsafe_upper_95, self.unsafe_upper_95_invalid_counted];
            let follow = [rate_upper(harmful, valid, LEVEL), rate_upper(harmful + invalid, n, LEVEL)];
            (stated != follow).then(|| "its bounds do not follow from its counts".to_owned())
        };
        counted(&self.outcomes, n, expected, unexpected + spoilt).or_else(bounds)
    }
}

impl Summary {
    /// The difference between accepted rates and those that its classes give.
    fn false_rate(&self, accepted: &[AcceptedRate]) -> Option<String> {
        let wrong = accepted.iter().find(|rate| !rate.follows_from(&self.outcomes))?;
        Some(format!("the accepted rate of {} does not follow from its classes", wrong.class.name()))
    }
}

impl Matrix {
    /// The first contradiction within its rows.
    pub fn contradiction(&self) -> Option<String> {
        let runs = self.rows.iter().flat_map(|row| &row.runs);
        let text = runs.clone().find_map(|run| {
            let text = run.summary.count_difference(&run.expected, run.unexpected, 0);
            Some(format!("{}: {}", run.scenario, text.or_else(|| run.summary.false_rate(&run.accepted))?))
        });
        text.or_else(|| judged(self.as_expected, runs.map(MatrixRun::is_as_expected)))
    }
}

impl Reference {
    /// The first contradiction within its rows.
    pub fn contradiction(&self) -> Option<String> {
        let text = self.rows.iter().find_map(|row| {
            let spoilt = row.not_judged_ms.len() as u64;
            let text = row.summary.count_difference(&row.expected, row.unexpected, spoilt);
            Some(format!("{}: {}", row.scenario, text.or_else(|| row.summary.false_rate(&row.accepted))?))
        });
        text.or_else(|| judged(self.as_expected, self.rows.iter().map(ReferenceRow::is_as_expected)))
    }
}

impl CampaignObject {
    /// The first contradiction within its rows.
    pub fn contradiction(&self) -> Option<String> {
        let row = |row: &CampaignRow| {
            Some(format!("{}: {}", row.scenario, counted(&row.outcomes, row.n, &row.expected, row.unexpected)?))
        };
        let total: u64 = self.rows.iter().map(|row| row.n).sum();
        let whole = (total != self.trials).then(|| format!("{} trials, its rows have {total}", self.trials));
        self.rows.iter().find_map(row).or(whole)
    }
}

/// The difference between a number of trials, their classes, and the number of unexpected ones.
fn counted(outcomes: &Outcomes, n: u64, expected: &[Outcome], unexpected: u64) -> Option<String> {
    let total: u64 = outcomes.values().sum();
    let outside: u64 = outcomes.iter().filter(|(class, _)| class.is_unexpected(expected)).map(|(_, n)| n).sum();
    if total != n {
        return Some(format!("{n} trials, its classes have {total} ({})", named(outcomes)));
    }
    (outside != unexpected)
        .then(|| format!("{unexpected} unexpected, its classes have {outside} ({})", named(outcomes)))
}

/// A verdict over rows that their counts do not give.
fn judged(as_expected: bool, mut rows: impl Iterator<Item = bool>) -> Option<String> {
    let wrong = as_expected && !rows.all(|row| row);
    wrong.then(|| "it says that all is as expected, a row has an unexpected trial".to_owned())
}

fn named(outcomes: &Outcomes) -> String {
    let each: Vec<String> = outcomes.iter().map(|(class, n)| format!("{} {n}", class.name())).collect();
    if each.is_empty() { "none".to_owned() } else { each.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mode::Mode;

    fn run() -> RunObject {
        let trials = (0..4).map(|seed| Trial::example(seed, Outcome::HoldSafe)).collect();
        RunObject::new("delay", Mode::Twin, 0, trials, &[])
    }

    #[test]
    fn a_run_follows_from_its_trials() {
        assert_eq!(run().contradiction(), None);
        let changes: [fn(&mut RunObject); 5] = [
            |run| run.summary.outcomes = Outcomes::from([(Outcome::Unsafe, 4)]),
            |run| run.trials[2].outcome = Outcome::Unsafe,
            |run| run.summary.unsafe_upper_95 = 0.01,
            |run| run.summary.latency_ms.to_degraded.n = 5,
            |run| run.trials.truncate(3),
        ];
        for (number, change) in changes.into_iter().enumerate() {
            let mut changed = run();
            change(&mut changed);
            assert!(changed.contradiction().is_some(), "change {number}");
        }
        let mut changed = run();
        changed.summary.outcomes = Outcomes::from([(Outcome::Rejected, 4)]);
        assert_eq!(changed.contradiction().unwrap(), "delay: its trials are HOLD_SAFE 4, its summary says REJECTED 4");
    }

    #[test]
    fn counts_and_bounds_of_a_row_agree() {
        let (summary, expected) = (run().summary, [Outcome::HoldSafe]);
        assert_eq!(summary.count_difference(&expected, 0, 0), None);
        assert!(
            summary
                .count_difference(&expected, 1, 0)
                .unwrap()
                .contains("1 unexpected, its classes have 0 (HOLD_SAFE 4)")
        );
        let changed = Summary { outcomes: Outcomes::from([(Outcome::Unsafe, 4)]), ..summary.clone() };
        assert!(changed.count_difference(&[Outcome::Unsafe], 0, 0).unwrap().contains("bounds"), "{changed:?}");
        let changed = Summary { n: 3, ..summary };
        assert!(changed.count_difference(&expected, 0, 0).unwrap().contains("3 trials, its classes have 4"));
    }
}
