//! Comparison of the time in an entry with the time of its handover, by the anchor of its writer's clock.
//!
//! The choice of entries is left to the verifier.

use evidence::anchors::{ClockAnchor, ProcessStop};
use ground_truth::Entry;
use wire::id::NodeId;

/// Time after the start within which the setup of a service may end, microseconds.
const SETUP_WITHIN_US: i128 = 2_000_000;
/// Difference by which an entry may seem to be written after its handover, microseconds: the rounding of two clocks.
const ROUNDING_US: i128 = 2;

/// Fit of the time in an entry to the time of its handover.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ClockFit {
    /// The times fit.
    Fits,
    /// The handover came too late after the writing; microseconds.
    Late {
        /// Delay, without the launcher's stops.
        delay: u64,
        /// Time for which the launcher stopped the process in between.
        stopped: u64,
        /// Delay allowed.
        allowed: u64,
    },
    /// The handover came this many microseconds before the writing.
    Early(u64),
}

/// Fit of an entry of `clock` to its handover at `handed_over` of the recording's clock, in a run that begins at `start`; microseconds.
/// The process's stops by the launcher's record do not count as delay.
///
/// Entries that a service writes during its setup have the start as their time, whenever its process starts: the bound of the clock
/// applies to its later entries only. In the twin the start is zero, and every setup is over by then.
pub(super) fn clock_fit(
    clock: &ClockAnchor,
    entry: &Entry,
    handed_over: u64,
    start: u64,
    stops: &[ProcessStop],
) -> ClockFit {
    let in_setup = start > 0 && (reading(clock, start) - i128::from(entry.at.0)).abs() <= ROUNDING_US;
    // A service that is ready before the start stamps its entries with a start that is still to come.
    let early = i128::from(entry.at.0) - reading(clock, handed_over.max(start));
    if early > ROUNDING_US {
        return ClockFit::Early(clamped(early));
    }
    let allowed = if in_setup { SETUP_WITHIN_US } else { i128::from(clock.late_us) };
    let passed = reading(clock, handed_over) - i128::from(entry.at.0);
    let (from, until) = (i128::from(handed_over) - passed, i128::from(handed_over));
    let own_stops = stops.iter().filter(|stop| stop.node == entry.node);
    let stopped: i128 = own_stops.map(|stop| covered(stop, from, until)).sum();
    let delay = passed - stopped;
    if delay <= allowed + ROUNDING_US {
        return ClockFit::Fits;
    }
    ClockFit::Late { delay: clamped(delay), stopped: clamped(stopped), allowed: clamped(allowed) }
}

/// Reading of `clock` at `time` of the recording's clock.
fn reading(clock: &ClockAnchor, time: u64) -> i128 {
    let time = i128::from(time);
    i128::from(clock.zero_us) + time + (time * i128::from(clock.drift_ppm)).div_euclid(1_000_000)
}

/// Part of the time from `from` to `until` that `stop` covers, microseconds.
fn covered(stop: &ProcessStop, from: i128, until: i128) -> i128 {
    (until.min(i128::from(stop.until_us)) - from.max(i128::from(stop.from_us))).max(0)
}

/// Description of an entry with a late handover. In the recording of a live run a host that stalled, a process that was stopped and a
/// time that was changed look the same. The twin has no host that could be late.
pub(super) fn lateness(node: NodeId, delay: u64, stopped: u64, allowed: u64, in_twin: bool) -> String {
    let stopped = if stopped > 0 {
        format!(" beside the {} for which the launcher stopped it", milliseconds(stopped))
    } else {
        String::new()
    };
    let why = if in_twin {
        "the time does not fit a run of the twin, where nothing is late; the recording was changed"
    } else {
        "the host or another process kept this one from running, or one of the two times was changed, which cannot be \
         told apart here; end other work or use --jobs 1, and run it again"
    };
    let [delay, allowed] = [delay, allowed].map(milliseconds);
    format!("{node} handed this over {delay} after it wrote it{stopped}, at most {allowed} are allowed: {why}")
}

/// A duration in microseconds, as text.
pub(super) fn milliseconds(us: u64) -> String {
    format!("{:.1} ms", us as f64 / 1000.0)
}

fn clamped(us: i128) -> u64 {
    u64::try_from(us.max(0)).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ground_truth::Any;
    use wire::event::Event;
    use wire::id::Boot;
    use wire::time::Instant;

    const START: u64 = 5_000_000;

    fn fit(written: u64, handed_over: u64, stops: &[ProcessStop]) -> ClockFit {
        let clock = ClockAnchor { zero_us: 1_000_000, drift_ppm: 0, late_us: 100_000 };

        let entry = Entry {
            node: NodeId::SIM,
            boot: Boot(1),
            counter: 1,
            at: Instant(1_000_000 + written),
            event: Any::Service(Event::Started),
            previous: [0; 32],
        };
        clock_fit(&clock, &entry, handed_over, START, stops)
    }

    fn allowed(written: u64, handed_over: u64) -> bool {
        fit(written, handed_over, &[]) == ClockFit::Fits
    }

    #[test]
    fn only_entries_stamped_with_start_may_be_late() {
        assert!(allowed(START, START + 110_000) && allowed(START, START - 500_000), "made late, or ready before");
        assert!(!allowed(START, START + 3_000_000));
        assert!(allowed(START + 10, START + 90_000) && !allowed(START + 10, START + 110_000));
        assert!(!allowed(START + 10_000, START + 9_000), "before it was written");
    }

    #[test]
    fn twin_has_no_late_host() {
        let [twin, live] = [true, false].map(|in_twin| lateness(NodeId::GATEWAY, 24_000_000, 0, 1_000, in_twin));
        assert!(
            twin.contains("the recording was changed") && !twin.contains("host") && !twin.contains("--jobs"),
            "{twin}"
        );
        assert!(live.contains("the host or another process") && live.contains("--jobs 1"), "{live}");
    }

    #[test]
    fn launchers_stop_explains_its_length_of_lateness() {
        let (from_us, until_us) = (START + 1_000_000, START + 1_800_000);
        let stop = ProcessStop { node: NodeId::SIM, from_us, until_us };
        let written = from_us - 10_000;
        assert_eq!(fit(written, until_us + 5_000, &[stop]), ClockFit::Fits);
        let late = ClockFit::Late { delay: 110_000, stopped: 800_000, allowed: 100_000 };
        assert_eq!(fit(written, until_us + 100_000, &[stop]), late);
        let other = ProcessStop { node: NodeId::GATEWAY, ..stop };
        assert!(
            matches!(fit(written, until_us + 5_000, &[other]), ClockFit::Late { stopped: 0, .. }),
            "of another process"
        );
        assert!(
            matches!(fit(until_us + 1, until_us + 200_000, &[stop]), ClockFit::Late { stopped: 0, .. }),
            "after it"
        );
        assert_eq!(fit(written, written - 5_000, &[stop]), ClockFit::Early(5_000), "no stop explains that");
    }
}
