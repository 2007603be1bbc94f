//! Orders: values that no unit may have been set to, and the receipt of a rogue's.
//!
//! That no order is executed that no operator gave is P5's and P8's (`properties`), that an operator's HOLD is obeyed within
//! *Th* whatever other requests there are is P3's (`planes`). A rogue's order counts when another process than the rogue judged
//! that very command.

use evidence::{Evidence, Finding, Micros, Property};
use instrument::{Any, Note};
use wire::command::CommandKind;
use wire::event::{Event, Interface};
use wire::id::{CommandId, NodeId, PeerId};

use crate::window::Window;
use crate::{finding, reaction_ms};

/// P4 for settings: under no values that were accepted may a unit that loses its place at the margin leave the fence.
pub(crate) fn check(evidence: &Evidence) -> Vec<Finding> {
    let bounds = &evidence.bounds;
    let blind_ms = (bounds.product_limit_ms + bounds.control_period_ms).saturating_sub(reaction_ms(bounds));
    let set = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Service(Event::Executed { kind: CommandKind::Configure(values), refused: None, .. }) => {
            Some((w.at, values))
        }
        _ => None,
    });
    let unsafe_values = set.filter(|(_, v)| u64::from(v.speed_mm_s) * blind_ms / 1000 > u64::from(v.margin_mm));
    unsafe_values
        .map(|(at, v)| finding(Property::P4, at, format!("set to leave the fence when blind: {v:?}")))
        .collect()
}

/// The first order of the rogue within `window` that another process judged: the unit or the gateway by its id, the broker by the
/// certificate under which it was published.
pub(crate) fn receipt(evidence: &Evidence, window: Window) -> Option<Micros> {
    let orders = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Instrument(Note::Rogue { command, certificate, .. })
            if w.entry.node == NodeId::INSIDER_OPERATOR && window.has(w.at) =>
        {
            Some((w.at, command, certificate))
        }
        _ => None,
    });
    orders
        .into_iter()
        .find(|(at, command, certificate)| judged(evidence, *at, *command, *certificate))
        .map(|(at, ..)| at)
}

fn judged(evidence: &Evidence, from: Micros, order: CommandId, certificate: Option<PeerId>) -> bool {
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
