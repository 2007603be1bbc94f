//! Pairs of trials that differ in one thing: exact McNemar test and interval, adjusted for how many are looked at (Holm).

use serde::Serialize;
use statrs::function::beta::beta_reg;

use super::{LEVEL, rate_lower, rate_upper};

/// A difference between two rates, over pairs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Paired {
    /// Pairs.
    pub n: u64,
    /// Pairs in which only the second happened.
    pub more: u64,
    /// Pairs in which only the first did.
    pub less: u64,
    /// The rate of the second less that of the first.
    pub difference: f64,
    /// Exact two-sided 95 % interval of it, given how many pairs differ; without any that do, the exact bound on how many
    /// might.
    pub interval_95: [f64; 2],
    /// Probability of at least so many in favour of the second, were both the same (exact, one-sided).
    pub p: f64,
    /// The same adjusted by Holm for all that were looked at together.
    pub p_holm: f64,
}

impl Paired {
    /// Of `more` and `less` among `n` pairs; not yet adjusted.
    pub fn of(n: u64, more: u64, less: u64) -> Self {
        let (odd, each_side) = (more + less, 0.5 * (1.0 + LEVEL));
        let share = |rate: f64| (2.0 * rate - 1.0) * odd as f64 / n.max(1) as f64;
        let might = rate_upper(0, n, each_side);
        let interval_95 = match odd {
            0 => [-might, might],
            _ => [share(rate_lower(more, odd, each_side)), share(rate_upper(more, odd, each_side))],
        };
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
        least = least.max((pair.p * (m - i) as f64).min(1.0));
        pair.p_holm = least;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(got: f64, expected: f64) {
        assert!((got - expected).abs() < 1e-4, "got {got}, expected {expected}");
    }

    #[test]
    fn all_pairs_one_way_are_as_likely_as_all_heads() {
        let paired = Paired::of(20, 20, 0);
        near(paired.p * f64::from(1 << 20), 1.0);
        near(paired.difference, 1.0);
        // Clopper-Pearson for 20 of 20: from 0.8316.
        near(paired.interval_95[0], 2.0 * 0.831_57 - 1.0);
        near(paired.interval_95[1], 1.0);
    }

    #[test]
    fn pairs_that_do_not_differ_bound_how_many_might() {
        let paired = Paired::of(20, 0, 0);
        near(paired.p, 1.0);
        near(paired.interval_95[1], 0.1684);
        near(paired.interval_95[0], -0.1684);
    }

    #[test]
    fn holm_adjusts_the_smallest_most_and_keeps_the_order() {
        let mut all = [Paired::of(10, 10, 0), Paired::of(10, 0, 0), Paired::of(10, 6, 0)];
        let raw = all.map(|pair| pair.p);
        holm(&mut all.iter_mut().collect::<Vec<_>>());
        near(all[0].p_holm, raw[0] * 3.0);
        near(all[2].p_holm, raw[2] * 2.0);
        near(all[1].p_holm, 1.0);
    }
}
