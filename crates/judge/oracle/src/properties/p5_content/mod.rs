//! P5: displays, executions and findings against a teammate came from accepted records and the operator's
//! own intents. The display of a unit is that unit's own report.
//!
//! These are the influences that have a name in the log. Other influences of a refused record show only in their
//! effects: in the pose (`pose`), in modes and at the plant (P8, and `speed`).

mod pose;

use std::collections::{BTreeMap, BTreeSet};

use evidence::{Evidence, Micros};
use ground_truth::{Any, Note};
use wire::command::CommandKind;
use wire::event::{Event, Freshness};
use wire::id::{CommandId, NodeId, RecordId};

use super::limit::{Limit, LimitRow, longest};
use super::{BareGuest, Finding, Property, finding, not_judged};
use crate::facts::{Facts, SLACK};

pub(super) const BARE_GUEST: BareGuest = BareGuest {
    check: not_judged,
    not_judged: Some(("P5", "what an unaccepted record may change inside a guest is not seen")),
};

pub(super) const LIMITS: [LimitRow; 1] = [LimitRow {
    limit: Limit::Age,
    name: "age of what is accepted",
    length_ms: Some(|bounds| bounds.freshness_ms),
    approach: |facts, length_us| longest(accepted_ages(facts.evidence), length_us),
}];

/// A command that a rogue gave: its kind, and the owner of its key.
type RogueCommand = (CommandKind, NodeId);

pub(super) fn check(facts: &Facts) -> Vec<Finding> {
    let mut found = unaccepted_content(facts);
    found.extend(pose::moved_by_distrusted_fixes(facts.evidence));
    found
}

fn unaccepted_content(facts: &Facts) -> Vec<Finding> {
    let Facts { evidence, timeline, .. } = facts;
    let mut accepted: BTreeSet<RecordId> = BTreeSet::new();
    let mut rogues: BTreeMap<CommandId, Vec<RogueCommand>> = BTreeMap::new();
    let mut accepted_by_unit: BTreeSet<RecordId> = BTreeSet::new();
    let mut found = Vec::new();
    // Entries are in the order of time: a record or a rogue command counts from its entry on, never for earlier ones.
    for w in &evidence.entries {
        match w.entry.event {
            Any::Service(Event::Accepted { record, .. }) if w.entry.node == NodeId::GATEWAY => {
                accepted.insert(record);
            }
            Any::Service(Event::Accepted { record, .. }) if w.entry.node == evidence.under.node() => {
                accepted_by_unit.insert(record);
            }
            Any::Service(Event::Inconsistent { unit, record, .. })
                if w.entry.node == evidence.under.node() && !accepted_by_unit.contains(&record) =>
            {
                let message = format!("{} is found out by {record}, which the unit never accepted", unit.node());
                found.push(finding(Property::P5, w.at, message));
            }
            Any::Service(Event::Displayed { unit, report, freshness, .. })
                if freshness != Freshness::Lost && report.node != unit.node() =>
            {
                found.push(finding(Property::P5, w.at, format!("{report} is displayed as of {}", unit.node())));
            }
            Any::Instrument(Note::Rogue { command, kind, key, .. }) => {
                rogues.entry(command).or_default().push((kind, key))
            }
            Any::Service(Event::Displayed { report, freshness, .. })
                if freshness != Freshness::Lost && !accepted.contains(&report) =>
            {
                found.push(finding(Property::P5, w.at, format!("{report} is displayed and was never accepted")));
            }
            Any::Service(Event::Executed { command, kind, refused: None })
                if !timeline.operator_gave(command, kind, w.at) =>
            {
                let rogues = rogues.get(&command).map_or(&[][..], Vec::as_slice);
                // An id alone could be that of another command: kind and key decide too.
                let excused = rogues.iter().any(|rogue| stops_as_operator(evidence, command, kind, *rogue, w.at));
                if !excused {
                    let message = format!("{} {command} was executed and no operator gave it", kind.name());
                    found.push(finding(Property::P5, w.at, message));
                }
            }
            _ => {}
        }
    }
    found
}

/// True if a rogue stops the unit in the name of an operator who is admitted. A rogue who holds an operator's key may do so: no check
/// can tell it from that operator, and it is safe.
fn stops_as_operator(
    evidence: &Evidence,
    command: CommandId,
    executed: CommandKind,
    rogue: RogueCommand,
    executed_at: Micros,
) -> bool {
    let (kind, key) = rogue;
    executed == kind && kind.towards_safe() && command.operator == key && is_admitted(evidence, key, executed_at)
}

/// True if `operator` was one still within its validity, and the unit did not know of its revocation and need not have
/// known: the gateway has *Th* to bring it, after which a unit without messages holds.
fn is_admitted(evidence: &Evidence, operator: NodeId, time: Micros) -> bool {
    let until = evidence.operators.iter().find(|(known, _)| *known == operator).map(|(_, until)| *until);
    let th = evidence.bounds.to_hold_safe_ms * 1000;
    let struck = evidence.entries.iter().take_while(|w| w.at <= time).any(|w| match w.entry.event {
        Any::Service(Event::Struck { who }) if who == operator => match w.entry.node {
            node if node == evidence.under.node() => w.at < time,
            NodeId::GATEWAY => time - w.at > th,
            _ => false,
        },
        _ => false,
    });
    until.is_some_and(|until| time <= until.saturating_add(SLACK)) && !struck
}

fn accepted_ages(evidence: &Evidence) -> impl Iterator<Item = u64> {
    evidence.entries.iter().filter(|w| w.at <= evidence.duration).filter_map(|w| match w.entry.event {
        Any::Service(Event::Accepted { age: Some(age), .. }) => Some(age.0),
        _ => None,
    })
}
