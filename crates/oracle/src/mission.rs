//! The mission that a scenario presumes, compared with the one that took place.
//!
//! A loss of sensors is no evidence about a unit that never held authority. So the operator's steps before the attack have
//! to be done by the time at which the attack took hold, by its receipt; without an attack, by the end of the run. Later
//! steps are not owed: to prevent them may be the very attack. Witnesses are the unit's changes of mode, the authority
//! that it minted, the plant's record of the act and the plant's truth of the way; the reason that a step was not carried out is told from
//! the display. The success of the mission is `properties`' to judge, and its progress `progress`'.

use evidence::{Evidence, Micros, Planned};
use instrument::{Any, Note};
use wire::command::CommandKind;
use wire::event::{Event, Freshness};
use wire::id::{CommandId, NodeId};
use wire::mode::Mode;

use super::Timeline;
use super::arrived::Receipt;
use super::progress;
use evidence::mission::{Carried, Due, Mission, Stage, Verb};

/// Time of an order from the operator's look at the display until it is executed. An attack that may begin sooner after a
/// step was due may be meant to prevent it.
const WAY: Micros = 500_000;
/// By how much the console's clock may be off the run's.
const CLOCKS: Micros = 500_000;

/// Progress of the mission of a run, and its missing parts.
pub(super) fn of(evidence: &Evidence, line: &Timeline, receipt: &Receipt) -> Mission {
    let steps = carried(evidence, line);
    let until = receipt.zero.unwrap_or(evidence.duration);
    let owed = owed(evidence);
    let acted =
        evidence.entries.iter().find(|w| matches!(w.entry.event, Any::Instrument(Note::PlantAct { .. }))).map(|w| w.at);
    let reached = |at: Option<Micros>| at.is_some_and(|at| at <= until);
    let ready = |m: Mode| matches!(m, Mode::Ready | Mode::PrepareToAct);
    let armed = line.minted.first().map(|(at, ..)| *at);
    let stages = [
        (Stage::Enabled, reached(line.first_change(0, |c| ready(c.to)).map(|c| c.at))),
        (Stage::Armed, reached(armed)),
        (Stage::Acted, reached(acted)),
    ];
    let short = stages.into_iter().find(|(stage, came)| *stage <= owed && !came).map(|(stage, _)| stage);
    let mut missing: Vec<String> = short.map(|stage| short_of(stage, until, &steps)).into_iter().collect();
    missing.extend(undone(evidence, until, &steps));
    Mission {
        owed,
        missing,
        armed_ms: armed.map(ms),
        acted_ms: acted.map(ms),
        driven_m: driven(evidence),
        nominal_s: line.nominal(evidence.duration) as f64 / 1e6,
        progress: progress::of(evidence, line),
        steps,
    }
}

/// Time at which the first action may happen that is no part of the mission; none without an attack.
fn attacked(evidence: &Evidence) -> Option<Micros> {
    // A step has no time of its own: its parts do.
    let deeds = evidence.planned.iter().filter(|plan| !matches!(plan.what, Planned::Step(_)));
    deeds.map(|plan| plan.from).min()
}

/// True if a step was to be done before the attack.
fn is_before(evidence: &Evidence, at: Micros) -> bool {
    at.saturating_add(WAY) <= attacked(evidence).unwrap_or(evidence.duration)
}

fn owed(evidence: &Evidence) -> Stage {
    let before =
        evidence.script.steps.iter().filter(|step| is_before(evidence, step.at_us.saturating_add(step.after_us)));
    let derived = before.map(|step| Stage::of(step.verb)).max().unwrap_or_default();
    evidence.script.mission.unwrap_or(derived)
}

/// That this stage is missing, and of which step that came.
fn short_of(stage: Stage, until: Micros, steps: &[Carried]) -> String {
    let step = steps.iter().find(|step| Stage::of(step.verb) == stage);
    let told = step.map(|step| match (step.done_ms, &step.why) {
        (Some(at), _) => format!("; {} at {at:.0} ms", step.verb.name()),
        (None, why) => {
            format!(
                "; {}, due at {:.0} ms: never, {}",
                step.verb.name(),
                step.due_ms,
                why.as_deref().unwrap_or("unknown")
            )
        }
    });
    format!("{} by {} ms is presumed and did not come{}", stage.name(), until / 1000, told.unwrap_or_default())
}

/// Steps that are no stage of the mission and were to be done before the attack: it waited for them.
fn undone<'a>(evidence: &Evidence, until: Micros, steps: &'a [Carried]) -> impl Iterator<Item = String> + 'a {
    let attacked = attacked(evidence).is_some() && evidence.script.mission.is_none();
    let before: Vec<bool> = evidence
        .script
        .steps
        .iter()
        .map(|step| attacked && is_before(evidence, step.at_us.saturating_add(step.after_us)))
        .collect();
    let others = steps.iter().zip(before).filter(|(step, before)| *before && Stage::of(step.verb) == Stage::None);
    others.filter(move |(step, _)| step.done_ms.is_none_or(|at| at > ms(until))).map(|(step, _)| {
        let why = step.why.as_deref().unwrap_or("too late");
        format!("{}, due at {:.0} ms before the attack: never, {why}", step.verb.name(), step.due_ms)
    })
}

fn carried(evidence: &Evidence, line: &Timeline) -> Vec<Carried> {
    let mut taken: Vec<CommandId> = Vec::new();
    let steps = &evidence.script.steps;
    let each = steps.iter().enumerate().map(|(n, step)| {
        // What is asked for once more is of this step until the next of its kind is due.
        let next = steps[n + 1..].iter().find(|other| other.verb == step.verb);
        let until = next.map_or(Micros::MAX, |next| next.at_us.saturating_sub(CLOCKS));
        let from = step.at_us.saturating_sub(CLOCKS);
        let is_its = |(at, id, kind): &&(Micros, CommandId, CommandKind)| {
            is(step.verb, *kind) && (from..until).contains(at) && !taken.contains(id)
        };
        let last = step.at_us.saturating_add(step.within_us).saturating_add(CLOCKS);
        let mut ids: Vec<(Micros, CommandId)> =
            line.intended.iter().filter(is_its).map(|(at, id, _)| (*at, *id)).collect();
        if ids.first().is_none_or(|(at, _)| *at > last) {
            ids.clear();
        }
        taken.extend(ids.iter().map(|(_, id)| *id));
        let done = line.executed.iter().find(|(_, id, _)| ids.iter().any(|(_, own)| own == id)).map(|(at, ..)| *at);
        let why = done.is_none().then(|| match ids.first() {
            Some((at, _)) => unanswered(evidence, *at, &ids),
            None => unseen(evidence, step, last),
        });
        Carried { verb: step.verb, due_ms: ms(step.at_us), done_ms: done.map(ms), why }
    });
    each.collect()
}

/// Reason that an order that was given was not executed.
fn unanswered(evidence: &Evidence, given: Micros, ids: &[(Micros, CommandId)]) -> String {
    let refused = evidence.entries.iter().find_map(|w| match w.entry.event {
        Any::Service(Event::Executed { command, refused: Some(reason), .. })
            if ids.iter().any(|(_, id)| *id == command) =>
        {
            Some(reason)
        }
        _ => None,
    });
    match refused {
        Some(reason) => format!("given at {} ms, refused by the unit: {}", given / 1000, reason.name()),
        None => format!("given at {} ms, not executed", given / 1000),
    }
}

/// Which of a step's conditions was never displayed while it waited.
fn unseen(evidence: &Evidence, step: &Due, until: Micros) -> String {
    let shown = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Service(Event::Displayed { unit, mode, freshness: Freshness::Fresh, authority, .. })
            if unit == evidence.under.unit && w.entry.node == NodeId::CONSOLE && w.at <= until =>
        {
            Some((w.at, mode, authority.is_some()))
        }
        _ => None,
    });
    let shown: Vec<(Micros, Mode, bool)> = shown.collect();
    // What was displayed last before it was due stands then, too.
    let first = shown.partition_point(|(at, ..)| *at <= step.at_us).saturating_sub(1);
    let meanwhile = &shown[first..];
    let in_mode = |wanted: Mode| meanwhile.iter().any(|(_, mode, _)| *mode == wanted);
    match (step.mode.filter(|wanted| !in_mode(*wanted)), step.track) {
        _ if meanwhile.is_empty() => "the unit not shown as fresh".to_owned(),
        (Some(mode), _) => format!("{} not shown", mode.name()),
        (None, _) if step.verb == Verb::Confirm && !meanwhile.iter().any(|(.., held)| *held) => {
            "no authority shown".to_owned()
        }
        (None, Some(class)) => format!("no {} shown", class.name()),
        (None, None) => "not given".to_owned(),
    }
}

fn is(verb: Verb, kind: CommandKind) -> bool {
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
fn driven(evidence: &Evidence) -> f64 {
    let places = evidence.entries.iter().filter(|w| w.at <= evidence.duration).filter_map(|w| match w.entry.event {
        Any::Instrument(Note::Truth { unit, x_mm, y_mm, .. }) if unit == evidence.under.unit => {
            Some((f64::from(x_mm), f64::from(y_mm)))
        }
        _ => None,
    });
    let places: Vec<(f64, f64)> = places.collect();
    let apart = |a: (f64, f64), b: (f64, f64)| ((a.0 - b.0).powi(2) + (a.1 - b.1).powi(2)).sqrt();
    places.windows(2).map(|pair| apart(pair[0], pair[1])).sum::<f64>() / 1000.0
}

fn ms(at: Micros) -> f64 {
    at as f64 / 1000.0
}
