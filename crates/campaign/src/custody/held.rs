//! What is held of a recording outside the recorder: public keys, heads, clocks. No secret.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use wire::audit::{Entry, Head};
use wire::id::{Boot, NodeId};

use crate::evidence::hex;

/// How long after the start a service may still come to be, microseconds.
const MADE_WITHIN_US: i128 = 2_000_000;
/// By how much an entry may seem to have been written after it was handed over, microseconds: the rounding of two clocks.
const ROUNDING_US: i128 = 2;

/// What is held outside the recorder.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Held {
    /// The public key of each service that writes, hexadecimal.
    pub keys: BTreeMap<NodeId, String>,
    /// How far each life's chain went, by its own account.
    pub heads: Vec<HeldHead>,
    /// Lives that were ended on purpose: they owe no last signature and left no account.
    pub killed: Vec<Life>,
    /// The clock of each service's host.
    pub clocks: BTreeMap<NodeId, HeldClock>,
    /// The start of the run by the recording's clock: what a service writes while it is made ready is of that time.
    pub start_us: u64,
    /// Whether the recorder was dead or its disk full when the run ended: its recording then lacks what came last.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub cut_short: bool,
    /// Every file of the run directory but the one that this is in, by its path; none in directories of programs that did not
    /// write it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub files: Option<BTreeMap<String, HeldFile>>,
}

impl Held {
    /// Whether guards and launcher sign what they saw and did: they do not in directories of programs before that.
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

/// A service from one start to its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Life {
    /// Who.
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
    /// Whose chain.
    pub node: NodeId,
    /// Of which start.
    pub boot: Boot,
    /// Its last entry, counted from 1.
    pub counter: u64,
    /// SHA-256 of that entry, hexadecimal.
    pub hash: String,
}

impl HeldHead {
    /// Whose it is.
    pub fn life(&self) -> Life {
        Life { node: self.node, boot: self.boot }
    }
}

impl From<Head> for HeldHead {
    fn from(head: Head) -> Self {
        HeldHead { node: head.node, boot: head.boot, counter: head.counter, hash: hex(&head.hash) }
    }
}

/// What a service's clock reads at a time of the recording, and how long an entry takes at most from there. By default the
/// recording's own clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeldClock {
    /// Reading at zero of the recording's clock, microseconds.
    pub zero_us: u64,
    /// How much faster than that clock it runs, parts per million.
    pub drift_ppm: i64,
    /// Longest time from an entry to the time under which it was handed over, microseconds.
    pub late_us: u64,
}

impl HeldClock {
    /// Whether an entry of this clock may have been handed over at `at` of the recording's, in a run from `start` on.
    ///
    /// What a service writes while it is made is stamped with the start, whenever its process comes to be: only of what it
    /// writes afterwards does its time matter. In the twin, where the start is zero, all are there by then.
    pub fn allows(&self, entry: &Entry, at: u64, start: u64) -> bool {
        let made = start > 0 && (self.reading(start) - i128::from(entry.at.0)).abs() <= ROUNDING_US;
        let late = if made { MADE_WITHIN_US } else { i128::from(self.late_us) };
        let earliest = self.reading(at) - late - ROUNDING_US;
        let latest = self.reading(at.max(start)) + ROUNDING_US;
        (earliest..=latest).contains(&i128::from(entry.at.0))
    }

    fn reading(&self, at: u64) -> i128 {
        let at = i128::from(at);
        i128::from(self.zero_us) + at + (at * i128::from(self.drift_ppm)).div_euclid(1_000_000)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wire::event::Event;
    use wire::time::Instant;

    const START: u64 = 5_000_000;

    fn allowed(written: u64, handed_over: u64) -> bool {
        let clock = HeldClock { zero_us: 1_000_000, drift_ppm: 0, late_us: 100_000 };
        let at = Instant(1_000_000 + written);
        let entry =
            Entry { node: NodeId::SIM, boot: Boot(1), counter: 1, at, event: Event::Started, previous: [0; 32] };
        clock.allows(&entry, handed_over, START)
    }

    #[test]
    fn only_what_is_stamped_with_the_start_may_be_handed_over_late() {
        assert!(allowed(START, START + 110_000) && allowed(START, START - 500_000), "made late, or ready before");
        assert!(!allowed(START, START + 3_000_000));
        assert!(allowed(START + 10, START + 90_000) && !allowed(START + 10, START + 110_000));
        assert!(!allowed(START + 10_000, START + 9_000), "before it was written");
    }
}
