//! The log of a run as it is recorded, and the two hashes of a trial.
//!
//! `log_hash`: SHA-256 over the canonical events in (time, node, counter) order; no path, run id or file bytes, no
//! world, and none of the chain's own links (hashes, signatures, seals), which follow from the events.
//! `decision_hash`: the same over decisions alone: modes, verdicts, reasons, and when, whatever the policy waives.

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

use ground_truth::Any;
use sha2::{Digest, Sha256};
use wire::codec;
use wire::event::Event;
use wire::id::{NodeId, WorldId};
use wire::policy::Waived;

use crate::Witnessed;

/// An encoded audit entry with the trace time at which it was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Logged {
    /// Trace time, microseconds.
    pub at: u64,
    /// Node that handed it over.
    pub node: NodeId,
    /// Encoded entry.
    pub bytes: Vec<u8>,
}

/// True if the recorder records a node's entries: all nodes but guards and launcher, which write their own files.
pub fn by_recorder(node: NodeId) -> bool {
    node != NodeId::CAMPAIGN && !node.is_mouth()
}

/// The two hashes of a trial, as hexadecimal.
pub fn hashes(entries: &[Witnessed]) -> (String, String) {
    let (mut log, mut decisions) = (Sha256::new(), Sha256::new());
    for w in entries {
        let Some(event) = canonical(w.entry.event) else { continue };
        let bytes = codec::encode(&Canonical { at: w.at, node: w.entry.node, event });
        log.update(&bytes);
        if let Some(event) = decision(event) {
            decisions.update(codec::encode(&Canonical { at: w.at, node: w.entry.node, event }));
        }
    }
    (hex(&log.finalize()), hex(&decisions.finalize()))
}

/// Lower-case hexadecimal.
pub fn hex(bytes: &[u8]) -> String {
    const DIGITS: [char; 16] = ['0', '1', '2', '3', '4', '5', '6', '7', '8', '9', 'a', 'b', 'c', 'd', 'e', 'f'];
    bytes.iter().flat_map(|b| [DIGITS[usize::from(b >> 4)], DIGITS[usize::from(b & 15)]]).collect()
}

/// Input of the hashes.
#[derive(minicbor::Encode)]
pub struct Canonical {
    /// Trace time, microseconds.
    #[n(0)]
    pub at: u64,
    /// Node that wrote the entry.
    #[n(1)]
    pub node: NodeId,
    /// The event.
    #[n(2)]
    pub event: Any,
}

/// The event without its world, or none for the chain's own links.
fn canonical(event: Any) -> Option<Any> {
    match event {
        Any::Service(Event::Signed { .. } | Event::Sealed { .. }) => None,
        Any::Service(Event::Minted { world: _, authority, track, command, waived }) => {
            Some(Any::Service(Event::Minted { world: WorldId(0), authority, track, command, waived }))
        }
        Any::Service(Event::Acted { world: _, authority, track, command, failing }) => {
            Some(Any::Service(Event::Acted { world: WorldId(0), authority, track, command, failing }))
        }
        other => Some(other),
    }
}

/// The event without the checks that were waived: these belong to the policy and not to the decision.
fn unwaived(event: Any) -> Any {
    match event {
        Any::Service(Event::Accepted { at, record, peer, age, waived: _ }) => {
            Any::Service(Event::Accepted { at, record, peer, age, waived: Waived::default() })
        }
        Any::Service(Event::Minted { world, authority, track, command, waived: _ }) => {
            Any::Service(Event::Minted { world, authority, track, command, waived: Waived::default() })
        }
        other => other,
    }
}

/// The event as a decision, without waivers and world; none where it is no decision.
pub fn decision(event: Any) -> Option<Any> {
    canonical(event).filter(is_decision).map(unwaived)
}

/// The kind of a decision in a word or two: a refusal by its reason, a change of mode by its new mode.
pub fn kind_of(decision: &Any) -> String {
    match decision {
        Any::Service(Event::Refused { reason, .. }) => format!("refused: {}", reason.name()),
        Any::Service(Event::Transition { to, .. }) => format!("to {}", to.name()),
        other => {
            let named = serde_json::to_value(other).ok();
            named.and_then(|v| v.get("is")?.as_str().map(str::to_owned)).unwrap_or_default()
        }
    }
}

fn is_decision(event: &Any) -> bool {
    matches!(
        event,
        Any::Service(
            Event::Accepted { .. }
                | Event::Refused { .. }
                | Event::Transition { .. }
                | Event::Minted { .. }
                | Event::Revoked { .. }
                | Event::Acted { .. }
                | Event::Staged { .. }
                | Event::Stored { .. }
                | Event::Executed { .. }
                | Event::Inconsistent { .. }
        )
    )
}
