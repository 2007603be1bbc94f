//! The mean of a few independent estimates of one probability, each unbiased and none below zero, with an interval.
//!
//! Such estimates are products of shares, and skewed: now and then one is far above the rest. The t interval of their mean
//! reaches below zero, and misses more often than stated, above. So the interval here is a t interval around the logarithm of
//! the mean, whose standard error is that of the mean divided by the mean (delta method): a factor either way. The logarithms
//! of the single estimates would not do: their mean is not the logarithm of the estimated value, and one of them may be of
//! zero.

use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::LEVEL;

/// A mean with its interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Mean {
    /// Estimates.
    pub n: usize,
    /// Their mean.
    pub mean: f64,
    /// Its standard error.
    pub standard_error: f64,
    /// Two-sided 95 % interval; `None` where there are fewer than two estimates or all are alike.
    pub interval_95: Option<[f64; 2]>,
}

impl Mean {
    /// Mean of `values`, with its interval.
    pub fn from_values(values: &[f64]) -> Self {
        let n = values.len();
        let mean = values.iter().sum::<f64>() / n.max(1) as f64;
        let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
        let standard_error = (squares / n.saturating_sub(1).max(1) as f64 / n.max(1) as f64).sqrt();
        let t = StudentsT::new(0.0, 1.0, n as f64 - 1.0).ok().filter(|_| standard_error > 0.0);
        let interval_95 = t.map(|t| {
            let factor = libm::exp(t.inverse_cdf(0.5 * (1.0 + LEVEL)) * standard_error / mean);
            [mean / factor, (mean * factor).min(1.0)]
        });
        Self { n, mean, standard_error, interval_95 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interval_is_a_factor_by_the_t_table() {
        let mean = Mean::from_values(&[0.1, 0.2, 0.3]);
        assert!((mean.mean - 0.2).abs() < 1e-12 && (mean.standard_error - 0.1 / 3f64.sqrt()).abs() < 1e-12);
        // Student's t with 2 degrees of freedom at 97.5 %: 4.30265.
        let factor = libm::exp(4.302_65 * (1.0f64 / 3.0).sqrt() / 2.0);
        let [from, to] = mean.interval_95.unwrap();
        assert!((from - 0.2 / factor).abs() < 1e-5 && (to - 0.2 * factor).abs() < 1e-4, "{from} {to}");
        assert_eq!(Mean::from_values(&[0.2, 0.9, 1.0]).interval_95.unwrap()[1], 1.0, "a probability");
    }

    /// Never seen, always seen, or seen once.
    #[test]
    fn degenerate_shares_have_no_interval() {
        assert_eq!(Mean::from_values(&[1.0, 1.0, 1.0]).interval_95, None);
        assert_eq!(Mean::from_values(&[0.0, 0.0]).interval_95, None);
        assert_eq!(Mean::from_values(&[0.5]).interval_95, None);
        assert_eq!(Mean::from_values(&[]).interval_95, None);
    }
}
