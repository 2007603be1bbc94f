//! Records that were accepted although they are older than *Tf*: the root of a stale picture.
//!
//! A receiver's word on the age of its accepted records is not taken. The relay's log gives the time at which a datagram came to it, the
//! guard's at the target the time at which the same bytes came out; the difference is the least age of the record. When such
//! a datagram came alone, the record that the target accepted right after it was in it.

use evidence::Micros;
use ground_truth::{Any, GuardVerdict, Note};
use wire::event::{Event, Interface};
use wire::id::NodeId;

use super::{Finding, Property, finding};
use crate::facts::Facts;
use crate::facts::link::fresh_for;

/// Time after a datagram was at the guard within which its record is judged, at the latest; and time without another at
/// the guard for it to have come alone.
const JUDGED_WITHIN: Micros = 20_000;

/// The first record at each end of the link that was accepted too old.
pub(super) fn check(facts: &Facts) -> Vec<Finding> {
    let ends = [(NodeId::GATEWAY, Interface::Uplink), (facts.evidence.under.node(), Interface::Downlink)];
    ends.into_iter().flat_map(|(node, interface)| accepted_too_old(facts, node, interface)).collect()
}

fn accepted_too_old(facts: &Facts, node: NodeId, interface: Interface) -> Option<Finding> {
    let evidence = facts.evidence;
    let limit = fresh_for(evidence);
    let passed: Vec<(Micros, u64)> = evidence
        .entries
        .iter()
        .filter(|w| Some(w.entry.node) == node.guard())
        .filter_map(|w| match w.entry.event {
            Any::Instrument(Note::GuardSaw { hash, epoch: 1.., verdict: GuardVerdict::Passed, .. }) => {
                Some((w.at, hash))
            }
            _ => None,
        })
        .collect();
    let accepted: Vec<Micros> = evidence
        .entries
        .iter()
        .filter(|w| {
            w.entry.node == node && matches!(w.entry.event, Any::Service(Event::Accepted { at: accepted_on, .. }) if accepted_on == interface)
        })
        .map(|w| w.at)
        .collect();
    let near = |a: Micros, b: Micros| a.abs_diff(b) <= JUDGED_WITHIN;
    passed.iter().enumerate().find_map(|(i, (seen_at, hash))| {
        let age = seen_at.checked_sub(*facts.relayed.taken.get(hash)?).filter(|age| *age > limit)?;
        let came_alone = i.checked_sub(1).is_none_or(|before| !near(passed[before].0, *seen_at))
            && passed.get(i + 1).is_none_or(|after| !near(after.0, *seen_at));
        let next = accepted.get(accepted.partition_point(|a| a < seen_at)).filter(|next| near(**next, *seen_at))?;
        let message = format!("{node} accepted a record that was at least {} ms old", age / 1000);
        came_alone.then(|| finding(Property::P7, *next, message))
    })
}
