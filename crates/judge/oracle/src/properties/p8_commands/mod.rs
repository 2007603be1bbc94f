//! P8: a command is executed at most once, never late, and none with a time tag outside its window; and an execution has its effect.

mod effect;

use std::collections::{BTreeMap, BTreeSet};

use evidence::{Evidence, Micros};
use ground_truth::Any;
use wire::command::CommandKind;
use wire::event::Event;

use super::limit::{Limit, LimitRow, longest};
use super::{BareGuest, Finding, Property, finding};
use crate::facts::{Facts, SLACK};

pub(super) const BARE_GUEST: BareGuest = BareGuest { check: executions, not_judged: None };

pub(super) const LIMITS: [LimitRow; 1] = [LimitRow {
    limit: Limit::Order,
    name: "lateness of an order",
    length_ms: Some(|bounds| bounds.command_limit_ms),
    approach: |facts, length_us| longest(delays(facts), length_us),
}];

pub(super) fn check(facts: &Facts) -> Vec<Finding> {
    let mut found = effect::check(facts);
    found.extend(executions(facts));
    found.extend(orders_before_lost_session(facts.evidence));
    found
}

/// Executions that are repeated, late, early, or of an order that is void.
fn executions(facts: &Facts) -> Vec<Finding> {
    let Facts { evidence, timeline, .. } = facts;
    let limit = evidence.bounds.command_limit_ms * 1000 + SLACK;
    let mut once = BTreeSet::new();
    let mut found = Vec::new();
    for (at, id, kind) in &timeline.executed {
        if !once.insert(*id) {
            found.push(finding(Property::P8, *at, format!("{} {id} executed again", kind.name())));
        }
        let Some(given) = timeline.given_at(*id) else { continue };
        let due = timeline.order_due(*id, given);
        // A time tag counts from a nonce that may have been issued earlier than the order was given, by the limit at most.
        let within = timeline.time_tags.get(id).map_or(limit, |(_, within)| within.saturating_add(SLACK));
        // A stored order to stop is made up for, and P3 judges its delay.
        let within = if timeline.stored.contains_key(id) && kind.towards_safe() { Micros::MAX } else { within };
        if at.saturating_sub(due) > within {
            let what = format!("{} {id} executed more than {} ms late", kind.name(), within / 1000);
            found.push(finding(Property::P8, *at, what));
        }
        let mut stored = timeline.stored.get(id).into_iter().filter(|_| !kind.towards_safe());
        let holds = timeline.executed.iter().filter(|(.., kind)| *kind == CommandKind::Hold).map(|(at, ..)| *at);
        let voided: Vec<Micros> = timeline.changes.iter().map(|c| c.at).chain(holds).collect();
        if stored.any(|stored| voided.iter().any(|change| change > stored && change + SLACK < *at)) {
            let what = format!("{} {id} executed though the mode has changed or a hold has come since", kind.name());
            found.push(finding(Property::P8, *at, what));
        }
        if at.saturating_add(limit) < due {
            let what = format!("{} {id} executed {} ms before it was due", kind.name(), (due - at) / 1000);
            found.push(finding(Property::P8, *at, what));
        }
    }
    found
}

/// Orders away from safe that were given before the unit's session was lost, and executed after.
fn orders_before_lost_session(evidence: &Evidence) -> Vec<Finding> {
    let mut given = BTreeMap::new();
    let mut found = Vec::new();
    let mut last_loss = None;
    for w in &evidence.entries {
        match w.entry.event {
            Any::Service(Event::Intended { command, .. }) => {
                given.insert(command, w.at);
            }
            Any::Service(Event::SessionLost { .. }) if w.entry.node == evidence.under.node() => last_loss = Some(w.at),
            Any::Service(Event::Executed { command, kind, refused: None }) if w.entry.node == evidence.under.node() => {
                let before = given.get(&command).zip(last_loss).is_some_and(|(given, lost)| *given < lost);
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

/// Delay of each executed order, microseconds.
fn delays(facts: &Facts) -> impl Iterator<Item = u64> {
    let timeline = &facts.timeline;
    let executed = timeline.executed.iter().filter(|(at, ..)| *at <= facts.evidence.duration);
    executed.filter_map(|(at, id, _)| Some(at.saturating_sub(timeline.order_due(*id, timeline.given_at(*id)?))))
}
