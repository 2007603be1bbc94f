//! P5: displays, executions and findings against a teammate came from accepted records and the operator's
//! own intents. The display of a unit is that unit's own report.
//!
//! These are the influences that have a name in the log. Other influences of a refused record show only in their
//! effects: in the pose (`place`), in modes and at the plant (`effect`, `speed`).

use std::collections::{BTreeMap, BTreeSet};

use evidence::{Evidence, Finding, Micros, Property};
use instrument::{Any, Note};
use wire::command::CommandKind;
use wire::event::{Event, Freshness};
use wire::id::{CommandId, NodeId, RecordId};

use crate::SLACK;
use crate::finding;
use crate::timeline::Timeline;

/// A command that a rogue gave: its kind, and the owner of its key.
type Rogue = (CommandKind, NodeId);

/// Judges P5.
pub(crate) fn check(evidence: &Evidence, line: &Timeline) -> Vec<Finding> {
    let mut accepted: BTreeSet<RecordId> = BTreeSet::new();
    let mut rogues: BTreeMap<CommandId, Vec<Rogue>> = BTreeMap::new();
    let mut at_unit: BTreeSet<RecordId> = BTreeSet::new();
    let mut found = Vec::new();
    for w in &evidence.entries {
        match w.entry.event {
            Any::Service(Event::Accepted { record, .. }) if w.entry.node == NodeId::GATEWAY => {
                accepted.insert(record);
            }
            Any::Service(Event::Accepted { record, .. }) if w.entry.node == evidence.under.node() => {
                at_unit.insert(record);
            }
            Any::Service(Event::Inconsistent { unit, record, .. })
                if w.entry.node == evidence.under.node() && !at_unit.contains(&record) =>
            {
                let what = format!("{} is found out by {record}, which the unit never accepted", unit.node());
                found.push(finding(Property::P5, w.at, what));
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
            Any::Service(Event::Executed { command, kind, refused: None }) if !line.gave(command, kind, w.at) => {
                let rogues = rogues.get(&command).map_or(&[][..], Vec::as_slice);
                let excused = rogues.iter().any(|rogue| stops(evidence, command, kind, *rogue, w.at));
                if !excused {
                    let what = format!("{} {command} was executed and no operator gave it", kind.name());
                    found.push(finding(Property::P5, w.at, what));
                }
            }
            _ => {}
        }
    }
    found
}

/// A rogue who holds an operator's key may stop the unit in that operator's name while the operator is admitted: no check
/// can tell it from that operator, and it is safe.
fn stops(evidence: &Evidence, command: CommandId, executed: CommandKind, rogue: Rogue, at: Micros) -> bool {
    let (kind, key) = rogue;
    executed == kind && kind.towards_safe() && command.operator == key && admitted(evidence, key, at)
}

/// True if `who` was an operator still within its validity, and the unit did not know of its revocation and need not have
/// known: the gateway has *Th* to bring it, after which a unit without messages holds.
fn admitted(evidence: &Evidence, who: NodeId, at: Micros) -> bool {
    let until = evidence.operators.iter().find(|(operator, _)| *operator == who).map(|(_, until)| *until);
    let th = evidence.bounds.to_hold_safe_ms * 1000;
    let struck = evidence.entries.iter().take_while(|w| w.at <= at).any(|w| match w.entry.event {
        Any::Service(Event::Struck { who: struck }) if struck == who => match w.entry.node {
            node if node == evidence.under.node() => w.at < at,
            NodeId::GATEWAY => at - w.at > th,
            _ => false,
        },
        _ => false,
    });
    until.is_some_and(|until| at <= until.saturating_add(SLACK)) && !struck
}
