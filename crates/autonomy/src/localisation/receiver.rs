//! The receiver's time against this host's clock.
//!
//! No decision rests on the receiver's time; freshness, leases and ages are of the local monotonic clock. It is watched
//! because a receiver works out place and time from the same signals: one whose time steps, runs away or runs back is
//! being steered or is broken, and its place is worth no more than its time. The offset between the two clocks is
//! followed no faster than any two clocks may drift apart, so that a false time cannot make itself true by staying.

use wire::measured::OFFSET_US;
use wire::sensor::ReceiverTime;
use wire::time::{Instant, MAX_DRIFT_PPM};

/// Difference between followed and seen offset at which the two disagree, microseconds.
const LIMIT_US: u64 = OFFSET_US as u64;
/// A disagreement ends within this part of the limit.
const RETURN_US: u64 = LIMIT_US / 2;

/// The offset between the receiver's time and this host's clock, as far as it is believed.
#[derive(Clone, Debug, Default)]
pub(super) struct Receiver {
    /// Offset and the stamp at which it was last followed.
    followed: Option<(i64, Instant)>,
    /// Difference of the newest value.
    off: Option<i64>,
    disagrees: bool,
}

impl Receiver {
    /// Takes the time of a fix of this stamp.
    pub(super) fn take(&mut self, stamp: Instant, time: ReceiverTime) {
        let seen = (time.0 as i64).wrapping_sub(stamp.0 as i64);
        let Some((offset, moment)) = self.followed else {
            self.followed = Some((seen, stamp));
            return;
        };
        let off = seen.saturating_sub(offset);
        self.off = Some(off);
        let limit = if self.disagrees { RETURN_US } else { LIMIT_US };
        self.disagrees = off.unsigned_abs() > limit;
        if !self.disagrees {
            // A microsecond more, so that a drift within the bound is followed in spite of rounding.
            let reach = (stamp.since(moment).0 * MAX_DRIFT_PPM / 1_000_000 + 1) as i64;
            self.followed = Some((offset + off.clamp(-reach, reach), stamp));
        }
    }

    /// Difference of the newest time of the receiver from the expected one, microseconds; none before the second.
    pub(super) fn time_error(&self) -> Option<i32> {
        self.off.map(|off| off.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32)
    }

    /// True if the two disagree.
    pub(super) fn disagrees(&self) -> bool {
        self.disagrees
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wire::time::Span;

    /// Readings 20 a second for `seconds`, the receiver's time displaced by `us(seconds)`; when the first disagrees.
    fn first_disagreement(seconds: u64, us: impl Fn(f64) -> f64) -> Option<f64> {
        let mut receiver = Receiver::default();
        (0..seconds * 20).find_map(|i| {
            let t = i as f64 / 20.0;
            let stamp = Instant(7_000_000) + Span(i * 50_000);
            receiver.take(stamp, ReceiverTime((1.4e15 + t * 1e6 + us(t)) as u64));
            receiver.disagrees().then_some(t)
        })
    }

    /// The drift that two crystals may have is followed for an hour.
    #[test]
    fn crystal_drift_is_followed_faster_drift_is_not() {
        for ppm in [-200.0, 0.0, 200.0] {
            assert_eq!(first_disagreement(3600, |t| t * ppm), None, "{ppm}");
        }
        for (ppm, within) in [(1000.0, 6.5), (-1000.0, 6.5), (10_000.0, 0.6)] {
            let seconds = first_disagreement(60, |t| t * ppm);
            assert!(seconds.is_some_and(|seconds| seconds <= within), "{ppm}: {seconds:?}");
        }
    }

    #[test]
    fn step_or_rollback_disagrees_and_never_heals_itself() {
        for step in [10_000.0, -10_000.0, 3.6e9, -3.6e9] {
            let stepped = |t: f64| if t < 2.0 { 0.0 } else { step };
            assert_eq!(first_disagreement(10, stepped), Some(2.0), "{step}");
        }
        let mut receiver = Receiver::default();
        for i in 0..20_000_u64 {
            let step = if i < 20 { 0 } else { 20_000 };
            receiver.take(Instant(i * 50_000), ReceiverTime(1_000_000_000 + i * 50_000 + step));
        }
        assert!(receiver.disagrees(), "still, a quarter of an hour later");
        receiver.take(Instant(1_000_050_000), ReceiverTime(2_000_050_000));
        assert!(!receiver.disagrees(), "its own time is taken again");
    }
}
