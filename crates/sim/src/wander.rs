//! A place that wanders about the true one, as a receiver's does between houses: a Gauss-Markov process on each axis.
//!
//! *x* ← *x* · e^(−Δ/τ) + σ · √(1 − e^(−2Δ/τ)) · *n*, from nought on, with τ = 60 s and a step for each navigation
//! reading. The whole way is drawn before the run, so that a reading depends on its time alone, and a fork needs no
//! state. Reseeding a sim leaves the way as it is.

use wire::time::Span;

use crate::NAVIGATION_PERIOD;
use crate::noise::{Noise, Stream};

/// Time after which a bias is forgotten but for 1/e, seconds: that of PX4's simulated receiver.
const TAU_S: f64 = 60.0;
/// Most steps of a way, one hour: a longer fault stays at the last place.
const MOST: u64 = 72_000;
/// Places in the stream of noise for one way: at most [`MOST`] steps of twelve words, of 2^20 words a place.
const PLACES: u64 = 2;

/// The way, east and north, millimetres.
#[derive(Clone, Debug, Default)]
pub(crate) struct Way(Vec<[i32; 2]>);

impl Way {
    /// Way of the fault `index` for `duration_ms`, with this deviation after a long time.
    pub(crate) fn new(seed: u64, index: usize, deviation_mm: u32, duration_ms: u64) -> Self {
        let mut noise = Noise::new(seed, Stream::Wander);
        noise.seek(index as u64 * PLACES);
        let step_s = NAVIGATION_PERIOD.0 as f64 / 1e6;
        let share = libm::exp(-step_s / TAU_S);
        let added = f64::from(deviation_mm) * libm::sqrt(1.0 - share * share);
        let steps = (duration_ms * 1000 / NAVIGATION_PERIOD.0).min(MOST);
        let mut place = [0.0; 2];
        let way = (0..=steps).map(|_| {
            let here = place.map(|mm: f64| mm as i32);
            place = place.map(|mm| mm * share + added * f64::from(noise.normal()));
            here
        });
        Way(way.collect())
    }

    /// Displacement so long after the start of the fault, millimetres.
    pub(crate) fn displacement(&self, since: Span) -> [i32; 2] {
        let step = (since.0 / NAVIGATION_PERIOD.0) as usize;
        self.0.get(step).or(self.0.last()).copied().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn way_starts_at_nought_and_repeats_for_a_seed() {
        let way = |seed, index| Way::new(seed, index, 6_000, 40_000);
        let displacement = |way: &Way, ms| way.displacement(Span::ms(ms));
        let (one, same) = (way(1, 0), way(1, 0));
        assert_eq!(displacement(&one, 0), [0, 0]);
        assert_eq!(
            [10_000, 39_999, 90_000].map(|ms| displacement(&one, ms)),
            [10_000, 39_999, 90_000].map(|ms| displacement(&same, ms))
        );
        assert_ne!(displacement(&one, 10_000), displacement(&way(2, 0), 10_000));
        assert_ne!(displacement(&one, 10_000), displacement(&way(1, 1), 10_000));
        assert_eq!(displacement(&Way::default(), 10), [0, 0]);
    }

    /// After some minutes the mean square over many seeds is the stated one; of neighbouring steps the difference is
    /// small.
    #[test]
    fn deviation_and_memory_are_those_stated() {
        let ways: Vec<Way> = (0..200).map(|seed| Way::new(seed, 0, 1_000, 300_000)).collect();
        let square = |ms: u64| {
            let all =
                ways.iter().flat_map(|way| way.displacement(Span::ms(ms))).map(|mm| f64::from(mm) * f64::from(mm));
            libm::sqrt(all.sum::<f64>() / (2.0 * ways.len() as f64))
        };
        assert!((850.0..1_150.0).contains(&square(300_000)), "{}", square(300_000));
        // 1 − e^(−2) of the variance after one time constant.
        assert!((790.0..1_070.0).contains(&square(60_000)), "{}", square(60_000));
        assert!(square(1_000) < 250.0, "{}", square(1_000));
    }
}
