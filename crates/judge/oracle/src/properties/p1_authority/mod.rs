//! P1: no act without authority, a fresh confirmation and all guards, from the plant's own record of the act; and no authority for
//! longer than it may live.

mod guards;

use std::collections::{BTreeMap, BTreeSet};

use evidence::{Plan, Planned};
use ground_truth::{Any, Note};
use wire::command::CommandKind;
use wire::event::Event;

use super::limit::{Limit, LimitRow, longest};
use super::{BareGuest, Finding, Property, finding, not_judged};
use crate::facts::{Facts, SLACK};

pub(super) const BARE_GUEST: BareGuest = BareGuest {
    check: not_judged,
    not_judged: Some(("P1", "authority is the state machine's, whose guards are waived")),
};

pub(super) const LIMITS: [LimitRow; 2] = [
    LimitRow {
        limit: Limit::Confirmation,
        name: "age of an act's confirmation",
        length_ms: Some(|bounds| bounds.command_limit_ms),
        approach: |facts, length_us| longest(confirmation_ages(facts), length_us),
    },
    LimitRow {
        limit: Limit::Authority,
        name: "authority held",
        length_ms: Some(|bounds| bounds.authority_ms),
        approach: |facts, length_us| longest(authority_times(facts), length_us),
    },
];

pub(super) fn check(facts: &Facts) -> Vec<Finding> {
    let mut found = acts_without_authority(facts);
    found.extend(authority_outlives(facts));
    found.extend(guards::check(facts));
    found
}

/// Acts without authority, without a confirmation in time, or with a guard that fails in the unit's own entry.
fn acts_without_authority(facts: &Facts) -> Vec<Finding> {
    let Facts { evidence, timeline, .. } = facts;
    let mut found = Vec::new();
    let guards_held: BTreeMap<u32, bool> = evidence
        .entries
        .iter()
        .filter_map(|w| match w.entry.event {
            Any::Service(Event::Acted { authority, failing, .. }) => Some((authority, failing.is_empty())),
            _ => None,
        })
        .collect();
    let mut used = BTreeSet::new();
    for w in &evidence.entries {
        let Any::Instrument(Note::PlantAct { authority, command, .. }) = w.entry.event else { continue };
        let minted = timeline.minted.iter().any(|(minted_at, serial, _)| *serial == authority && *minted_at <= w.at);
        let revoked = timeline.revoked.iter().any(|(revoked_at, serial)| *serial == authority && *revoked_at <= w.at);
        // Authority is for one act: a second under the same is one without authority.
        if !minted || revoked || !used.insert(authority) {
            found.push(finding(
                Property::P1,
                w.at,
                format!("act under authority {authority}: minted {minted}, revoked {revoked}"),
            ));
        }
        if guards_held.get(&authority) != Some(&true) {
            found.push(finding(Property::P1, w.at, "act with a failing guard, or none recorded"));
        }
        let limit = evidence.bounds.command_limit_ms * 1000 + SLACK;
        let confirmed = timeline.intended.iter().any(|(given_at, id, kind)| {
            *id == command && matches!(kind, CommandKind::Confirm(_)) && *given_at <= w.at && w.at - *given_at <= limit
        });
        if !confirmed {
            found.push(finding(Property::P1, w.at, format!("act on {command}, which no operator confirmed in time")));
        }
    }
    found
}

/// Authority that is held, unused, for longer than it may live. A unit that is kept from running cannot end it in time, nor use it.
fn authority_outlives(facts: &Facts) -> Vec<Finding> {
    let Facts { evidence, timeline, .. } = facts;
    let stops_unit = |plan: &Plan| matches!(plan.what, Planned::Suspend(node) | Planned::Kill(node) if node == evidence.under.node());
    if evidence.planned.iter().any(stops_unit) {
        return Vec::new();
    }
    let limit = (evidence.bounds.authority_ms + evidence.bounds.control_period_ms) * 1000 + SLACK;
    let long = timeline.authority_spans(evidence.duration).filter(|(from, to)| to.saturating_sub(*from) > limit);
    long.map(|(from, _)| {
        let message = format!("authority is held for longer than {} ms", evidence.bounds.authority_ms);
        finding(Property::P1, from + limit, message)
    })
    .collect()
}

fn confirmation_ages(facts: &Facts) -> impl Iterator<Item = u64> {
    facts.evidence.entries.iter().filter(|w| w.at <= facts.evidence.duration).filter_map(|w| match w.entry.event {
        Any::Instrument(Note::PlantAct { command, .. }) => {
            facts.timeline.given_at(command).map(|given_at| w.at.saturating_sub(given_at))
        }
        _ => None,
    })
}

fn authority_times(facts: &Facts) -> impl Iterator<Item = u64> {
    facts.timeline.authority_spans(facts.evidence.duration).map(|(from, to)| to.saturating_sub(from))
}
