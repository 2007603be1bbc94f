//! Effects of executions, beyond the unit's word on them: the effect is looked for in the unit's modes and
//! at its plant, and an effect seen there has to go back to an execution.
//!
//! A HOLD holds and its plant stands, until an operator lets the unit go on; a DISARM leaves no authority; a change of mode
//! for the sake of a command goes with one execution of that command; the plant acts once on a command. That a command away
//! from safe had its effect is not asked: a unit may always do less.

use std::collections::BTreeSet;

use evidence::{Evidence, Micros};
use ground_truth::{Any, Note};
use wire::command::CommandKind;
use wire::event::Event;
use wire::id::CommandId;
use wire::mode::{Because, Cause, Mode};

use super::{Finding, Property, finding};
use crate::facts::braking::{braked_to, set_point_lapsed};
use crate::facts::motion::STANDING;
use crate::facts::timeline::Timeline;
use crate::facts::{Facts, SLACK, process};

/// Executions without their effect, and effects without an execution.
pub(super) fn check(facts: &Facts) -> Vec<Finding> {
    let Facts { evidence, timeline, .. } = facts;
    let mut found = Vec::new();
    for (executed_at, id, kind) in &timeline.executed {
        found.extend(match kind {
            CommandKind::Hold => hold_without_effect(evidence, timeline, *executed_at, *id),
            CommandKind::Disarm => disarm_without_effect(timeline, *executed_at, *id),
            CommandKind::Enable
            | CommandKind::Resume
            | CommandKind::Arm(_)
            | CommandKind::Confirm(_)
            | CommandKind::Configure(_) => None,
        });
    }
    found.extend(changes_without_execution(evidence, timeline));
    found.extend(acted_twice(evidence));
    found
}

fn hold_without_effect(
    evidence: &Evidence,
    timeline: &Timeline,
    executed_at: Micros,
    id: CommandId,
) -> Option<Finding> {
    if !timeline.was_in(Mode::HoldSafe, executed_at.saturating_sub(SLACK), executed_at + SLACK) {
        let mode = timeline.mode_at(executed_at + SLACK).name();
        return Some(finding(Property::P8, executed_at, format!("{id}, a hold, is executed and the unit is {mode}")));
    }
    let goes_on = |kind: &CommandKind| matches!(kind, CommandKind::Resume | CommandKind::Enable);
    let resumed =
        timeline.executed.iter().find(|(time, _, kind)| *time > executed_at && goes_on(kind)).map(|(time, ..)| *time);
    let started = timeline.first_change(executed_at + 1, |c| c.cause == Cause::Start).map(|c| c.at);
    let until = resumed.into_iter().chain(started).min().unwrap_or(Micros::MAX);
    let due = set_point_lapsed(evidence, executed_at);
    let slow = braked_to(evidence, due, STANDING);
    let drives = timeline
        .truth
        .iter()
        .filter(|t| t.at < until)
        .find(|t| t.at >= due && !t.asked_safe || t.at >= slow && !t.safe)?;
    let message = format!("{id}, a hold, is executed and the plant goes {} mm/s", drives.speed.max(drives.set_speed));
    Some(finding(Property::P8, drives.at, message))
}

fn disarm_without_effect(timeline: &Timeline, executed_at: Micros, id: CommandId) -> Option<Finding> {
    let due = executed_at + SLACK;
    // A new order may have given authority again since.
    let minted_anew = timeline.minted.iter().any(|(minted_at, ..)| *minted_at > executed_at && *minted_at <= due);
    let message = || format!("{id}, a disarm, is executed and authority is still held");
    (timeline.held_authority_at(due) && !minted_anew).then(|| finding(Property::P8, due, message()))
}

/// Changes of mode for the sake of a command that the unit does not say it executed then, or more than one for one command. The last
/// words of a dying unit are lost with it.
fn changes_without_execution(evidence: &Evidence, timeline: &Timeline) -> Vec<Finding> {
    let dead = process::dead_spans(evidence, evidence.under.node());
    let mut obeyed = BTreeSet::new();
    let mut found = Vec::new();
    for w in evidence.entries.iter().filter(|w| w.entry.node == evidence.under.node()) {
        let Any::Service(Event::Transition { to, because: Because::Command(id), .. }) = w.entry.event else { continue };
        let executed = timeline
            .executed
            .iter()
            .any(|(executed_at, command, _)| *command == id && executed_at.abs_diff(w.at) <= SLACK);
        let died = dead.iter().any(|(from, _)| (w.at..=w.at + SLACK).contains(from));
        if !executed && !died {
            let message = format!("{} for {id}, of which no execution is on record", to.name());
            found.push(finding(Property::P8, w.at, message));
        }
        if !obeyed.insert(id) {
            found.push(finding(Property::P8, w.at, format!("{} for {id}, which changed the mode before", to.name())));
        }
    }
    found
}

/// Commands on which the plant acts more than once.
fn acted_twice(evidence: &Evidence) -> Vec<Finding> {
    let mut acted_on = BTreeSet::new();
    let acts = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Instrument(Note::PlantAct { command, .. }) if w.entry.node == evidence.under.sim => Some((w.at, command)),
        _ => None,
    });
    let repeated = acts.filter(|(_, command)| !acted_on.insert(*command));
    repeated.map(|(acted_at, id)| finding(Property::P8, acted_at, format!("the plant acts on {id} again"))).collect()
}
