//! Classes that a scenario accepts below a rate, held against trials.

use evidence::trial::{Outcome, Outcomes};
use scenario::Scenario;
use serde::{Deserialize, Serialize};
use stats::rate_lower;

/// Level of confidence at which trials refute an accepted rate. A row errs in one of a hundred, and an evaluation has a few such rows.
const LEVEL: f64 = 0.99;

/// Class of a row that is accepted below a rate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AcceptedRate {
    /// The class.
    pub class: Outcome,
    /// Rate below which the class is accepted, percent.
    pub below_percent: f64,
    /// Trials of the class.
    pub hits: u64,
    /// All trials.
    pub n: u64,
    /// Exact one-sided lower bound on the rate at 99 %.
    pub lower_99: f64,
    /// True if the rate is not below the stated one, at that level.
    pub refuted: bool,
}

impl AcceptedRate {
    /// The accepted classes of a scenario, by the classes of its trials.
    pub fn from_outcomes(scenario: &Scenario, outcomes: &Outcomes) -> Vec<AcceptedRate> {
        let rate = |accepted: &scenario::Accepted| Self::judge(*accepted.class, accepted.below_percent.get(), outcomes);
        scenario.accepted.iter().map(rate).collect()
    }

    fn judge(class: Outcome, below_percent: f64, outcomes: &Outcomes) -> Self {
        let (hits, n) = (outcomes.get(&class).copied().unwrap_or(0), outcomes.values().sum());
        let lower_99 = rate_lower(hits, n, LEVEL);
        Self { class, below_percent, hits, n, lower_99, refuted: lower_99 >= below_percent / 100.0 }
    }

    /// True if the figures follow from the classes of all trials.
    pub(super) fn follows_from(&self, outcomes: &Outcomes) -> bool {
        *self == Self::judge(self.class, self.below_percent, outcomes)
    }

    /// True if a trial of `class` is accepted by one of `rates`.
    pub fn covers(rates: &[AcceptedRate], class: Outcome) -> bool {
        rates.iter().any(|rate| rate.class == class && !rate.refuted)
    }

    /// Trials that are accepted.
    pub fn trials(rates: &[AcceptedRate]) -> u64 {
        rates.iter().filter(|rate| !rate.refuted).map(|rate| rate.hits).sum()
    }

    /// Such as `FALSE_TRIP 2 of 59, accepted below 0.3 %`; none where no trial is of the class.
    pub fn line(&self) -> Option<String> {
        let Self { hits, n, below_percent, .. } = self;
        let verdict = if self.refuted { "refuted at 99 %: accepted" } else { "accepted" };
        (*hits > 0).then(|| format!("{} {hits} of {n}, {verdict} below {below_percent} %", self.class.name()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trips(hits: u64, n: u64) -> AcceptedRate {
        let outcomes = [(Outcome::Nominal, n - hits), (Outcome::FalseTrip, hits)];
        AcceptedRate::judge(Outcome::FalseTrip, 0.5, &outcomes.into_iter().filter(|(_, n)| *n > 0).collect())
    }

    /// P(2 or more of 59 at 0.5 %) is 3.5 %, P(3 or more) 0.4 %.
    #[test]
    fn accepted_rate_falls_where_trials_refute_it() {
        assert_eq!([0, 2, 3].map(|hits| trips(hits, 59).refuted), [false, false, true]);
        assert!(trips(1, 1).refuted && !trips(0, 0).refuted);
        let [held, fallen] = [[trips(2, 59)], [trips(3, 59)]];
        assert!(AcceptedRate::covers(&held, Outcome::FalseTrip) && !AcceptedRate::covers(&held, Outcome::Late));
        assert!(!AcceptedRate::covers(&fallen, Outcome::FalseTrip));
        assert_eq!((AcceptedRate::trials(&held), AcceptedRate::trials(&fallen)), (2, 0));
        assert_eq!(fallen[0].line().unwrap(), "FALSE_TRIP 3 of 59, refuted at 99 %: accepted below 0.5 %");
    }
}
