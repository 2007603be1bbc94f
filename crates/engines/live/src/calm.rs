//! A quieter moment of the host, awaited within a bound: a host that wakes sleepers late makes a live run INVALID.

use std::time::Duration;

use link::clock::{oversleeps, trace_us};
use parallel::progress::Stop;

/// Length of one sleep of a probe: the longest nap of the launcher during a run.
const NAP: Duration = Duration::from_millis(10);
/// Sleeps of a probe, half a second together.
const NAPS: usize = 50;

/// Probes the host until no sleep of a probe is late by half of [`super::OVERSLEPT_US`], and ends at the latest with the probe that uses
/// up `patience`; the time taken is subtracted from that.
pub fn await_quiet(patience: &mut Duration, stop: &Stop) {
    while !patience.is_zero() && !stop.is_requested() {
        let before = trace_us();
        let latest = oversleeps(NAP, NAPS).into_iter().max().unwrap_or_default();
        *patience = patience.saturating_sub(Duration::from_micros(trace_us().saturating_sub(before)));
        if latest < super::OVERSLEPT_US / 2 {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waiting_ends_with_patience_or_request() {
        let mut patience = Duration::from_nanos(1);
        await_quiet(&mut patience, &Stop::default());
        assert!(patience.is_zero());
        let (mut patience, stop) = (Duration::from_secs(10), Stop::default());
        stop.ask();
        await_quiet(&mut patience, &stop);
        assert_eq!(patience, Duration::from_secs(10));
    }
}
