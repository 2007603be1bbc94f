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
    acts.flat_map(|(at, authority)| {
        let against = [
            wrong_mode(timeline, at),
            authority_ended(timeline, at, authority),
            too_near_fence(evidence, timeline, at),
            astray(evidence, at),
            unsupervised(facts, at),
            without_sensor(facts, at),
            unsealed(evidence, at),
        ];
        against.into_iter().flatten().map(move |what| finding(Property::P1, at, format!("act {what}")))
    })
    .collect()
}

fn wrong_mode(timeline: &Timeline, at: Micros) -> Option<String> {
    let held = timeline.was_in(Mode::PrepareToAct, at.saturating_sub(SLACK), at);
    (!held).then(|| format!("of a unit that is {}", timeline.mode_at(at).name()))
}

/// Act under authority from before a HOLD or a DISARM that the unit has executed.
fn authority_ended(timeline: &Timeline, at: Micros, authority: u32) -> Option<String> {
    let (minted, ..) =
        timeline.minted.iter().rev().find(|(minted, serial, _)| *serial == authority && *minted <= at)?;
    let safe = |kind: &CommandKind| matches!(kind, CommandKind::Hold | CommandKind::Disarm);
    let (_, id, kind) = timeline.executed.iter().find(|(t, _, kind)| safe(kind) && t > minted && *t < at)?;
    Some(format!("under authority that {} {id} had taken away", kind.name()))
}

/// Act from which the unit does not come to rest inside the fence. No margin is asked for: that is its possible error of place.
fn too_near_fence(evidence: &Evidence, timeline: &Timeline, at: Micros) -> Option<String> {
    let Some(truth) = timeline.truth.iter().rev().find(|t| t.at <= at && at - t.at <= TRUTH_GAP) else {
        return Some("of a plant of which there is no ground truth".into());
    };
    let speed = u64::from(truth.speed.unsigned_abs());
    let stops = speed * reaction_ms(&evidence.bounds) / 1000
        + speed * speed / (2 * u64::from(evidence.bounds.braking_mm_s2).max(1));
    let left = i64::from(truth.fence) - i64::try_from(stops).unwrap_or(i64::MAX);
    (left < 0).then(|| format!("{} mm from the fence at {speed} mm/s", truth.fence))
}

fn astray(evidence: &Evidence, at: Micros) -> Option<String> {
    let off = place::place_error_at(evidence, at)?;
    let margin = evidence.bounds.fence_margin_mm;
    (off > f64::from(margin)).then(|| format!("{off:.0} mm from where the unit takes itself to be"))
}

/// Act beyond the supervision lease. A lease counts from the writing of its grant, so from no later than it came; the gateway grants
/// while its newest report of the unit is no older than *Tf*.
fn unsupervised(facts: &Facts, at: Micros) -> Option<String> {
    let evidence = facts.evidence;
    let bounds = &evidence.bounds;
    let (lease, heard) = (bounds.lease_ms, bounds.freshness_ms + bounds.lease_ms);
    [(evidence.under.node(), lease), (NodeId::GATEWAY, heard)].into_iter().find_map(|(node, limit)| {
        let timely = link::timely_times(facts, node);
        let last = timely.into_iter().take_while(|t| *t <= at).last();
        let until = |last: Micros| contact::may_go_on_until(evidence, last).unwrap_or(last + limit * 1000 + SLACK);
        let silent = last.is_none_or(|last| at > until(last));
        silent.then(|| format!("with nothing timely at {node} for more than {limit} ms"))
    })
}

fn without_sensor(facts: &Facts, at: Micros) -> Option<String> {
    let evidence = facts.evidence;
    let td = evidence.bounds.to_degraded_ms * 1000;
    let without = |from: Micros, to: Micros| at > from.saturating_add(td) && at < to;
    let lost =
        facts.sensor_faults.iter().find(|f| f.is_loss() && without(f.start, f.end)).map(|f| format!("{:?}", f.sensor));
    let dead = || {
        let mut spans = process::dead_spans(evidence, evidence.under.perception).into_iter();
        spans.any(|(from, to)| without(from, to)).then(|| "perception".to_owned())
    };
    lost.or_else(dead).map(|what| format!("more than {} ms after {what} was lost", td / 1000))
}

fn unsealed(evidence: &Evidence, at: Micros) -> Option<String> {
    let limit = evidence.bounds.seal_limit_ms;
    let seals = evidence.entries.iter().filter(|w| w.at <= at && w.entry.node == NodeId::RECORDER);
    let last = seals.filter(|w| matches!(w.entry.event, Any::Service(Event::Sealed { .. }))).map(|w| w.at).next_back();
    let open = last.is_none_or(|last| at - last > limit * 1000 + SLACK);
    open.then(|| format!("with no seal of the recorder's for more than {limit} ms"))
}
