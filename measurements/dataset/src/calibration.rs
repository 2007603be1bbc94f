//! Calibration of scores: of the detections scored `s`, a share of `s` should be right.
//!
//! Expected calibration error over ten bins of equal width, weighted by the detections in each (Naeini et al. 2015; of
//! detections: Küppers et al. 2020). It is of detections that the platform would use, so those below its threshold do not
//! count.

use serde::Serialize;

use crate::precision::{Judged, Outcome};

const BINS: usize = 10;

/// One bin of scores.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Bin {
    /// Detections.
    pub given: u32,
    /// Mean score, 0 to 1.
    pub score: f64,
    /// Share that was right.
    pub right: f64,
}

/// The bins that anything fell into, for detections of at least `least` permille.
pub fn bins(outcomes: &[Outcome], least: u16) -> Vec<Bin> {
    let mut bins = [Bin::default(); BINS];
    let judged = outcomes.iter().flat_map(|o| &o.judged).filter(|j| j.score >= least);
    for Judged { score, right, .. } in judged {
        let bin = &mut bins[(usize::from(*score) * BINS / 1000).min(BINS - 1)];
        bin.given += 1;
        bin.score += f64::from(*score) / 1000.0;
        bin.right += f64::from(u8::from(*right));
    }
    let share = |b: Bin| Bin { score: b.score / f64::from(b.given), right: b.right / f64::from(b.given), ..b };
    bins.into_iter().filter(|b| b.given > 0).map(share).collect()
}

/// Expected calibration error of the bins.
pub fn error(bins: &[Bin]) -> f64 {
    let given: u32 = bins.iter().map(|b| b.given).sum();
    let distance: f64 = bins.iter().map(|b| f64::from(b.given) * (b.score - b.right).abs()).sum();
    distance / f64::from(given.max(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use wire::sensor::Class;

    fn outcome(score: u16, right: usize, of: usize) -> Outcome {
        let judged = (0..of).map(|k| Judged { class: Class::Person, score, right: k < right }).collect();
        Outcome { objects: [0; 4], judged }
    }

    #[test]
    fn calibration_error_is_the_difference_to_hits() {
        assert!(error(&bins(&[outcome(800, 8, 10), outcome(600, 6, 10)], 500)) < 1e-9);
        assert!((error(&bins(&[outcome(800, 5, 10)], 500)) - 0.3).abs() < 1e-9);
        assert!(bins(&[outcome(300, 1, 10)], 500).is_empty());
    }
}
