//! The mission that a scenario presumes, compared with the one that took place.
//!
//! A loss of sensors is no evidence about a unit that never held authority. So the operator's steps before the attack have
//! to be done by the time at which the attack took hold, by its receipt; without an attack, by the end of the run. Later
//! steps need not be done: to prevent them may be the very attack. Witnesses are the unit's changes of mode, the authority
//! that it minted, the plant's record of the act and the plant's truth of the way; the reason that a step was not carried out is read from
//! the display. Progress along the route is `facts::progress`'s.

use evidence::{Evidence, Micros, Planned};
use ground_truth::{Any, Note};
use wire::command::CommandKind;
use wire::event::{Event, Freshness};
use wire::id::{CommandId, NodeId};
use wire::mode::Mode;

use crate::facts::progress;
use crate::facts::timeline::{Timeline, is_nominal};
use evidence::mission::{Carried, Due, Mission, Stage, Verb};

/// Time from the operator's look at the display to the execution of an order. An attack that may begin sooner after a
/// step was due may be meant to prevent it.
const ORDER_WAY: Micros = 500_000;
/// Difference that the console's clock may have to the run's.
const CLOCKS: Micros = 500_000;

/// Mission of a run compared with the presumed one. Parts that are missing at `zero`, the time at which the attack took
/// hold, are listed.
pub(super) fn compared(evidence: &Evidence, timeline: &Timeline, zero: Option<Micros>) -> Mission {
    let steps = carried_steps(evidence, timeline);
    let until = zero.unwrap_or(evidence.duration);
    let presumed = presumed_stage(evidence);
    let acted =
        evidence.entries.iter().find(|w| matches!(w.entry.event, Any::Instrument(Note::PlantAct { .. }))).map(|w| w.at);
    let reached = |time: Option<Micros>| time.is_some_and(|time| time <= until);
    let armed = timeline.minted.first().map(|(minted_at, ..)| *minted_at);
    let stages = [
        (Stage::Enabled, reached(timeline.first_change(0, |c| is_nominal(c.to)).map(|c| c.at))),
        (Stage::Armed, reached(armed)),
        (Stage::Acted, reached(acted)),
    ];
    let first_missing =
        stages.into_iter().find(|(stage, was_reached)| *stage <= presumed && !was_reached).map(|(stage, _)| stage);
    let mut missing: Vec<String> = first_missing.map(|stage| missing_stage(stage, until, &steps)).into_iter().collect();
    missing.extend(undone_steps(evidence, until, &steps));
    Mission {
        required: presumed,
        missing,
        armed_ms: armed.map(ms),
        acted_ms: acted.map(ms),
        driven_m: driven_m(evidence),
        nominal_s: timeline.nominal_until(evidence.duration) as f64 / 1e6,
        progress: progress::along_route(evidence, timeline),
        steps,
    }
}

/// Time at which the first action may happen that is no part of the mission; none without an attack.
fn attack_begins(evidence: &Evidence) -> Option<Micros> {
    // A step has no time in the plan: its actions have.
    let actions = evidence.planned.iter().filter(|plan| !matches!(plan.what, Planned::Step(_)));
    actions.map(|plan| plan.from).min()
}

/// True if a step was to be done before the attack.
fn is_due_before_attack(evidence: &Evidence, due: Micros) -> bool {
    due.saturating_add(ORDER_WAY) <= attack_begins(evidence).unwrap_or(evidence.duration)
}

/// Stage that the scenario states, or that the steps before the attack lead to.
fn presumed_stage(evidence: &Evidence) -> Stage {
    let before = evidence
        .script
        .steps
        .iter()
        .filter(|step| is_due_before_attack(evidence, step.at_us.saturating_add(step.after_us)));
    let derived = before.map(|step| Stage::from_verb(step.verb)).max().unwrap_or_default();
    evidence.script.mission.unwrap_or(derived)
}

/// Remark on a stage that is missing, with the step that should have led to it.
fn missing_stage(stage: Stage, until: Micros, steps: &[Carried]) -> String {
    let step = steps.iter().find(|step| Stage::from_verb(step.verb) == stage);
    let step_remark = step.map(|step| match (step.done_ms, &step.reason) {
        (Some(done_ms), _) => format!("; {} at {done_ms:.0} ms", step.verb.name()),
        (None, reason) => {
            format!(
                "; {}, due at {:.0} ms: never, {}",
                step.verb.name(),
                step.due_ms,
                reason.as_deref().unwrap_or("unknown")
            )
        }
    });
    format!("{} by {} ms is presumed and did not come{}", stage.name(), until / 1000, step_remark.unwrap_or_default())
}

/// Steps that are no stage of the mission and were to be done before the attack: it waited for them.
fn undone_steps<'a>(evidence: &Evidence, until: Micros, steps: &'a [Carried]) -> impl Iterator<Item = String> + 'a {
    let attacked = attack_begins(evidence).is_some() && evidence.script.mission.is_none();
    let before: Vec<bool> = evidence
        .script
        .steps
        .iter()
        .map(|step| attacked && is_due_before_attack(evidence, step.at_us.saturating_add(step.after_us)))
        .collect();
    let other_steps =
        steps.iter().zip(before).filter(|(step, before)| *before && Stage::from_verb(step.verb) == Stage::None);
    other_steps.filter(move |(step, _)| step.done_ms.is_none_or(|done_ms| done_ms > ms(until))).map(|(step, _)| {
        let reason = step.reason.as_deref().unwrap_or("too late");
        format!("{}, due at {:.0} ms before the attack: never, {reason}", step.verb.name(), step.due_ms)
    })
}

/// Steps of the script, each with its execution or the reason that there was none.
fn carried_steps(evidence: &Evidence, timeline: &Timeline) -> Vec<Carried> {
    let mut matched: Vec<CommandId> = Vec::new();
    let steps = &evidence.script.steps;
    let each = steps.iter().enumerate().map(|(n, step)| {
        // A repeated order belongs to this step until the next step of its kind is due.
        let next = steps[n + 1..].iter().find(|other| other.verb == step.verb);
        let until = next.map_or(Micros::MAX, |next| next.at_us.saturating_sub(CLOCKS));
        let from = step.at_us.saturating_sub(CLOCKS);
        let belongs = |(given_at, id, kind): &&(Micros, CommandId, CommandKind)| {
            matches_verb(step.verb, *kind) && (from..until).contains(given_at) && !matched.contains(id)
        };
        let last = step.at_us.saturating_add(step.within_us).saturating_add(CLOCKS);
        let mut ids: Vec<(Micros, CommandId)> =
            timeline.intended.iter().filter(belongs).map(|(given_at, id, _)| (*given_at, *id)).collect();
        // An order after the step's time was not given for this step: the step was not carried out in time.
        if ids.first().is_none_or(|(given_at, _)| *given_at > last) {
            ids.clear();
        }
        matched.extend(ids.iter().map(|(_, id)| *id));
        let done = timeline
            .executed
            .iter()
            .find(|(_, id, _)| ids.iter().any(|(_, own_id)| own_id == id))
            .map(|(executed_at, ..)| *executed_at);
        let reason = done.is_none().then(|| match ids.first() {
            Some((given_at, _)) => not_executed(evidence, *given_at, &ids),
            None => not_given(evidence, step, last),
        });
        Carried { verb: step.verb, due_ms: ms(step.at_us), done_ms: done.map(ms), reason }
    });
    each.collect()
}

/// Reason that an order that was given was not executed.
fn not_executed(evidence: &Evidence, given_at: Micros, ids: &[(Micros, CommandId)]) -> String {
    let refused = evidence.entries.iter().find_map(|w| match w.entry.event {
        Any::Service(Event::Executed { command, refused: Some(reason), .. })
            if ids.iter().any(|(_, id)| *id == command) =>
        {
            Some(reason)
        }
        _ => None,
    });
    match refused {
        Some(reason) => format!("given at {} ms, refused by the unit: {}", given_at / 1000, reason.name()),
        None => format!("given at {} ms, not executed", given_at / 1000),
    }
}

/// Reason that an order was not given: the condition of its step that was never displayed while it waited.
fn not_given(evidence: &Evidence, step: &Due, until: Micros) -> String {
    let shown = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Service(Event::Displayed { unit, mode, freshness: Freshness::Fresh, authority, .. })
            if unit == evidence.under.unit && w.entry.node == NodeId::CONSOLE && w.at <= until =>
        {
            Some((w.at, mode, authority.is_some()))
        }
        _ => None,
    });
    let shown: Vec<(Micros, Mode, bool)> = shown.collect();
    // The last display before it was due stands then, too.
    let first = shown.partition_point(|(shown_at, ..)| *shown_at <= step.at_us).saturating_sub(1);
    let shown_while_due = &shown[first..];
    let in_mode = |wanted: Mode| shown_while_due.iter().any(|(_, mode, _)| *mode == wanted);
    match (step.mode.filter(|wanted| !in_mode(*wanted)), step.track) {
        _ if shown_while_due.is_empty() => "the unit not shown as fresh".to_owned(),
        (Some(mode), _) => format!("{} not shown", mode.name()),
        (None, _) if step.verb == Verb::Confirm && !shown_while_due.iter().any(|(.., held)| *held) => {
            "no authority shown".to_owned()
        }
        (None, Some(class)) => format!("no {} shown", class.name()),
        (None, None) => "not given".to_owned(),
    }
}

fn matches_verb(verb: Verb, kind: CommandKind) -> bool {
    match verb {
        Verb::Enable => kind == CommandKind::Enable,
        Verb::Arm => matches!(kind, CommandKind::Arm(_)),
        Verb::Confirm => matches!(kind, CommandKind::Confirm(_)),
        Verb::Hold => kind == CommandKind::Hold,
        Verb::Resume => kind == CommandKind::Resume,
        Verb::Disarm => kind == CommandKind::Disarm,
        Verb::Configure => matches!(kind, CommandKind::Configure(_)),
        Verb::Revoke => false,
    }
}

/// The way that the plant went, by its truth, metres.
fn driven_m(evidence: &Evidence) -> f64 {
    let places = evidence.entries.iter().filter(|w| w.at <= evidence.duration).filter_map(|w| match w.entry.event {
        Any::Instrument(Note::Truth { unit, x_mm, y_mm, .. }) if unit == evidence.under.unit => {
            Some((f64::from(x_mm), f64::from(y_mm)))
        }
        _ => None,
    });
    let places: Vec<(f64, f64)> = places.collect();
    let distance = |a: (f64, f64), b: (f64, f64)| ((a.0 - b.0).powi(2) + (a.1 - b.1).powi(2)).sqrt();
    places.windows(2).map(|pair| distance(pair[0], pair[1])).sum::<f64>() / 1000.0
}

fn ms(time: Micros) -> f64 {
    time as f64 / 1000.0
}
