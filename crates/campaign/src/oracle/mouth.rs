//! Receipts of what an insider sent: its own entry against what the mouth of the core that it was for took in.
//!
//! The two share the hash of the very bytes (`crate::sights`). That some record of the insider's arrived is none: an honest
//! one of its own would do for that.

use wire::event::{Action, Event, Interface};
use wire::id::NodeId;
use wire::refusal::Reason;

use super::{Evidence, Micros};

/// How soon after a message the verdict over it is in the log.
const VERDICT: Micros = 5_000;

/// The first entry of an insider's `action` whose bytes a mouth took in afterwards, and `sights` times in all.
pub(super) fn receipt(evidence: &Evidence, wanted: Action, sights: usize) -> Option<Micros> {
    let claims = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Event::Attack { action, hash, .. } if action == wanted && w.entry.node.is_insider() => Some((w.at, hash)),
        _ => None,
    });
    let confirmed = |at: Micros, hash: u64| {
        let seen: Vec<Micros> = seen(evidence).filter(|s| s.hash == hash).map(|s| s.at).collect();
        seen.len() >= sights && seen.iter().any(|seen| *seen >= at)
    };
    claims.into_iter().find(|(at, hash)| confirmed(*at, *hash)).map(|(at, _)| at)
}

/// Whether a reader of shared memory refused, from `zero` on, what an insider had put there.
pub(super) fn refused_on_the_bus(evidence: &Evidence, zero: Micros) -> bool {
    let answers = |s: &Seen| {
        evidence.entries.iter().any(|w| match w.entry.event {
            // Of an older boot is the one whose place a rogue took, not the rogue.
            Event::Refused { reason: Reason::Epoch, .. } => false,
            Event::Refused { at, .. } => {
                at == s.interface && w.entry.node == s.reader && w.at >= s.at && w.at - s.at <= VERDICT
            }
            _ => false,
        })
    };
    seen(evidence).filter(|s| s.at >= zero && matches!(s.interface, Interface::Bus(_))).any(|s| answers(&s))
}

/// A sight of a mouth.
struct Seen {
    at: Micros,
    reader: NodeId,
    interface: Interface,
    hash: u64,
}

fn seen(evidence: &Evidence) -> impl Iterator<Item = Seen> {
    evidence.entries.iter().filter_map(|w| match w.entry.event {
        Event::MouthSaw { reader, at, hash, .. } if w.entry.node == NodeId::CAMPAIGN => {
            Some(Seen { at: w.at, reader, interface: at, hash })
        }
        _ => None,
    })
}
