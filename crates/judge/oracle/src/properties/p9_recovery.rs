//! P9: HOLD_SAFE ends by an operator's Resume only; PREPARE_TO_ACT begins by a new Arm only; DEGRADED lasts its least time; and the plant
//! is at rest in IDLE.
//!
//! Consent takes both: the unit's execution of a command, and an operator's order of that kind.

use evidence::Micros;
use wire::command::CommandKind;
use wire::mode::{Cause, Mode};

use super::limit::{Limit, LimitRow, millionths};
use super::{BareGuest, Finding, Property, finding, speed};
use crate::facts::{Facts, SLACK};

pub(super) const BARE_GUEST: BareGuest = BareGuest {
    check: |facts| speed::check(facts, Property::P9),
    not_judged: Some(("P9 by mode", "recovery is the state machine's; standing still in IDLE is judged at the plant")),
};

pub(super) const LIMITS: [LimitRow; 1] = [LimitRow {
    limit: Limit::Recovery,
    name: "DEGRADED ended early",
    length_ms: Some(|bounds| bounds.hysteresis_ms),
    // The only limit that is approached from above.
    approach: |facts, length_us| recovery_times(facts).map(|took| millionths(length_us, took)).max(),
}];

pub(super) fn check(facts: &Facts) -> Vec<Finding> {
    let mut found = speed::check(facts, Property::P9);
    found.extend(changes_of_mode(facts));
    found
}

fn changes_of_mode(facts: &Facts) -> Vec<Finding> {
    let Facts { evidence, timeline, .. } = facts;
    let consented = |wanted: fn(&CommandKind) -> bool, from: Micros, to: Micros| {
        let mut near = timeline
            .executed
            .iter()
            .filter(|(executed_at, ..)| *executed_at + SLACK >= from && *executed_at <= to + SLACK);
        near.any(|(executed_at, id, kind)| wanted(kind) && timeline.operator_gave(*id, *kind, *executed_at))
    };
    let resume = |kind: &CommandKind| matches!(kind, CommandKind::Resume);
    let enable = |kind: &CommandKind| matches!(kind, CommandKind::Enable);
    let arm = |kind: &CommandKind| matches!(kind, CommandKind::Arm(_));
    let mut found = Vec::new();
    for change in &timeline.changes {
        let earliest = change.at.saturating_sub(SLACK);
        // A restarted unit is IDLE whatever it was before, and needs an order to leave IDLE.
        let left_hold = change.from == Mode::HoldSafe && change.to != Mode::HoldSafe && change.cause != Cause::Start;
        if left_hold && !(change.cause == Cause::Operator && consented(resume, earliest, change.at)) {
            found.push(finding(Property::P9, change.at, "HOLD_SAFE left without an operator's resume"));
        }
        let least = (evidence.bounds.hysteresis_ms * 1000).saturating_sub(SLACK);
        if change.cause == Cause::Recovered && change.at - timeline.degraded_since(change.at) < least {
            let message = format!("DEGRADED left after less than {} ms", evidence.bounds.hysteresis_ms);
            found.push(finding(Property::P9, change.at, message));
        }
        // A stop is safe from any mode.
        let left_idle = change.from == Mode::Idle && !matches!(change.to, Mode::Idle | Mode::HoldSafe);
        if left_idle && !(change.cause == Cause::Operator && consented(enable, earliest, change.at)) {
            found.push(finding(Property::P9, change.at, "IDLE left without an operator's enable"));
        }
        if change.to == Mode::PrepareToAct && !(change.cause == Cause::Operator && consented(arm, earliest, change.at))
        {
            found.push(finding(Property::P9, change.at, "PREPARE_TO_ACT entered without an operator's arm"));
        }
    }
    found
}

/// Duration of each DEGRADED that ended because all was well, microseconds.
fn recovery_times(facts: &Facts) -> impl Iterator<Item = u64> {
    let timeline = &facts.timeline;
    let recovered = timeline.changes.iter().filter(|c| c.cause == Cause::Recovered);
    recovered.map(|change| change.at - timeline.degraded_since(change.at))
}
