//! Datagrams of the telemetry link that the relay says it took off their way, made or changed.

use std::collections::BTreeMap;

use evidence::{Evidence, Micros};
use ground_truth::{Action, Any, Note};

/// Datagrams by the hash of their bytes, each with a time.
#[derive(Clone, Debug, Default)]
pub(crate) struct RelayedDatagrams {
    /// Time at which the relay first took a datagram off its way: to send it later, or never.
    pub taken: BTreeMap<u64, Micros>,
    /// Time at which the adversary made or changed a datagram: never timely traffic.
    pub forged: BTreeMap<u64, Micros>,
}

impl RelayedDatagrams {
    /// Reads the relay's entries.
    pub(crate) fn new(evidence: &Evidence) -> Self {
        let mut relayed = RelayedDatagrams::default();
        for w in &evidence.entries {
            let Any::Instrument(Note::Attack { action, hash, .. }) = w.entry.event else { continue };
            match action {
                // A datagram that was dropped may be put back by another part of the same attack: it was held until then.
                Action::Delay | Action::Reorder | Action::Drop => {
                    relayed.taken.entry(hash).or_insert(w.at);
                }
                Action::Corrupt | Action::Inject => {
                    relayed.forged.insert(hash, w.at);
                }
                // Only the first arrival of these bytes can be timely (`link::silences`), whatever is repeated.
                Action::Duplicate
                | Action::Replay
                | Action::Reoriginate
                | Action::Forward
                | Action::Kill
                | Action::Forge
                | Action::Republish
                | Action::Resend
                | Action::Lie
                | Action::Confuse => {}
            }
        }
        relayed
    }
}
