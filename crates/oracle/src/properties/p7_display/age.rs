//! P7 at its root: no record is accepted that is older than *Tf*.
//!
//! A receiver's word on the age of its accepted records is not taken. The relay's log gives the time at which a datagram came to it, the
//! guard's at the target the time at which the same bytes came out; the difference is the least age of the record. When such
//! a datagram came alone, the record that the target accepted right after it was in it.

use std::collections::BTreeMap;

use evidence::{Evidence, Finding, Micros, Property};
use instrument::{Any, GuardVerdict, Note};
use wire::event::{Event, Interface};
use wire::id::NodeId;

use crate::arrived::Receipt;
use crate::finding;

/// Time after a datagram was at the guard within which its record is judged, at the latest; and time without another at
/// the guard for it to have come alone.
const JUDGED: Micros = 20_000;
/// Difference that two clocks and two logs may have.
const SLACK: Micros = 1_000;

/// Time that a record may have spent between the relay's log and a guard's, at most, to be fresh.
pub(crate) fn limit(evidence: &Evidence) -> Micros {
    evidence.bounds.freshness_ms * 1000 + SLACK
}

/// Looks for records that were accepted too old.
pub(crate) fn check(evidence: &Evidence, receipt: &Receipt) -> Vec<Finding> {
    let ends = [(NodeId::GATEWAY, Interface::Uplink), (evidence.under.node(), Interface::Downlink)];
    ends.into_iter().flat_map(|(node, interface)| at_end(evidence, &receipt.taken, node, interface)).collect()
}

fn at_end(evidence: &Evidence, taken: &BTreeMap<u64, Micros>, node: NodeId, interface: Interface) -> Option<Finding> {
    let limit = limit(evidence);
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
            w.entry.node == node && matches!(w.entry.event, Any::Service(Event::Accepted { at, .. }) if at == interface)
        })
        .map(|w| w.at)
        .collect();
    let near = |a: Micros, b: Micros| a.abs_diff(b) <= JUDGED;
    passed.iter().enumerate().find_map(|(i, (at, hash))| {
        let age = at.checked_sub(*taken.get(hash)?).filter(|age| *age > limit)?;
        let alone = i.checked_sub(1).is_none_or(|before| !near(passed[before].0, *at))
            && passed.get(i + 1).is_none_or(|after| !near(after.0, *at));
        let next = accepted.get(accepted.partition_point(|a| a < at)).filter(|next| near(**next, *at))?;
        let what = format!("{node} accepted a record that was at least {} ms old", age / 1000);
        alone.then(|| finding(Property::P7, *next, what))
    })
}
