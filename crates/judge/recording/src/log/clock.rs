//! The time in an entry against the time under which it was handed over, by the anchor of its writer's clock.
//!
//! The entries that are held against it are left to the verifier.

use evidence::anchors::{ClockAnchor, ProcessStop};
use ground_truth::Entry;
use wire::id::NodeId;

/// Time after the start within which a service may still come to be, microseconds.
const MADE_WITHIN_US: i128 = 2_000_000;
/// By how much an entry may seem to have been written after it was handed over, microseconds: the rounding of two clocks.
const ROUNDING_US: i128 = 2;

/// Fit of the time in an entry to the time under which it was handed over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ClockFit {
    /// The times fit.
    Fits,
    /// Handed over later than may be, microseconds after it was written.
    Late {
        /// Delay, the launcher's stops taken off.
        by: u64,
        /// For how long it was stopped meanwhile.
        stopped: u64,
        /// Delay allowed.
        allowed: u64,
    },
    /// Handed over so many microseconds before it was written.
    Early(u64),
}

/// Fit of an entry of `clock` to a handover at `at` of the recording's clock, in a run from `start` on; both microseconds. Of
/// the time in between, the process's stops by the launcher's record do not count.
///
/// A service's entries while it is made are stamped with the start, at any time that its process comes to be: only for its
/// later entries does the time matter. In the twin, where the start is zero, all are there by then.
pub(super) fn clock_fit(clock: &ClockAnchor, entry: &Entry, at: u64, start: u64, stops: &[ProcessStop]) -> ClockFit {
    let made = start > 0 && (reading(clock, start) - i128::from(entry.at.0)).abs() <= ROUNDING_US;
    let early = i128::from(entry.at.0) - reading(clock, at.max(start));
    if early > ROUNDING_US {
        return ClockFit::Early(clamped(early));
    }
    let allowed = if made { MADE_WITHIN_US } else { i128::from(clock.late_us) };
    let passed = reading(clock, at) - i128::from(entry.at.0);
    let (from, until) = (i128::from(at) - passed, i128::from(at));
    let own = stops.iter().filter(|stop| stop.node == entry.node);
    let stopped: i128 = own.map(|stop| covered(stop, from, until)).sum();
    let by = passed - stopped;
    if by <= allowed + ROUNDING_US {
        return ClockFit::Fits;
    }
    ClockFit::Late { by: clamped(by), stopped: clamped(stopped), allowed: clamped(allowed) }
}

/// Reading of `clock` at `at` of the recording's clock.
fn reading(clock: &ClockAnchor, at: u64) -> i128 {
    let at = i128::from(at);
    i128::from(clock.zero_us) + at + (at * i128::from(clock.drift_ppm)).div_euclid(1_000_000)
}

/// Part of the time from `from` to `until` that `stop` covers, microseconds.
fn covered(stop: &ProcessStop, from: i128, until: i128) -> i128 {
    (until.min(i128::from(stop.until_us)) - from.max(i128::from(stop.from_us))).max(0)
}

/// Description of an entry that was handed over late. From the recording alone a host that stalled, a process that was
/// stopped and a time that was changed look the same.
pub(super) fn lateness(node: NodeId, by: u64, stopped: u64, allowed: u64) -> String {
    let stopped = if stopped > 0 {
        format!(" beside the {} for which the launcher stopped it", milliseconds(stopped))
    } else {
        String::new()
    };
    format!(
        "{node} handed this over {} after it wrote it{stopped}, at most {} are allowed: the host or somebody kept the \
         process from running, or one of the two times was changed, which cannot be told apart here; end other work or \
         use --jobs 1, and run it again",
        milliseconds(by),
        milliseconds(allowed)
    )
}

/// A length of time in microseconds, in words.
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
        let at = Instant(1_000_000 + written);
        let entry = Entry {
            node: NodeId::SIM,
            boot: Boot(1),
            counter: 1,
            at,
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
    fn launchers_stop_explains_its_length_of_lateness() {
        let (from_us, until_us) = (START + 1_000_000, START + 1_800_000);
        let stop = ProcessStop { node: NodeId::SIM, from_us, until_us };
        let written = from_us - 10_000;
        assert_eq!(fit(written, until_us + 5_000, &[stop]), ClockFit::Fits);
        let late = ClockFit::Late { by: 110_000, stopped: 800_000, allowed: 100_000 };
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
