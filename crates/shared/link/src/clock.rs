//! The host's clock, as a core sees it, and the trace clock, as the oracle sees it.
//!
//! Each simulated host has its own zero and drift over the machine's `CLOCK_MONOTONIC`. Processes of one host get
//! the same two numbers and so agree. The raw reading stamps traces; no core ever gets it.

use std::time::{Duration, SystemTime};

use nix::time::{ClockId, clock_gettime};
use serde::{Deserialize, Serialize};
use wire::time::Instant;

/// Millionths in one.
const MILLION: i128 = 1_000_000;

/// The largest drift a host may be given, in parts per million.
pub const DRIFT_LIMIT_PPM: i32 = 1_000;

/// A host's monotonic clock: `zero_us + raw · (1 + drift_ppm / 10⁶)`, in microseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HostClock {
    /// Reading of this clock, in microseconds, when the machine's monotonic clock read zero.
    pub zero_us: u64,
    /// Drift against the machine's clock, in parts per million faster (clamped to [`DRIFT_LIMIT_PPM`]).
    pub drift_ppm: i32,
}

impl HostClock {
    /// The host's time now. Never goes backwards.
    pub fn now(&self) -> Instant {
        self.at_trace(trace_us())
    }

    /// The host's time at a raw reading.
    pub fn at_trace(&self, raw_us: u64) -> Instant {
        let raw = i128::from(raw_us);
        let elapsed = raw + (raw * self.drift()).div_euclid(MILLION);
        Instant(saturate(i128::from(self.zero_us) + elapsed))
    }

    /// The first raw reading at which the host's clock reads `time` or later.
    pub fn trace_at(&self, time: Instant) -> u64 {
        let elapsed = i128::from(time.0) - i128::from(self.zero_us);
        if elapsed <= 0 {
            return 0;
        }
        // div_ceil on the inverse, then one more microsecond for the rounding of the forward direction.
        let raw = (elapsed * MILLION).div_euclid(MILLION + self.drift());
        let raw = saturate(raw);
        (raw..=raw.saturating_add(2)).find(|r| self.at_trace(*r) >= time).unwrap_or(raw.saturating_add(2))
    }

    /// Time until the host's clock reads `deadline`; zero if it already does.
    pub fn time_to(&self, deadline: Instant) -> Duration {
        Duration::from_micros(self.trace_at(deadline).saturating_sub(trace_us()))
    }

    fn drift(&self) -> i128 {
        i128::from(self.drift_ppm.clamp(-DRIFT_LIMIT_PPM, DRIFT_LIMIT_PPM))
    }
}

/// The machine's `CLOCK_MONOTONIC` in microseconds: common to all processes, for traces only.
pub fn trace_us() -> u64 {
    micros(ClockId::CLOCK_MONOTONIC)
}

/// CPU time of the calling thread in microseconds, for measuring the cost of work. `getrusage` moves in steps of the
/// scheduler's tick, some milliseconds.
pub fn thread_cpu_us() -> u64 {
    micros(ClockId::CLOCK_THREAD_CPUTIME_ID)
}

fn micros(clock: ClockId) -> u64 {
    let now = clock_gettime(clock).expect("invariant: Linux has its monotonic and its CPU clocks");
    saturate(i128::from(now.tv_sec()) * MILLION + i128::from(now.tv_nsec()) / 1_000)
}

/// The wall clock, microseconds since 1970, for a viewer outside of the run.
pub fn wall_us() -> u64 {
    wall().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_micros() as u64)
}

/// The wall clock, for the validity of certificates and for viewers outside of the run.
#[expect(clippy::disallowed_methods, reason = "certificates are dated; no core is handed this")]
pub fn wall() -> SystemTime {
    SystemTime::now()
}

/// Pauses a helper thread, or the janitor of a run, between attempts at something outside the process. No core waits for it.
#[expect(clippy::disallowed_methods, reason = "the pause between two attempts, on a thread that owns no core")]
pub fn pause(time: Duration) {
    std::thread::sleep(time);
}

/// Lateness of each of `naps` sleeps of this length, microseconds: the delay that the host's scheduler adds.
#[expect(clippy::disallowed_methods, reason = "how late a sleeper wakes is what is measured")]
pub fn oversleeps(nap: Duration, naps: usize) -> Vec<u64> {
    let late = || {
        let before = trace_us();
        std::thread::sleep(nap);
        trace_us().saturating_sub(before).saturating_sub(nap.as_micros() as u64)
    };
    (0..naps).map(|_| late()).collect()
}

fn saturate(value: i128) -> u64 {
    u64::try_from(value.max(0)).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deadlines_map_back_without_being_late() {
        for drift_ppm in [-200, -37, 0, 1, 199, 1_000_000] {
            let clock = HostClock { zero_us: 5_000_000_000, drift_ppm };
            for raw in [0, 1, 999_999, 86_400_000_000, 8_640_000_000_001] {
                let time = clock.at_trace(raw);
                let back = clock.trace_at(time);
                assert!(clock.at_trace(back) >= time, "{drift_ppm} {raw}");
                assert!(back <= raw + 1, "{drift_ppm} {raw} {back}");
            }
        }
    }

    /// Processes of one host agree on the time; hosts do not.
    #[test]
    fn clocks_agree_within_a_host_only() {
        let host = HostClock { zero_us: 7, drift_ppm: 20 };
        let other_host = HostClock { zero_us: 90_000_000, drift_ppm: -20 };
        let raw = trace_us();
        assert_eq!(host.at_trace(raw), HostClock { zero_us: 7, drift_ppm: 20 }.at_trace(raw));
        assert_ne!(host.at_trace(raw), other_host.at_trace(raw));
    }
}
