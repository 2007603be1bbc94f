//! Receipts of a rogue's orders: an order counts when another process than the rogue judged that very command.

use evidence::{Evidence, Micros};
use ground_truth::{Any, Note};
use wire::event::{Event, Interface};
use wire::id::{CommandId, NodeId, PeerId};

use super::window::Window;

/// First order of the rogue within `window` that another process judged. The unit and the gateway name it by its id,
/// the broker by the certificate under which it was published.
pub(crate) fn receipt(evidence: &Evidence, window: Window) -> Option<Micros> {
    let orders = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Instrument(Note::Rogue { command, certificate, .. })
            if w.entry.node == NodeId::INSIDER_OPERATOR && window.contains(w.at) =>
        {
            Some((w.at, command, certificate))
        }
        _ => None,
    });
    orders
        .into_iter()
        .find(|(ordered_at, command, certificate)| judged_by_another(evidence, *ordered_at, *command, *certificate))
        .map(|(ordered_at, ..)| ordered_at)
}

fn judged_by_another(evidence: &Evidence, from: Micros, order: CommandId, certificate: Option<PeerId>) -> bool {
    evidence.entries.iter().any(|w| {
        w.at >= from
            && match w.entry.event {
                Any::Service(Event::Executed { command, .. } | Event::Stored { command, .. }) => {
                    w.entry.node == evidence.under.node() && command == order
                }
                Any::Service(Event::Staged { command, .. }) => w.entry.node == NodeId::GATEWAY && command == order,
                Any::Service(Event::Refused { at: Interface::Broker, peer, .. }) => {
                    peer.is_some() && peer == certificate
                }
                _ => false,
            }
    })
}
