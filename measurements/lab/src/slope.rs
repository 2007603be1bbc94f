//! The slope of a line through samples, with its interval: growth over time.

use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};
use stats::LEVEL;

/// Least-squares slope, with a two-sided 95 % interval that takes the distances from the line as independent and normal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Slope {
    /// Samples.
    pub n: usize,
    /// Change for each unit of the first coordinate.
    pub each: f64,
    /// Ends of the interval.
    pub interval: [f64; 2],
}

impl Slope {
    /// Slope of points; none of fewer than three, or where all have the same first coordinate.
    pub fn from_points(points: &[(f64, f64)]) -> Option<Self> {
        let n = points.len();
        let mean = |get: fn(&(f64, f64)) -> f64| points.iter().map(get).sum::<f64>() / n as f64;
        let (x, y) = (mean(|(x, _)| *x), mean(|(_, y)| *y));
        let spread: f64 = points.iter().map(|(at, _)| (at - x) * (at - x)).sum();
        if n < 3 || spread <= 0.0 || !spread.is_finite() {
            return None;
        }
        let each = points.iter().map(|(at, value)| (at - x) * (value - y)).sum::<f64>() / spread;
        let off = |(place, value): &(f64, f64)| value - y - each * (place - x);
        let variance = points.iter().map(|point| off(point) * off(point)).sum::<f64>() / (n as f64 - 2.0);
        let t = StudentsT::new(0.0, 1.0, n as f64 - 2.0).ok()?.inverse_cdf(0.5 + LEVEL / 2.0);
        let half = t * libm::sqrt(variance / spread);
        Some(Self { n, each, interval: [each - half, each + half] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slope_of_a_line_is_exact() {
        let line: Vec<(f64, f64)> = (0..10).map(|n| (f64::from(n), 3.0 + 2.0 * f64::from(n))).collect();
        let slope = Slope::from_points(&line).unwrap();
        assert!((slope.each - 2.0).abs() < 1e-9 && (slope.interval[1] - slope.interval[0]) < 1e-6, "{slope:?}");
        assert_eq!(Slope::from_points(&line[..2]), None);
        assert_eq!(Slope::from_points(&[(1.0, 1.0), (1.0, 2.0), (1.0, 3.0)]), None);
    }

    /// Computed by hand: slope 0.8, and t of 3 degrees at 97.5 % is 3.18245.
    #[test]
    fn interval_is_by_the_t_table() {
        let slope = Slope::from_points(&[(0.0, 1.0), (1.0, 3.0), (2.0, 2.0), (3.0, 5.0), (4.0, 4.0)]).unwrap();
        let [low, high] = slope.interval;
        assert!(
            (slope.each - 0.8).abs() < 1e-9 && (low + 0.30243).abs() < 1e-3 && (high - 1.90243).abs() < 1e-3,
            "{slope:?}"
        );
    }
}
