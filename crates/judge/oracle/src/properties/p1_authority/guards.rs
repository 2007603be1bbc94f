//! Guards at an act, as far as others than the unit know them.
//!
//! The sim knows where the unit is and how far it could still stop inside the fence; the guards of the link know when
//! a timely record last came to either end; of lost sensors both witnesses know, of a dead perception the launcher, of seals the
//! recorder. Whether an operator took authority away, and which mode the unit was in, is read from other entries of the
//! unit's than the one on the act. Teammates, drift, time base and the track's confidence are the unit's word alone, in
//! the entry on the act; that the object is of its class is P11.

use evidence::{Evidence, Micros};
use ground_truth::{Any, Note};
use wire::command::CommandKind;
use wire::event::Event;
use wire::id::NodeId;
use wire::mode::Mode;

use super::{Finding, Property, finding};
use crate::facts::timeline::Timeline;
use crate::facts::{Facts, SLACK, contact, link, place, process, reaction_ms};

/// Time between two entries of the plant's truth, and some more.
const TRUTH_GAP: Micros = 250_000;

/// Acts at the plant against a guard.
pub(super) fn check(facts: &Facts) -> Vec<Finding> {
    let Facts { evidence, timeline, .. } = facts;
    let acts = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Instrument(Note::PlantAct { authority, .. }) => Some((w.at, authority)),
        _ => None,
    });
    acts.flat_map(|(acted_at, authority)| {
        let failures = [
            wrong_mode(timeline, acted_at),
            authority_ended(timeline, acted_at, authority),
            too_near_fence(evidence, timeline, acted_at),
            place_error(evidence, acted_at),
            supervision_lapsed(facts, acted_at),
            sensor_lost(facts, acted_at),
            seal_overdue(evidence, acted_at),
        ];
        failures.into_iter().flatten().map(move |failure| finding(Property::P1, acted_at, format!("act {failure}")))
    })
    .collect()
}

fn wrong_mode(timeline: &Timeline, acted_at: Micros) -> Option<String> {
    let held = timeline.was_in(Mode::PrepareToAct, acted_at.saturating_sub(SLACK), acted_at);
    (!held).then(|| format!("of a unit that is {}", timeline.mode_at(acted_at).name()))
}

/// Act under authority from before a HOLD or a DISARM that the unit has executed.
fn authority_ended(timeline: &Timeline, acted_at: Micros, authority: u32) -> Option<String> {
    let (minted_at, ..) =
        timeline.minted.iter().rev().find(|(minted_at, serial, _)| *serial == authority && *minted_at <= acted_at)?;
    let safe = |kind: &CommandKind| matches!(kind, CommandKind::Hold | CommandKind::Disarm);
    let (_, id, kind) = timeline
        .executed
        .iter()
        .find(|(executed_at, _, kind)| safe(kind) && executed_at > minted_at && *executed_at < acted_at)?;
    Some(format!("under authority that {} {id} had taken away", kind.name()))
}

/// Act from which the unit does not come to rest inside the fence. No margin is asked for: that is its possible error of place.
fn too_near_fence(evidence: &Evidence, timeline: &Timeline, acted_at: Micros) -> Option<String> {
    let Some(truth) = timeline.truth.iter().rev().find(|t| t.at <= acted_at && acted_at - t.at <= TRUTH_GAP) else {
        return Some("of a plant of which there is no ground truth".into());
    };
    let speed = u64::from(truth.speed.unsigned_abs());
    let stopping_way = speed * reaction_ms(&evidence.bounds) / 1000
        + speed * speed / (2 * u64::from(evidence.bounds.braking_mm_s2).max(1));
    let margin = i64::from(truth.fence) - i64::try_from(stopping_way).unwrap_or(i64::MAX);
    (margin < 0).then(|| format!("{} mm from the fence at {speed} mm/s", truth.fence))
}

fn place_error(evidence: &Evidence, acted_at: Micros) -> Option<String> {
    let distance = place::place_error_at(evidence, acted_at)?;
    let margin = evidence.bounds.fence_margin_mm;
    (distance > f64::from(margin)).then(|| format!("{distance:.0} mm from where the unit takes itself to be"))
}

/// Act beyond the supervision lease. A lease counts from the writing of its grant, so from no later than it came; the gateway grants
/// while its newest report of the unit is no older than *Tf*.
fn supervision_lapsed(facts: &Facts, acted_at: Micros) -> Option<String> {
    let evidence = facts.evidence;
    let bounds = &evidence.bounds;
    let (lease, heard) = (bounds.lease_ms, bounds.freshness_ms + bounds.lease_ms);
    [(evidence.under.node(), lease), (NodeId::GATEWAY, heard)].into_iter().find_map(|(node, limit)| {
        let timely = link::timely_times(facts, node);
        let last = timely.into_iter().take_while(|t| *t <= acted_at).last();
        let until = |last: Micros| contact::may_go_on_until(evidence, last).unwrap_or(last + limit * 1000 + SLACK);
        let is_silent = last.is_none_or(|last| acted_at > until(last));
        is_silent.then(|| format!("with nothing timely at {node} for more than {limit} ms"))
    })
}

fn sensor_lost(facts: &Facts, acted_at: Micros) -> Option<String> {
    let evidence = facts.evidence;
    let td = evidence.bounds.to_degraded_ms * 1000;
    let is_missing = |from: Micros, to: Micros| acted_at > from.saturating_add(td) && acted_at < to;
    let lost = facts
        .sensor_faults
        .iter()
        .find(|f| f.is_loss() && is_missing(f.start, f.end))
        .map(|f| format!("{:?}", f.sensor));
    let dead = || {
        let mut spans = process::dead_spans(evidence, evidence.under.perception).into_iter();
        spans.any(|(from, to)| is_missing(from, to)).then(|| "perception".to_owned())
    };
    lost.or_else(dead).map(|lost_part| format!("more than {} ms after {lost_part} was lost", td / 1000))
}

fn seal_overdue(evidence: &Evidence, acted_at: Micros) -> Option<String> {
    let limit = evidence.bounds.seal_limit_ms;
    let seals = evidence.entries.iter().filter(|w| w.at <= acted_at && w.entry.node == NodeId::RECORDER);
    let last = seals.filter(|w| matches!(w.entry.event, Any::Service(Event::Sealed { .. }))).map(|w| w.at).next_back();
    let is_overdue = last.is_none_or(|last| acted_at - last > limit * 1000 + SLACK);
    is_overdue.then(|| format!("with no seal of the recorder's for more than {limit} ms"))
}
