//! Receipts of sessions at the broker that another took.
//!
//! A takeover has three witnesses: the thief, the broker, and the former holder, who only knows that its session is lost.

use evidence::{Evidence, Micros};
use ground_truth::{Any, Note};
use wire::event::Event;
use wire::id::{NodeId, PeerId};

use super::window::Window;

/// Longest time from the thief's entry to the broker's: dialling and a handshake on a loaded host.
const DIALLED_WITHIN: Micros = 2_000_000;

/// The thief's first entry within `window` that the broker confirms, and that the owner of the session lost it.
pub(crate) fn receipt(evidence: &Evidence, peer: PeerId, window: Window) -> Option<Micros> {
    let owner = NodeId::from_name(&peer.to_string())?;
    let joins = evidence.entries.iter().filter(|w| match w.entry.event {
        Any::Instrument(Note::Joins { certificate }) => {
            w.entry.node == NodeId::IMPOSTOR && certificate == peer && window.contains(w.at)
        }
        _ => false,
    });
    let logged = |from: Micros, node: NodeId, event: Event| {
        let event = Any::Service(event);
        let mut entries = evidence.entries.iter().filter(|w| w.entry.node == node && w.entry.event == event);
        entries.any(|w| (from..from + DIALLED_WITHIN).contains(&w.at))
    };
    let confirmed = |joined_at: Micros| {
        logged(joined_at, NodeId::BROKER, Event::TakenOver { peer })
            && logged(joined_at, owner, Event::SessionLost { peer })
    };
    joins.map(|w| w.at).find(|joined_at| confirmed(*joined_at))
}
