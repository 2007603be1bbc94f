//! Rate of a unit's clock against the console's, bounded by the stamps that both have seen: ages of reported values
//! rest on its staying within [`MAX_DRIFT_PPM`].
//!
//! A message with stamp σ came at r, so at r the unit's clock stood at σ or later; a challenge that left at s was seen
//! at τ, so at s it stood at τ or earlier. From two such bounds some seconds apart follow a least and a greatest mean
//! rate between them. Delays only widen that: an attacker who holds messages back makes a clock look no faster and no
//! slower than it is. Bounding ages is left to `wire::time`.

use std::collections::VecDeque;

use wire::time::{Instant, MAX_DRIFT_PPM, PeerStamp, Span};

/// Period over which the tightest bounds are kept together.
const WINDOW: Span = Span::s(5);
/// Windows kept: the rate is one over the last minute.
const WINDOWS: usize = 13;
/// Least time over which a reported rate is measured.
const LEAST: Span = Span::s(5);

/// The mean rate of a unit's clock against the console's, in millionths: 0 is as fast.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rate {
    /// Least rate by which the unit's clock runs faster.
    pub low_ppm: i32,
    /// Greatest rate by which the unit's clock runs faster.
    pub high_ppm: i32,
    /// Over how long.
    pub over: Span,
}

impl Rate {
    /// True if it is certainly beyond the drift that ages allow for.
    pub fn exceeds_drift(self) -> bool {
        let limit = MAX_DRIFT_PPM as i32;
        self.low_ppm > limit || self.high_ppm < -limit
    }

    /// Consequence for ages.
    pub fn consequence(self) -> &'static str {
        if self.exceeds_drift() { "clock RUNS AWAY" } else { "clock in step" }
    }

    /// Words with figures: the middle of the bounds, and half the distance between them.
    pub fn words(self) -> String {
        let (low, high) = (i64::from(self.low_ppm), i64::from(self.high_ppm));
        format!("clock {:+} ±{} ppm", (low + high) / 2, ((high - low) / 2).max(1))
    }
}

/// A bound of how far the unit's clock is ahead of the console's, microseconds, and when it held.
type Bound = (i128, Instant);

#[derive(Clone, Copy, Debug)]
struct Window {
    begun: Instant,
    at_least: Bound,
    at_most: Option<Bound>,
}

/// Bounds for one boot of a unit; at most [`WINDOWS`] windows.
#[derive(Clone, Debug, Default)]
pub struct Skew {
    windows: VecDeque<Window>,
}

impl Skew {
    /// A report stamped `stamp` came at `now`; in it the unit says when it saw the challenge that left at the first of
    /// `seen`.
    pub fn heard(&mut self, stamp: PeerStamp, now: Instant, seen: Option<(Instant, PeerStamp)>) {
        let ahead = |stamp: PeerStamp, time: Instant| (i128::from(stamp.0) - i128::from(time.0), time);
        let at_least = ahead(stamp, now);
        let at_most = seen.map(|(left, seen)| ahead(seen, left));
        match self.windows.back_mut().filter(|window| now.since(window.begun) < WINDOW) {
            Some(window) => {
                window.at_least = window.at_least.max(at_least);
                window.at_most = [window.at_most, at_most].into_iter().flatten().min();
            }
            None => {
                if self.windows.len() >= WINDOWS {
                    self.windows.pop_front();
                }
                self.windows.push_back(Window { begun: now, at_least, at_most });
            }
        }
    }

    /// The mean rate over the kept windows; `None` while they span too little time.
    pub fn rate(&self) -> Option<Rate> {
        let both = |window: &&Window| window.at_most.is_some();
        let first = self.windows.iter().find(both)?;
        let last = self.windows.iter().rev().find(both)?;
        let low = slope(first.at_most?, last.at_least)?;
        let high = slope(first.at_least, last.at_most?)?;
        let over = last.at_least.1.since(first.at_least.1);
        (over >= LEAST).then_some(Rate { low_ppm: low.min(high), high_ppm: low.max(high), over })
    }
}

/// Millionths by which the difference of the clocks grew from one bound to the other.
fn slope((from, bound): Bound, (to, then): Bound) -> Option<i32> {
    let excess = i128::from(then.since(bound).0);
    let ppm = to.saturating_sub(from).saturating_mul(1_000_000).checked_div(excess)?;
    Some(ppm.clamp(i128::from(i32::MIN), i128::from(i32::MAX)) as i32)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Observations of `seconds` of a unit with a clock `ppm` faster, with these delays of challenges and reports, ms.
    fn heard(ppm: i64, seconds: u64, delays: &[(u64, u64)]) -> Skew {
        let clock = |time: u64| PeerStamp((7_000_000_000 + time as i64 + time as i64 * ppm / 1_000_000) as u64);
        let mut skew = Skew::default();
        for n in 0..seconds * 10 {
            let (forth, back) = delays[n as usize % delays.len()];
            let (left, written) = (n * 100_000, n * 100_000 + 90_000);
            let seen = clock(left + forth * 1000);
            skew.heard(clock(written), Instant(written + back * 1000), Some((Instant(left), seen)));
        }
        skew
    }

    /// A clock within the bound is not.
    #[test]
    fn drift_beyond_the_ages_bound_is_detected() {
        for ppm in [-200, -30, 0, 150, 200] {
            let rate = heard(ppm, 60, &[(2, 3), (9, 1)]).rate().unwrap();
            assert!(i64::from(rate.low_ppm) <= ppm && ppm <= i64::from(rate.high_ppm), "{ppm}: {rate:?}");
            assert!(!rate.exceeds_drift() && rate.high_ppm - rate.low_ppm < 200, "{rate:?}");
        }
        for ppm in [-2_000, 500] {
            assert!(heard(ppm, 60, &[(2, 3)]).rate().unwrap().exceeds_drift(), "{ppm}");
        }
    }

    #[test]
    fn rate_needs_seconds_and_repeated_challenges() {
        assert_eq!(heard(0, 5, &[(1, 1)]).rate(), None);
        // The first window's tightest bounds are its last ones: two seconds before the bounds of the second.
        assert_eq!(heard(0, 6, &[[(50, 50); 30], [(1, 1); 30]].concat()).rate(), None);
        let mut deaf = Skew::default();
        (0..600).for_each(|n| deaf.heard(PeerStamp(n * 100_000), Instant(n * 100_000), None));
        assert_eq!(deaf.rate(), None);
    }

    #[test]
    fn kept_windows_cover_a_bounded_last_minute() {
        let skew = heard(10, 600, &[(1, 1)]);
        let period = skew.rate().unwrap().over;
        assert!(skew.windows.len() == WINDOWS && period <= Span::s(65) && period >= Span::s(55), "{period}");
    }

    #[test]
    fn impossible_stamp_does_not_panic() {
        let mut skew = Skew::default();
        for (stamp, at) in [(0, 0), (u64::MAX, 6_000_000), (0, 12_000_000), (u64::MAX, u64::MAX)] {
            skew.heard(PeerStamp(stamp), Instant(at), Some((Instant(at), PeerStamp(u64::MAX - stamp))));
            let _ = skew.rate();
        }
        assert!(skew.rate().unwrap().words().len() < 64);
    }

    proptest! {
        /// However long which messages are held back, the true rate lies between the bounds.
        #[test]
        fn delay_does_not_bias_the_clock_rate(
            ppm in -5_000_i64..5_000,
            delays in prop::collection::vec((0_u64..900, 0_u64..900), 1..40),
        ) {
            if let Some(rate) = heard(ppm, 30, &delays).rate() {
                // Rounded away from nothing: a millionth, and a microsecond in the stamps.
                prop_assert!(i64::from(rate.low_ppm) - 2 <= ppm && ppm <= i64::from(rate.high_ppm) + 2, "{rate:?}");
            }
        }
    }
}
