//! Receipts of attacks on the bus of a guest's own programs.
//!
//! The actor and the witness are two participants of that bus. An attack counts when the witness at the attacked end received something of the
//! attacker, or that end says for what reason it refused it.

use evidence::{Evidence, Micros};
use ground_truth::{Any, BusAttack, Note};
use wire::id::NodeId;

use super::window::Window;

/// First step within `window` in which the attack reached the attacked end.
pub(crate) fn receipt(evidence: &Evidence, wanted: BusAttack, window: Window) -> Option<Micros> {
    let mut arrived = evidence.entries.iter().filter(|w| match w.entry.event {
        Any::Instrument(Note::GuestBus { attack, sent, received, refused, .. }) => {
            w.entry.node == NodeId::CAMPAIGN && attack == wanted && sent > 0 && (received > 0 || refused)
        }
        _ => false,
    });
    arrived.find(|w| window.contains(w.at)).map(|w| w.at)
}

/// True if the attacked end refused everything of the attacks from `from` on, so that none of them came into force.
pub(crate) fn refused(evidence: &Evidence, from: Micros) -> bool {
    let mut any = false;
    for w in evidence.entries.iter().filter(|w| w.at >= from) {
        if let Any::Instrument(Note::GuestBus { sent, in_force, refused, .. }) = w.entry.event {
            if in_force || (sent > 0 && !refused) {
                return false;
            }
            any |= refused;
        }
    }
    any
}
