//! Waiting time for an event that does not occur in every run: medians, and the ratio of two, with exact intervals (order
//! statistics).
//!
//! A run without the event only shows that it takes longer than the waiting time: such a run ranks after every run with it,
//! and a value that rests on it is given as a bound. All runs of a sample have the same waiting time.

use serde::Serialize;
use statrs::function::beta::beta_reg;
use stats::LEVEL;

/// Time until the event, or the waiting time without it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Wait {
    /// So long, in whatever unit.
    pub waited: f64,
    /// True if it happened then.
    pub came: bool,
}

/// The median of some waits, and an interval of it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Median {
    /// The median; of an even number the upper of the two in the middle.
    pub median: Wait,
    /// Ends of the interval; none where the sample is too small for any.
    pub interval: Option<[Wait; 2]>,
}

impl Median {
    /// Median of `waits` in any order, with an interval of at least this level; none of none.
    pub fn from_waits(waits: &[Wait], level: f64) -> Option<Self> {
        let mut sorted = waits.to_vec();
        sorted.sort_by(|a, b| b.came.cmp(&a.came).then(a.waited.total_cmp(&b.waited)));
        let n = sorted.len();
        let median = *sorted.get(n / 2)?;
        // Order statistics of rank r from either end: as long as P(Binomial(n, 1/2) < r) is no more than what one side
        // may miss.
        let fewer = |r: usize| beta_reg((n - r + 1) as f64, r as f64, 0.5);
        let rank = (1..=n / 2).rev().find(|r| fewer(*r) <= (1.0 - level) / 2.0);
        Some(Self { median, interval: rank.map(|r| [sorted[r - 1], sorted[n - r]]) })
    }
}

/// One median over another.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Ratio {
    /// The ratio, as far as it is known.
    pub ratio: Known,
    /// Ends of an interval that holds it with at least 95 %: each median in its own at 97.5 %. `None` where it is unknown.
    pub interval_95: [Option<f64>; 2],
}

/// Knowledge of a number.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Known {
    /// It is this.
    Is(f64),
    /// It is no more than this.
    AtMost(f64),
    /// It is no less than this.
    AtLeast(f64),
    /// No information.
    Unknown,
}

impl Ratio {
    /// Ratio of the median of `waits` to that of `over`.
    pub fn from_waits(waits: &[Wait], over: &[Wait]) -> Self {
        let each = 1.0 - (1.0 - LEVEL) / 2.0;
        let (Some(above), Some(below)) = (Median::from_waits(waits, each), Median::from_waits(over, each)) else {
            return Self { ratio: Known::Unknown, interval_95: [None, None] };
        };
        let quotient = above.median.waited / below.median.waited;
        let ratio = match (above.median.came, below.median.came) {
            (true, true) => Known::Is(quotient),
            (true, false) => Known::AtMost(quotient),
            (false, true) => Known::AtLeast(quotient),
            (false, false) => Known::Unknown,
        };
        let interval_95 = match (above.interval, below.interval) {
            (Some([low, high]), Some([from, to])) => {
                [to.came.then_some(low.waited / to.waited), high.came.then_some(high.waited / from.waited)]
            }
            (None, _) | (_, None) => [None, None],
        };
        Self { ratio, interval_95 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arrived_waits(values: impl IntoIterator<Item = u32>) -> Vec<Wait> {
        values.into_iter().map(|value| Wait { waited: f64::from(value), came: true }).collect()
    }

    fn in_vain(n: usize, waited: f64) -> Vec<Wait> {
        vec![Wait { waited, came: false }; n]
    }

    #[test]
    fn median_lies_between_the_binomial_ranks() {
        // n = 20: P(Binomial(20, 1/2) < 6) = 0.0207 and < 7 is 0.0577; the tables have ranks 6 and 15 for 95 %.
        let median = Median::from_waits(&arrived_waits((1..=20).rev()), 0.95).unwrap();
        assert_eq!((median.median.waited, median.interval.unwrap().map(|end| end.waited)), (11.0, [6.0, 15.0]));
        assert_eq!(
            Median::from_waits(&arrived_waits(1..=5), 0.95).unwrap().interval,
            None,
            "one in 16 lies on one side"
        );
        assert_eq!(Median::from_waits(&[], 0.95), None);
    }

    #[test]
    fn missing_events_rank_last_and_give_a_bound() {
        let half = [in_vain(12, 5.0), arrived_waits(1..=8)].concat();
        let median = Median::from_waits(&half, 0.95).unwrap();
        assert_eq!(median.median, Wait { waited: 5.0, came: false });
        assert_eq!(median.interval.unwrap(), [Wait { waited: 6.0, came: true }, Wait { waited: 5.0, came: false }]);
    }

    #[test]
    fn ratio_is_as_certain_as_its_medians() {
        let (fast, slow) = (arrived_waits(1..=20), arrived_waits((1..=20).map(|i| i * 100)));
        let ratio = Ratio::from_waits(&fast, &slow);
        // At 97.5 % the ranks are 5 and 16.
        assert_eq!(ratio, Ratio { ratio: Known::Is(0.01), interval_95: [Some(5.0 / 1600.0), Some(16.0 / 500.0)] });
        let beyond = Ratio::from_waits(&fast, &in_vain(20, 1000.0));
        assert_eq!(beyond, Ratio { ratio: Known::AtMost(0.011), interval_95: [None, Some(0.016)] });
        assert_eq!(Ratio::from_waits(&in_vain(20, 1000.0), &fast).ratio, Known::AtLeast(1000.0 / 11.0));
        assert_eq!(Ratio::from_waits(&in_vain(20, 9.0), &in_vain(20, 9.0)).ratio, Known::Unknown);
    }
}
