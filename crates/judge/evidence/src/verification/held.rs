//! Trust anchors of a recording outside the recorder: public keys, heads, clocks. No secret.

use std::collections::BTreeMap;

use ground_truth::Entry;
use serde::{Deserialize, Serialize};
use wire::audit::Head;
use wire::id::{Boot, NodeId};

use crate::log::hex;

/// Time after the start within which a service may still come to be, microseconds.
const MADE_WITHIN_US: i128 = 2_000_000;
/// By how much an entry may seem to have been written after it was handed over, microseconds: the rounding of two clocks.
const ROUNDING_US: i128 = 2;

/// Trust anchors outside the recorder.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Held {
    /// The public key of each service that writes, hexadecimal.
    pub keys: BTreeMap<NodeId, String>,
    /// Head of each life's chain, by its own account.
    pub heads: Vec<HeldHead>,
    /// Lives that were ended on purpose: they owe no last signature and left no account.
    pub killed: Vec<Life>,
    /// The clock of each service's host.
    pub clocks: BTreeMap<NodeId, HeldClock>,
    /// Times for which the launcher kept a service's process from running, by its own record.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stops: Vec<Stop>,
    /// The start of the run by the recording's clock: entries of a service while it is made ready are of that time.
    pub start_us: u64,
    /// True if the recorder was dead or its disk full when the run ended: its recording then lacks its end.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub cut_short: bool,
    /// Every file of the run directory but the one that this is in, by its path; none in directories of programs that did not
    /// write it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub files: Option<BTreeMap<String, HeldFile>>,
}

impl Held {
    /// True if guards and launcher sign their observations and actions: they do not in directories of programs before that.
    pub fn knows_witnesses(&self) -> bool {
        self.keys.contains_key(&NodeId::CAMPAIGN)
    }
}

/// A file as it was when the run was over.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeldFile {
    /// Its length.
    pub bytes: u64,
    /// SHA-256 of all of them, hexadecimal.
    pub sha256: String,
}

/// A time for which the launcher kept a process from running. An entry begun before is handed over after it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stop {
    /// Node of the process.
    pub node: NodeId,
    /// From then on, microseconds of the recording's clock.
    pub from_us: u64,
    /// Until then; `u64::MAX` where it was not let go on before the end.
    pub until_us: u64,
}

impl Stop {
    /// Part of the time from `from` to `until` that it covers, microseconds.
    fn covers(&self, from: i128, until: i128) -> i128 {
        (until.min(i128::from(self.until_us)) - from.max(i128::from(self.from_us))).max(0)
    }
}

/// Fit of the time in an entry to the one under which it was handed over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fit {
    /// It does.
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

/// A service from one start to its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Life {
    /// Node of the service.
    pub node: NodeId,
    /// Which start.
    pub boot: Boot,
}

impl Life {
    /// The life that wrote `entry`.
    pub fn of(entry: &Entry) -> Life {
        Life { node: entry.node, boot: entry.boot }
    }
}

impl core::fmt::Display for Life {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{}, boot {}", self.node, self.boot.0)
    }
}

/// A head that is held outside the recorder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeldHead {
    /// Node that writes the chain.
    pub node: NodeId,
    /// Of which start.
    pub boot: Boot,
    /// Its last entry, counted from 1.
    pub counter: u64,
    /// SHA-256 of that entry, hexadecimal.
    pub hash: String,
}

impl HeldHead {
    /// Life that it belongs to.
    pub fn life(&self) -> Life {
        Life { node: self.node, boot: self.boot }
    }
}

impl From<Head> for HeldHead {
    fn from(head: Head) -> Self {
        HeldHead { node: head.node, boot: head.boot, counter: head.counter, hash: hex(&head.hash) }
    }
}

/// Reading of a service's clock at a time of the recording, and the longest delay of an entry from there. By default the
/// recording's own clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeldClock {
    /// Reading at zero of the recording's clock, microseconds.
    pub zero_us: u64,
    /// Rate at which it runs faster than that clock, parts per million.
    pub drift_ppm: i64,
    /// Longest time from an entry to the time under which it was handed over, microseconds.
    pub late_us: u64,
}

impl HeldClock {
    /// Fit of an entry of this clock to a handover at `at` of the recording's, in a run from `start` on. Of the
    /// time in between, the process's stops by the launcher's record do not count.
    ///
    /// A service's entries while it is made are stamped with the start, at any time that its process comes to be: only for its
    /// later entries does the time matter. In the twin, where the start is zero, all are there by then.
    pub fn fit(&self, entry: &Entry, at: u64, start: u64, stops: &[Stop]) -> Fit {
        let made = start > 0 && (self.reading(start) - i128::from(entry.at.0)).abs() <= ROUNDING_US;
        let early = i128::from(entry.at.0) - self.reading(at.max(start));
        if early > ROUNDING_US {
            return Fit::Early(clamped(early));
        }
        let allowed = if made { MADE_WITHIN_US } else { i128::from(self.late_us) };
        let passed = self.reading(at) - i128::from(entry.at.0);
        let (from, until) = (i128::from(at) - passed, i128::from(at));
        let own = stops.iter().filter(|stop| stop.node == entry.node);
        let stopped: i128 = own.map(|stop| stop.covers(from, until)).sum();
        let by = passed - stopped;
        if by <= allowed + ROUNDING_US {
            return Fit::Fits;
        }
        Fit::Late { by: clamped(by), stopped: clamped(stopped), allowed: clamped(allowed) }
    }

    fn reading(&self, at: u64) -> i128 {
        let at = i128::from(at);
        i128::from(self.zero_us) + at + (at * i128::from(self.drift_ppm)).div_euclid(1_000_000)
    }
}

fn clamped(us: i128) -> u64 {
    u64::try_from(us.max(0)).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ground_truth::Any;
    use wire::event::Event;
    use wire::time::Instant;

    const START: u64 = 5_000_000;

    fn fit(written: u64, handed_over: u64, stops: &[Stop]) -> Fit {
        let clock = HeldClock { zero_us: 1_000_000, drift_ppm: 0, late_us: 100_000 };
        let at = Instant(1_000_000 + written);
        let entry = Entry {
            node: NodeId::SIM,
            boot: Boot(1),
            counter: 1,
            at,
            event: Any::Service(Event::Started),
            previous: [0; 32],
        };
        clock.fit(&entry, handed_over, START, stops)
    }

    fn allowed(written: u64, handed_over: u64) -> bool {
        fit(written, handed_over, &[]) == Fit::Fits
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
        let stop = Stop { node: NodeId::SIM, from_us, until_us };
        let written = from_us - 10_000;
        assert_eq!(fit(written, until_us + 5_000, &[stop]), Fit::Fits);
        let late = Fit::Late { by: 110_000, stopped: 800_000, allowed: 100_000 };
        assert_eq!(fit(written, until_us + 100_000, &[stop]), late);
        let other = Stop { node: NodeId::GATEWAY, ..stop };
        assert!(matches!(fit(written, until_us + 5_000, &[other]), Fit::Late { stopped: 0, .. }), "of another process");
        assert!(matches!(fit(until_us + 1, until_us + 200_000, &[stop]), Fit::Late { stopped: 0, .. }), "after it");
        assert_eq!(fit(written, written - 5_000, &[stop]), Fit::Early(5_000), "no stop explains that");
    }
}
