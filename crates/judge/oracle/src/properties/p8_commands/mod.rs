//! P8: a command is executed at most once, never late, and none with a time tag outside its window; and an execution has its effect.

mod effect;

use std::collections::{BTreeMap, BTreeSet};

use evidence::{Evidence, Micros};
use ground_truth::Any;
use wire::command::CommandKind;
use wire::event::Event;
use wire::id::NodeId;

use super::limit::{Limit, LimitRow, longest};
use super::{BareGuest, Finding, Property, finding};
use crate::facts::{Facts, SLACK};

pub(super) const BARE_GUEST: BareGuest = BareGuest { check: wrong_executions, not_judged: None };

pub(super) const LIMITS: [LimitRow; 1] = [LimitRow {
    limit: Limit::Order,
    name: "lateness of an order",
    length_ms: Some(|bounds| bounds.command_limit_ms),
    approach: |facts, length_us| longest(execution_delays(facts), length_us),
}];

pub(super) fn check(facts: &Facts) -> Vec<Finding> {
    let mut found = effect::check(facts);
    found.extend(wrong_executions(facts));
    found.extend(orders_before_lost_session(facts.evidence));
    found
}

/// Executions that are repeated, late, early, or of an order that is void.
fn wrong_executions(facts: &Facts) -> Vec<Finding> {
    let Facts { evidence, timeline, .. } = facts;
    let limit = evidence.bounds.command_limit_ms * 1000 + SLACK;
    let mut executed_ids = BTreeSet::new();
    let mut found = Vec::new();
    for (executed_at, id, kind) in &timeline.executed {
        if !executed_ids.insert(*id) {
            found.push(finding(Property::P8, *executed_at, format!("{} {id} executed again", kind.name())));
        }
        // An execution of an order that no operator gave is a finding of P5.
        let Some(given_at) = timeline.given_at(*id) else { continue };
        let due = timeline.order_due(*id, given_at);
        // A time tag counts from a nonce that may have been issued earlier than the order was given, by the limit at most.
        let window = timeline.time_tags.get(id).map_or(limit, |(_, window)| window.saturating_add(SLACK));
        // A stored order to stop is made up for, and P3 judges its delay.
        let window = if timeline.stored.contains_key(id) && kind.towards_safe() { Micros::MAX } else { window };
        if executed_at.saturating_sub(due) > window {
            let message = format!("{} {id} executed more than {} ms late", kind.name(), window / 1000);
            found.push(finding(Property::P8, *executed_at, message));
        }
        let mut stored = timeline.stored.get(id).into_iter().filter(|_| !kind.towards_safe());
        let holds =
            timeline.executed.iter().filter(|(.., kind)| *kind == CommandKind::Hold).map(|(held_at, ..)| *held_at);
        let voided: Vec<Micros> = timeline.changes.iter().map(|c| c.at).chain(holds).collect();
        if stored
            .any(|stored_at| voided.iter().any(|voided_at| voided_at > stored_at && voided_at + SLACK < *executed_at))
        {
            let message = format!("{} {id} executed though the mode has changed or a hold has come since", kind.name());
            found.push(finding(Property::P8, *executed_at, message));
        }
        if executed_at.saturating_add(limit) < due {
            let message = format!("{} {id} executed {} ms before it was due", kind.name(), (due - executed_at) / 1000);
            found.push(finding(Property::P8, *executed_at, message));
        }
    }
    found
}

/// Orders away from safe that were given before the unit's session was lost, and executed after.
fn orders_before_lost_session(evidence: &Evidence) -> Vec<Finding> {
    let mut intended_at = BTreeMap::new();
    let mut found = Vec::new();
    let mut last_loss = None;
    for w in &evidence.entries {
        match w.entry.event {
            Any::Service(Event::Intended { command, .. }) if w.entry.node == NodeId::CONSOLE => {
                intended_at.insert(command, w.at);
            }
            Any::Service(Event::SessionLost { .. }) if w.entry.node == evidence.under.node() => last_loss = Some(w.at),
            Any::Service(Event::Executed { command, kind, refused: None }) if w.entry.node == evidence.under.node() => {
                // A session may be lost to a thief, and its owner cannot tell that from a cut: every order under way is void.
                let before =
                    intended_at.get(&command).zip(last_loss).is_some_and(|(intended_at, lost)| *intended_at < lost);
                if before && !kind.towards_safe() {
                    let message = format!("{command} was given before the session was lost, and is executed after");
                    found.push(finding(Property::P8, w.at, message));
                }
            }
            _ => {}
        }
    }
    found
}

/// Delay of each executed order, microseconds.
fn execution_delays(facts: &Facts) -> impl Iterator<Item = u64> {
    let timeline = &facts.timeline;
    let executed = timeline.executed.iter().filter(|(executed_at, ..)| *executed_at <= facts.evidence.duration);
    executed.filter_map(|(executed_at, id, _)| {
        Some(executed_at.saturating_sub(timeline.order_due(*id, timeline.given_at(*id)?)))
    })
}
