//! A host's clock in the twin: true time with an arbitrary zero and a small drift.

use topology::ClockDraw;
use wire::time::Instant;

use super::queue::Micros;

/// Maps true time to one host's monotonic clock and back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HostClock {
    /// Reading at true time zero, microseconds.
    pub zero: u64,
    /// Drift in parts per million, positive when fast.
    pub drift_ppm: i64,
}

impl From<ClockDraw> for HostClock {
    fn from(ClockDraw { zero_us: zero, drift_ppm }: ClockDraw) -> Self {
        HostClock { zero, drift_ppm }
    }
}

impl HostClock {
    /// The clock's reading at true time `t`.
    pub fn read(self, t: Micros) -> Instant {
        Instant(self.zero.saturating_add_signed(t as i64 + t as i64 * self.drift_ppm / 1_000_000))
    }

    /// The first true time at which the clock reads at least `local`.
    pub fn true_time(self, local: Instant) -> Micros {
        let elapsed = local.0.saturating_sub(self.zero) as i128;
        let mut t = (elapsed * 1_000_000 / (1_000_000 + i128::from(self.drift_ppm))) as u64;
        t = t.saturating_sub(1);
        while self.read(t) < local {
            t += 1;
        }
        t
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deadline_is_never_early_or_tick_late() {
        for drift_ppm in [-80, 0, 37, 200] {
            let clock = HostClock { zero: 123_456_789, drift_ppm };
            for t in (0..40_000_000).step_by(999_983) {
                let local = clock.read(t);
                let back = clock.true_time(local);
                assert!(clock.read(back) >= local && back <= t, "{drift_ppm} {t} {back}");
                assert!(back == 0 || clock.read(back - 1) < local);
            }
        }
    }
}
