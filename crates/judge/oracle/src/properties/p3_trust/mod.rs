//! P3: after a loss of trust the unit holds within *Th*, and its plant is then safe.
//!
//! Trust is lost with the localisation that driving depends on, with the last timely record on the telemetry link, by an operator's HOLD, and where
//! the unit is not at the place at which it takes itself to be (`stated_place`). The responses to a process fault are `process_fault`'s.

mod stated_place;

use evidence::Micros;
use ground_truth::{FaultKind, Sensor};
use wire::command::CommandKind;
use wire::id::NodeId;
use wire::mode::Mode;

use super::limit::{Limit, LimitRow, longest};
use super::{BareGuest, Finding, Property, finding, process_fault, speed};
use crate::facts::timeline::is_resting;
use crate::facts::{Facts, SLACK, contact, link, process};

pub(super) const BARE_GUEST: BareGuest = BareGuest {
    check: |facts| {
        let mut found = speed::check(facts, Property::P3);
        found.extend(stated_place::guest_astray(facts));
        found
    },
    not_judged: Some(("P3 by mode", "HOLD_SAFE is a mode of the platform; the plant's motion is judged in its place")),
};

/// Part of P3 that is not judged of a bare guest without a place among its outputs, and the reason.
pub(crate) const STATED_PLACE_NOT_JUDGED: (&str, &str) = ("P3 by place", "the guest states no place that it drives by");

pub(super) const LIMITS: [LimitRow; 3] = [
    LimitRow {
        limit: Limit::Blindness,
        name: "going on without localisation",
        length_ms: Some(|bounds| bounds.to_hold_safe_ms),
        approach: |facts, length_us| longest(blind_times(facts), length_us),
    },
    LimitRow {
        limit: Limit::Uplink,
        name: "going on with nothing timely at the gateway",
        length_ms: Some(|bounds| bounds.to_hold_safe_ms),
        approach: |facts, length_us| longest(unheard_times(facts, NodeId::GATEWAY), length_us),
    },
    LimitRow {
        limit: Limit::Downlink,
        name: "going on with nothing timely at the unit",
        length_ms: Some(|bounds| bounds.to_hold_safe_ms),
        approach: |facts, length_us| longest(unheard_times(facts, facts.evidence.under.node()), length_us),
    },
];

pub(super) fn check(facts: &Facts) -> Vec<Finding> {
    let mut found = without_localisation(facts);
    found.extend(without_timely_records(facts));
    found.extend(speed::check(facts, Property::P3));
    found.extend(hold_not_obeyed(facts));
    found.extend(stated_place::unit_astray(facts));
    found.extend(process_fault::findings(facts, Property::P3));
    found
}

/// Loss of the localisation for longer than *Th* after which the unit goes on.
fn without_localisation(facts: &Facts) -> Vec<Finding> {
    let Facts { evidence, timeline, .. } = facts;
    let th = evidence.bounds.to_hold_safe_ms * 1000;
    let due = facts.sensor_faults.iter().filter(|f| {
        let lost = f.kind == FaultKind::Dropout && f.sensor == Sensor::Localisation;
        lost && f.end.saturating_sub(f.start) > th && f.start + th <= evidence.duration
    });
    due.filter_map(|f| {
        let mode = timeline.mode_at(process::can_judge(evidence, evidence.under.node(), f.start + th));
        let message = format!("localisation lost for {} ms and still {}", th / 1000, mode.name());
        (!is_resting(mode)).then(|| finding(Property::P3, f.start + th, message))
    })
    .collect()
}

/// Silence of the link, in either direction, for *Th* after which the unit goes on; after the end of a planned contact, soon after the
/// next one has begun.
///
/// A dead unit changes no mode, and the response to a dead end is `process_fault`'s to judge: from the end of either to its next start, none is
/// asked for here.
fn without_timely_records(facts: &Facts) -> Vec<Finding> {
    let Facts { evidence, timeline, .. } = facts;
    let th = evidence.bounds.to_hold_safe_ms * 1000;
    let mut found = Vec::new();
    for node in [NodeId::GATEWAY, evidence.under.node()] {
        for (begin, end) in link::silences(facts, node) {
            let due = contact::may_go_on_until(evidence, begin).unwrap_or(begin + th);
            if end <= due {
                continue;
            }
            // A unit that did not run judges when it runs again; until then the lease of its plant limits it.
            let mode = timeline.mode_at(process::can_judge(evidence, evidence.under.node(), due));
            if !is_resting(mode) {
                let silent = (due - begin) / 1000;
                let message = format!("nothing timely at {node} for {silent} ms and still {}", mode.name());
                found.push(finding(Property::P3, due, message));
            }
        }
    }
    found
}

/// HOLD of an operator that the unit does not obey: *Th* after it was given, or was due by its time tag, the unit holds, by the order or by its
/// lease. A unit that did not live all that time is `process_fault`'s to judge.
fn hold_not_obeyed(facts: &Facts) -> Vec<Finding> {
    let Facts { evidence, timeline, .. } = facts;
    let dead = process::dead_spans(evidence, evidence.under.node());
    let lived = |from: Micros, to: Micros| dead.iter().all(|(died, restarted)| to < *died || from > *restarted);
    let th = evidence.bounds.to_hold_safe_ms * 1000 + SLACK;
    let holds = timeline.intended.iter().filter(|(.., kind)| *kind == CommandKind::Hold);
    let due = holds.map(|(given_at, id, _)| (timeline.order_due(*id, *given_at), id));
    let due = due.filter(|(due_at, _)| due_at + th <= evidence.duration && lived(*due_at, due_at + th));
    let late = due.filter(|(due_at, _)| {
        !timeline.was_in(Mode::HoldSafe, *due_at, due_at + th) && !timeline.was_in(Mode::Idle, *due_at, due_at + th)
    });
    late.map(|(due_at, id)| {
        let message = format!("{id}, a hold, was due and {} ms later the unit had not held", th / 1000);
        finding(Property::P3, due_at + th, message)
    })
    .collect()
}

fn blind_times(facts: &Facts) -> impl Iterator<Item = u64> {
    let losses = facts.sensor_faults.iter().filter(|f| f.is_loss() && f.sensor == Sensor::Localisation);
    let goes_on = |mode: Mode| !is_resting(mode);
    losses.map(move |f| facts.timeline.stayed((f.start, f.end.min(facts.evidence.duration)), goes_on))
}

fn unheard_times(facts: &Facts, node: NodeId) -> impl Iterator<Item = u64> {
    let beyond_contact =
        |(begin, end): &(Micros, Micros)| contact::may_go_on_until(facts.evidence, *begin).is_none_or(|due| *end > due);
    let silences = link::silences(facts, node).into_iter().filter(beyond_contact);
    silences.map(|silence| facts.timeline.stayed(silence, |mode| !is_resting(mode)))
}
