//! Sessions at the broker that another took, or that were cut: the receipt, and the duty to the operator.
//!
//! A takeover is told by three: the thief, the broker, and the former holder, who only knows that it is lost. An order
//! given before that leads away from safe may not be executed after (P8), and a display that shows the unit as fresh shows
//! that a session was lost (P7).

use std::collections::BTreeMap;

use evidence::{Evidence, Finding, Micros, Property};
use instrument::{Any, Note};
use wire::event::{Event, Freshness};
use wire::id::{NodeId, PeerId};

use crate::window::Window;
use crate::{finding, life};

/// Longest time from the thief's word to the broker's: dialling and a handshake on a loaded host.
const DIALLED_WITHIN: Micros = 2_000_000;

/// Longest time for which a display of fresh values may keep silent about it.
const SHOWN_WITHIN: Micros = 1_000_000;

/// The thief's first entry within `window` that the broker confirms, and that the owner of the session lost it.
pub(crate) fn receipt(evidence: &Evidence, peer: PeerId, window: Window) -> Option<Micros> {
    let owner = NodeId::from_name(&peer.to_string())?;
    let joins = evidence.entries.iter().filter(|w| match w.entry.event {
        Any::Instrument(Note::Joins { certificate }) => {
            w.entry.node == NodeId::IMPOSTOR && certificate == peer && window.has(w.at)
        }
        _ => false,
    });
    let said = |from: Micros, by: NodeId, event: Event| {
        let event = Any::Service(event);
        let mut entries = evidence.entries.iter().filter(|w| w.entry.node == by && w.entry.event == event);
        entries.any(|w| (from..from + DIALLED_WITHIN).contains(&w.at))
    };
    let confirmed = |at: Micros| {
        said(at, NodeId::BROKER, Event::TakenOver { peer }) && said(at, owner, Event::SessionLost { peer })
    };
    joins.map(|w| w.at).find(|at| confirmed(*at))
}

/// P7 and P8.
pub(crate) fn check(evidence: &Evidence) -> Vec<Finding> {
    let mut found = silent(evidence);
    found.extend(stale_orders(evidence));
    found
}

/// Sessions that their owner knew to be lost and that a fresh display did not show.
fn silent(evidence: &Evidence) -> Vec<Finding> {
    let mut counts: BTreeMap<PeerId, u32> = BTreeMap::new();
    let mut found = Vec::new();
    for w in &evidence.entries {
        let Any::Service(Event::SessionLost { peer }) = w.entry.event else { continue };
        let count = counts.entry(peer).or_default();
        *count += 1;
        let by = w.at + SHOWN_WITHIN;
        let told = evidence.entries.iter().any(|w| match w.entry.event {
            Any::Service(Event::LossesShown { peer: shown, times }) => shown == peer && times >= *count && w.at <= by,
            _ => false,
        });
        if !told && by < evidence.duration && fresh_at(evidence, w.entry.node, by) {
            found.push(finding(
                Property::P7,
                by,
                format!("the display is silent about lost session {count} of {peer}"),
            ));
        }
    }
    found
}

/// True if the display last said before `by` that its picture of the unit is fresh; the gateway's word on itself is of
/// no unit, and due as long as that of the unit under test comes through. The window of a dead console is gone.
fn fresh_at(evidence: &Evidence, who: NodeId, by: Micros) -> bool {
    if life::dead(evidence, NodeId::CONSOLE).iter().any(|(from, to)| (*from..*to).contains(&by)) {
        return false;
    }
    let of = who.unit().unwrap_or(evidence.under.unit);
    let shown = evidence.entries.iter().rev().find_map(|w| match w.entry.event {
        Any::Service(Event::Displayed { unit, freshness, .. }) if unit == of && w.at <= by => Some(freshness),
        _ => None,
    });
    shown == Some(Freshness::Fresh)
}

/// Orders away from safe that were given before the unit's session was lost, and executed after.
fn stale_orders(evidence: &Evidence) -> Vec<Finding> {
    let mut given = BTreeMap::new();
    let mut found = Vec::new();
    let mut latest = None;
    for w in &evidence.entries {
        match w.entry.event {
            Any::Service(Event::Intended { command, .. }) => {
                given.insert(command, w.at);
            }
            Any::Service(Event::SessionLost { .. }) if w.entry.node == evidence.under.node() => latest = Some(w.at),
            Any::Service(Event::Executed { command, kind, refused: None }) if w.entry.node == evidence.under.node() => {
                let before = given.get(&command).zip(latest).is_some_and(|(given, taken)| *given < taken);
                if before && !kind.towards_safe() {
                    let what = format!("{command} was given before the session was lost, and is executed after");
                    found.push(finding(Property::P8, w.at, what));
                }
            }
            _ => {}
        }
    }
    found
}
