//! Pairs of trials that differ in one condition: exact McNemar test and interval, adjusted for the number of
//! comparisons (Holm).

use serde::{Deserialize, Serialize};
use statrs::function::beta::beta_reg;

use super::{LEVEL, rate_lower, rate_upper};

/// A difference between two rates, over pairs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Paired {
    /// Pairs.
    pub n: u64,
    /// Pairs in which only the second happened.
    pub more: u64,
    /// Pairs in which only the first did.
    pub less: u64,
    /// Rate of the second condition minus that of the first.
    pub difference: f64,
    /// Two-sided interval of it that holds with at least 95 %: exact bounds on the rates of either kind of pair that differs,
    /// each side of each at 1.25 % (Bonferroni), and the differences of those.
    pub interval_95: [f64; 2],
    /// Probability of at least `more` pairs in favour of the second, if both rates were equal (exact, one-sided).
    pub p: f64,
    /// p-value adjusted for all comparisons together (Holm).
    pub p_holm: f64,
}

impl Paired {
    /// Comparison of `more` and `less` among `n` pairs; not yet adjusted.
    pub fn from_counts(n: u64, more: u64, less: u64) -> Self {
        let each_side = 1.0 - (1.0 - LEVEL) / 4.0;
        let bounds = |count| (rate_lower(count, n, each_side), rate_upper(count, n, each_side));
        let ((more_from, more_to), (less_from, less_to)) = (bounds(more), bounds(less));
        let interval_95 = [more_from - less_to, more_to - less_from];
        // P(Binomial(odd, 1/2) >= more) = I_{1/2}(more, odd - more + 1).
        let p = if more == 0 { 1.0 } else { beta_reg(more as f64, less as f64 + 1.0, 0.5) };
        let difference = (more as f64 - less as f64) / n.max(1) as f64;
        Self { n, more, less, difference, interval_95, p, p_holm: p }
    }
}

/// Adjusts each p for all of `pairs` together (Holm, 1979).
pub fn holm(pairs: &mut [&mut Paired]) {
    let m = pairs.len();
    pairs.sort_by(|a, b| a.p.total_cmp(&b.p));
    let mut least: f64 = 0.0;
    for (i, pair) in pairs.iter_mut().enumerate() {
        // The running maximum keeps the adjusted values in the order of the raw ones.
        least = least.max((pair.p * (m - i) as f64).min(1.0));
        pair.p_holm = least;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_near(got: f64, expected: f64) {
        assert!((got - expected).abs() < 1e-4, "got {got}, expected {expected}");
    }

    #[test]
    fn one_sided_pairs_equal_all_heads() {
        let paired = Paired::from_counts(20, 20, 0);
        assert_near(paired.p * f64::from(1 << 20), 1.0);
        assert_near(paired.difference, 1.0);
        // Bounds of 20 of 20 at 1.25 % from 0.0125^(1/20), of 0 of 20 up to what is left.
        assert_near(paired.interval_95[0], 2.0 * 0.803_23 - 1.0);
        assert_near(paired.interval_95[1], 1.0);
    }

    #[test]
    fn one_more_favourable_pair_moves_the_interval() {
        for less in 0..4 {
            let all: Vec<[f64; 2]> =
                (0..=20 - less).map(|more| Paired::from_counts(20, more, less).interval_95).collect();
            assert!(all.is_sorted_by(|a, b| a[0] <= b[0] && a[1] <= b[1]), "{all:?}");
        }
    }

    /// Sums the probability of every table of 20 pairs whose interval covers the true difference.
    #[test]
    fn interval_covers_the_true_difference_as_stated() {
        let choose = |n: u64, k: u64| (0..k).fold(1.0, |c, i| c * (n - i) as f64 / (i + 1) as f64);
        for (more, less) in [(0.3, 0.0), (0.05, 0.0), (0.5, 0.2), (0.02, 0.02)] {
            let mut covered = 0.0;
            for (a, b) in (0..=20_u64).flat_map(|a| (0..=20 - a).map(move |b| (a, b))) {
                let same = 20 - a - b;
                let ways = choose(20, a) * choose(20 - a, b);
                let chance = ways
                    * f64::powi(more, a as i32)
                    * f64::powi(less, b as i32)
                    * f64::powi(1.0 - more - less, same as i32);
                let [from, to] = Paired::from_counts(20, a, b).interval_95;
                covered += if (from..=to).contains(&(more - less)) { chance } else { 0.0 };
            }
            assert!(covered >= 0.95, "{covered} at {more} and {less}");
        }
    }

    #[test]
    fn equal_pairs_bound_the_number_of_differences() {
        let paired = Paired::from_counts(20, 0, 0);
        assert_near(paired.p, 1.0);
        assert_near(paired.interval_95[1], 0.1968);
        assert_near(paired.interval_95[0], -0.1968);
    }

    #[test]
    fn holm_adjusts_the_smallest_most_in_order() {
        let mut all = [Paired::from_counts(10, 10, 0), Paired::from_counts(10, 0, 0), Paired::from_counts(10, 6, 0)];
        let raw = all.map(|pair| pair.p);
        holm(&mut all.iter_mut().collect::<Vec<_>>());
        assert_near(all[0].p_holm, raw[0] * 3.0);
        assert_near(all[2].p_holm, raw[2] * 2.0);
        assert_near(all[1].p_holm, 1.0);
    }
}
