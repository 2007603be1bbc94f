//! Exact one-sided bounds: on rates (Clopper-Pearson), on counts over time (Poisson), on quantiles (order statistics).
//!
//! Terms: *level* is the confidence, 0.95 unless stated otherwise; a bound that too few trials can give is `None`,
//! never a guess. Which trials may enter a rate is the business of `report`.

pub mod mean;
pub mod paired;
pub mod sequential;

use statrs::function::beta::beta_reg;
use statrs::function::gamma::gamma_ur;

/// Confidence level of bounds that state none.
pub const LEVEL: f64 = 0.95;

/// Exact upper bound (Clopper-Pearson, one-sided) on a rate after `hits` of `n`; 1 without trials.
pub fn rate_upper(hits: u64, n: u64, level: f64) -> f64 {
    if hits >= n {
        return 1.0;
    }
    // The rate p at which `hits` or fewer have probability 1 - level; that probability is 1 - I_p(hits + 1, n - hits).
    let (a, b) = (hits as f64 + 1.0, (n - hits) as f64);
    bisect(0.0, 1.0, |p| beta_reg(a, b, p) < level)
}

/// Exact lower bound (Clopper-Pearson, one-sided) on a rate after `hits` of `n`; 0 without trials.
pub fn rate_lower(hits: u64, n: u64, level: f64) -> f64 {
    // A lower bound on hits is an upper bound on the rest.
    if n == 0 { 0.0 } else { 1.0 - rate_upper(n.saturating_sub(hits), n, level) }
}

/// Share of an event, with its exact two-sided 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Share {
    /// Number of hits.
    pub hits: u64,
    /// Number of trials.
    pub n: u64,
    /// The observed share; `None` without trials.
    pub share: Option<f64>,
    /// Lower end of the interval.
    pub lower_95: f64,
    /// Upper end of the interval.
    pub upper_95: f64,
}

impl Share {
    /// Share of `hits` in `n`.
    pub fn new(hits: u64, n: u64) -> Self {
        let each_side = 0.5 * (1.0 + LEVEL);
        Self {
            hits,
            n,
            share: (n > 0).then(|| hits as f64 / n as f64),
            lower_95: rate_lower(hits, n, each_side),
            upper_95: rate_upper(hits, n, each_side),
        }
    }
}

/// Level for each of `rows` bounds at which all hold jointly at `level` (Bonferroni).
pub fn simultaneous_level(rows: usize, level: f64) -> f64 {
    1.0 - (1.0 - level) / rows.max(1) as f64
}

/// Exact upper bound on an event rate after `events` in `exposure` (any unit of time): per that unit.
pub fn events_upper(events: u64, exposure: f64) -> Option<f64> {
    if exposure.is_nan() || exposure <= 0.0 {
        return None;
    }
    // The mean m at which `events` or fewer have probability 1 - LEVEL; that probability is Q(events + 1, m).
    let a = events as f64 + 1.0;
    // Above every bound at the levels in use: the mean at 97.5 % is 3.7 for no event, and below 2 a from 10 events on.
    let ceiling = 4.0 * a + 20.0;
    let mean = bisect(0.0, ceiling, |m| m <= 0.0 || gamma_ur(a, m) > 1.0 - LEVEL);
    Some(mean / exposure)
}

/// Rate of events, with its exact two-sided 95 % interval (Poisson; F. Garwood, *Fiducial limits for the Poisson distribution*,
/// Biometrika 28, 1936).
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct EventRate {
    /// Events per unit of exposure.
    pub rate: f64,
    /// Lower end of the interval.
    pub lower_95: f64,
    /// Upper end of the interval.
    pub upper_95: f64,
}

impl EventRate {
    /// Rate of `events` in `exposure` (any unit of time); none without exposure.
    pub fn new(events: u64, exposure: f64) -> Option<Self> {
        if exposure.is_nan() || exposure <= 0.0 {
            return None;
        }
        let one_side = 0.5 * (1.0 - LEVEL);
        // The lower mean makes `events` or more as probable as one side allows, the upper one `events` or fewer.
        let (few, many) = (events as f64, events as f64 + 1.0);
        let ceiling = 4.0 * many + 20.0;
        let lower = match events {
            0 => 0.0,
            _ => bisect(0.0, ceiling, |m| m <= 0.0 || 1.0 - gamma_ur(few, m) < one_side),
        };
        let upper = bisect(0.0, ceiling, |m| m <= 0.0 || gamma_ur(many, m) > one_side);
        Some(Self { rate: few / exposure, lower_95: lower / exposure, upper_95: upper / exposure })
    }
}

/// Number between `low` and `high` up to which `below` holds.
fn bisect(mut low: f64, mut high: f64, below: impl Fn(f64) -> bool) -> f64 {
    // Enough for the last bit of every result above 1e-40.
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if below(middle) { low = middle } else { high = middle }
    }
    high
}

/// Mean, 95th percentile and its upper bound.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Sample {
    /// Count.
    pub n: usize,
    /// Mean.
    pub mean: Option<f64>,
    /// 95th percentile: the smallest value that 95 % of the sample do not exceed.
    pub p95: Option<f64>,
    /// Upper bound on the true 95th percentile; needs at least 59 values.
    pub p95_upper_95: Option<f64>,
}

impl Sample {
    /// Sample of `values`, in any order; a value that is not finite is a defect upstream and is skipped.
    pub fn from_values(values: impl IntoIterator<Item = f64>) -> Self {
        let mut sorted: Vec<f64> = values.into_iter().filter(|v| v.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let n = sorted.len();
        if n == 0 {
            return Self::default();
        }
        let rank = (0.95 * n as f64).ceil().max(1.0) as usize;
        Self {
            n,
            mean: Some(sorted.iter().sum::<f64>() / n as f64),
            p95: sorted.get(rank - 1).copied(),
            p95_upper_95: p95_upper_rank(n).and_then(|rank| sorted.get(rank - 1).copied()),
        }
    }
}

/// The rank (from 1) of the order statistic that is an upper bound on the 95th percentile; `None` below 59 values.
pub fn p95_upper_rank(n: usize) -> Option<usize> {
    // The value of rank r bounds it unless r or more values lie above it: P(Binomial(n, 0.95) < r) has to reach LEVEL,
    // and P(Binomial(n, q) <= k) = I_{1-q}(n - k, k + 1).
    let reached = |rank: &usize| beta_reg((n - rank + 1) as f64, *rank as f64, 0.05) >= LEVEL;
    (1..=n).find(reached)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_near(got: f64, expected: f64, tolerance: f64) {
        assert!((got - expected).abs() < tolerance, "got {got}, expected {expected}");
    }

    #[test]
    fn zero_failures_bound_the_rate_as_tabulated() {
        assert_near(rate_upper(0, 5, LEVEL), 0.4507, 5e-5);
        assert_near(rate_upper(0, 59, LEVEL), 0.0495, 5e-5);
        assert_near(rate_upper(0, 299, LEVEL), 0.00997, 5e-6);
        assert_near(rate_upper(0, 2995, LEVEL), 0.0010, 1e-6);
    }

    #[test]
    fn failures_bound_the_rate_as_the_binomial_says() {
        // P(X <= 3 | n = 20, p) = 0.05 at p = 0.34366.
        assert_near(rate_upper(3, 20, LEVEL), 0.34366, 1e-4);
        assert_near(rate_upper(20, 20, LEVEL), 1.0, 0.0 + f64::EPSILON);
        assert_near(rate_upper(0, 0, LEVEL), 1.0, f64::EPSILON);
    }

    #[test]
    fn a_share_lies_in_its_exact_interval() {
        // 8 of 10: (0.4439, 0.9748), as the tables of Clopper and Pearson have it.
        let share = Share::new(8, 10);
        assert_near(share.lower_95, 0.4439, 5e-5);
        assert_near(share.upper_95, 0.9748, 5e-5);
        assert_eq!((Share::new(0, 10).lower_95, Share::new(10, 10).upper_95), (0.0, 1.0));
        assert_eq!((Share::new(0, 0).share, Share::new(0, 0).lower_95, Share::new(0, 0).upper_95), (None, 0.0, 1.0));
    }

    #[test]
    fn events_bound_their_rate_as_the_poisson_says() {
        assert_near(events_upper(0, 30.0).unwrap(), 2.9957 / 30.0, 1e-5);
        assert_near(events_upper(3, 30.0).unwrap(), 7.7537 / 30.0, 1e-5);
        assert_eq!(events_upper(0, 0.0), None);
    }

    /// Garwood's table: 0 events (0, 3.689), 1 (0.0253, 5.572), 10 (4.795, 18.39).
    #[test]
    fn an_event_rate_lies_in_its_exact_interval() {
        for (events, lower, upper) in [(0, 0.0, 3.689), (1, 0.0253, 5.572), (10, 4.795, 18.39)] {
            let rate = EventRate::new(events, 2.0).unwrap();
            assert_near(rate.lower_95 * 2.0, lower, 6e-4);
            assert_near(rate.upper_95 * 2.0, upper, 6e-3);
        }
        assert_eq!(EventRate::new(1, 0.0), None);
    }

    #[test]
    fn a_bound_on_p95_takes_59_values() {
        assert_eq!(p95_upper_rank(58), None);
        assert_eq!(p95_upper_rank(59), Some(59));
        assert_eq!(p95_upper_rank(92), Some(92));
        assert_eq!(p95_upper_rank(93), Some(92));
    }

    #[test]
    fn a_sample_of_one_to_a_hundred() {
        let sample = Sample::from_values((1..=100).rev().map(f64::from));
        assert_eq!((sample.n, sample.mean, sample.p95), (100, Some(50.5), Some(95.0)));
        assert_eq!(sample.p95_upper_95, Some(99.0));
        assert_eq!(Sample::from_values([]), Sample::default());
    }

    #[test]
    fn bounds_for_many_rows_are_wider() {
        assert!(rate_upper(0, 59, simultaneous_level(12, LEVEL)) > rate_upper(0, 59, LEVEL));
        assert_near(simultaneous_level(1, LEVEL), LEVEL, 1e-12);
    }
}
