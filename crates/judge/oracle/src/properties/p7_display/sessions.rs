//! Lost sessions at the broker: a display that shows the unit as fresh shows that a session was taken or cut.

use std::collections::BTreeMap;

use evidence::{Evidence, Micros};
use ground_truth::Any;
use wire::event::{Event, Freshness};
use wire::id::{NodeId, PeerId};

use super::{Finding, Property, finding};
use crate::facts::{Facts, process};

/// Longest time for which a display of fresh values may keep silent about it.
const SHOWN_WITHIN: Micros = 1_000_000;

/// Sessions that their owner knew to be lost and that a fresh display did not show.
pub(super) fn check(facts: &Facts) -> Vec<Finding> {
    let evidence = facts.evidence;
    let mut counts: BTreeMap<PeerId, u32> = BTreeMap::new();
    let mut found = Vec::new();
    for w in &evidence.entries {
        let Any::Service(Event::SessionLost { peer }) = w.entry.event else { continue };
        // The display shows the number of losses, so that one that was shown before hides no later one.
        let count = counts.entry(peer).or_default();
        *count += 1;
        let due = w.at + SHOWN_WITHIN;
        let shown = evidence.entries.iter().any(|w| match w.entry.event {
            Any::Service(Event::LossesShown { peer: shown, times }) => shown == peer && times >= *count && w.at <= due,
            _ => false,
        });
        if !shown && due < evidence.duration && shown_fresh_at(evidence, w.entry.node, due) {
            found.push(finding(
                Property::P7,
                due,
                format!("the display is silent about lost session {count} of {peer}"),
            ));
        }
    }
    found
}

/// True if the display last said by `time` that its picture of the owner's unit is fresh; the gateway's word on itself is of
/// no unit, and due as long as that of the unit under test comes through. A dead console has no window.
fn shown_fresh_at(evidence: &Evidence, owner: NodeId, time: Micros) -> bool {
    if process::is_dead(evidence, NodeId::CONSOLE, time) {
        return false;
    }
    let shown_unit = owner.unit().unwrap_or(evidence.under.unit);
    let shown = evidence.entries.iter().rev().find_map(|w| match w.entry.event {
        Any::Service(Event::Displayed { unit, freshness, .. }) if unit == shown_unit && w.at <= time => Some(freshness),
        _ => None,
    });
    shown == Some(Freshness::Fresh)
}
