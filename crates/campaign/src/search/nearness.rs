//! How near a trial came to the limit of each property that has one: what guided drawing climbs by.
//!
//! In thousandths of the way, 1000 being at the limit as the platform's bounds state it, without the slack that the oracle
//! allows. It is no verdict: some properties (an order executed twice) have no way to a limit, of others one side is
//! looked at. Whether anything is broken is the oracle's to say.

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

use std::collections::BTreeMap;

use wire::bounds::Bounds;
use wire::command::CommandKind;
use wire::event::{Event, Freshness, Interface};
use wire::id::{NodeId, UnitId};
use wire::mode::Mode;
use wire::sensor::Modalities;

use crate::oracle::{Evidence, Micros, Property, Timeline, Witnessed};

/// Of each property the furthest, in thousandths of the way to its limit.
pub type Nearness = BTreeMap<Property, u32>;

/// At a limit.
pub(super) const AT_LIMIT: u32 = 1000;

/// The limit of time that a property has, milliseconds, where it has one. What is missing of the way to it is a length of time,
/// by which a word can be moved.
pub(super) fn limit_ms(property: Property, bounds: &Bounds) -> Option<u64> {
    match property {
        Property::P1 | Property::P8 => Some(bounds.command_limit_ms),
        Property::P2 => Some(bounds.to_degraded_ms),
        Property::P3 => Some(bounds.to_hold_safe_ms),
        Property::P5 => Some(bounds.freshness_ms),
        Property::P7 => Some(bounds.freshness_ms + bounds.telemetry_period_ms),
        Property::P4 | Property::P6 | Property::P9 | Property::P10 | Property::P11 => None,
    }
}

/// That of a trial.
pub(super) fn of(evidence: &Evidence) -> Nearness {
    let line = Timeline::of(evidence);
    let mut nearest = Nearness::new();
    let events = evidence.entries.iter().filter(|w| w.at <= evidence.duration);
    let ways = events.filter_map(|w| seen(w, evidence, &line));
    for (property, way) in ways.chain(orders(evidence, &line)).chain(silences(evidence, &line)) {
        let furthest = nearest.entry(property).or_default();
        *furthest = way.max(*furthest);
    }
    nearest
}

/// What one event shows by itself.
fn seen(w: &Witnessed, evidence: &Evidence, line: &Timeline) -> Option<(Property, u32)> {
    let bounds = &evidence.bounds;
    match w.entry.event {
        Event::Accepted { age: Some(age), .. } => Some((Property::P5, way(age.0, bounds.freshness_ms))),
        Event::Displayed { unit: UnitId::A, freshness: Freshness::Fresh, age, mode, .. } => {
            let wrong = w.at - last_in(line, mode, w.at);
            Some((Property::P7, way(age.0.max(wrong), bounds.freshness_ms + bounds.telemetry_period_ms)))
        }
        Event::Truth { unit: UnitId::A, fence_mm, .. } => {
            // How much of the distance that is kept to the fence is used up.
            let kept = u64::from(bounds.fence_margin_mm);
            let left = u64::try_from(fence_mm).unwrap_or(0).min(kept);
            Some((Property::P4, part(kept - left, kept)))
        }
        Event::PlantAct { distance_mm, .. } => {
            Some((Property::P11, part(u64::from(distance_mm), u64::from(bounds.designation_mm))))
        }
        _ => None,
    }
}

/// How late orders were executed and confirmations acted on.
fn orders<'a>(evidence: &'a Evidence, line: &'a Timeline) -> impl Iterator<Item = (Property, u32)> + 'a {
    let limit = evidence.bounds.command_limit_ms;
    line.executed.iter().filter_map(move |(at, id, kind)| {
        let given = line.intended.iter().find(|(_, command, _)| command == id)?.0;
        let property = if matches!(kind, CommandKind::Confirm(_)) { Property::P1 } else { Property::P8 };
        Some((property, way(at.saturating_sub(given), limit)))
    })
}

/// For how long the unit went on without a sensor, and without having heard of the other end.
fn silences(evidence: &Evidence, line: &Timeline) -> Vec<(Property, u32)> {
    let (td, th) = (evidence.bounds.to_degraded_ms, evidence.bounds.to_hold_safe_ms);
    let nominal = |mode: Mode| matches!(mode, Mode::Ready | Mode::PrepareToAct);
    let moving = |mode: Mode| !matches!(mode, Mode::HoldSafe | Mode::Idle);
    let mut ways: Vec<_> =
        blind(evidence).into_iter().map(|s| (Property::P2, way(went_on(line, s, nominal), td))).collect();
    for (node, other) in [(NodeId::GATEWAY, NodeId::UNIT_A), (NodeId::UNIT_A, NodeId::GATEWAY)] {
        let deaf = deaf(evidence, node, other).into_iter();
        ways.extend(deaf.map(|span| (Property::P3, way(went_on(line, span, moving), th))));
    }
    ways
}

/// Spans in which frames came without all that they should bring.
fn blind(evidence: &Evidence) -> Vec<(Micros, Micros)> {
    let frames = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Event::FrameSeen { present, .. } => Some((w.at, present)),
        _ => None,
    });
    let frames: Vec<(Micros, Modalities)> = frames.collect();
    let Some(whole) = frames.first().map(|(_, present)| *present) else { return Vec::new() };
    let ends = frames.iter().skip(1).map(|(at, _)| *at).chain([evidence.duration]);
    let spans = frames.iter().zip(ends).filter(|((_, present), _)| *present != whole);
    spans.map(|((from, _), to)| (*from, to)).collect()
}

/// Spans in which `node` accepted nothing of `other` over the network.
fn deaf(evidence: &Evidence, node: NodeId, other: NodeId) -> Vec<(Micros, Micros)> {
    let heard = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Event::Accepted { at, record, .. } if w.entry.node == node && record.node == other => {
            (!matches!(at, Interface::Bus(_))).then_some(w.at)
        }
        _ => None,
    });
    let times: Vec<Micros> = heard.filter(|at| *at < evidence.duration).chain([evidence.duration]).collect();
    times.windows(2).map(|pair| (pair[0], pair[1])).collect()
}

/// How long from the beginning of `span` the unit stayed in modes that satisfy `test`, microseconds.
fn went_on(line: &Timeline, (from, to): (Micros, Micros), test: impl Fn(Mode) -> bool) -> u64 {
    if !test(line.mode_at(from)) {
        return 0;
    }
    line.first_change(from, |c| !test(c.to)).map_or(to, |c| c.at.min(to)).saturating_sub(from)
}

/// When the unit was last in `mode`, at `at` or before; at its start where it never was.
fn last_in(line: &Timeline, mode: Mode, at: Micros) -> Micros {
    if line.mode_at(at) == mode {
        return at;
    }
    line.changes.iter().rev().find(|c| c.at <= at && c.from == mode).map_or(0, |c| c.at)
}

/// Microseconds of a limit in milliseconds.
fn way(us: u64, limit_ms: u64) -> u32 {
    part(us, limit_ms.saturating_mul(1000))
}

fn part(of: u64, whole: u64) -> u32 {
    let thousandths = u128::from(of) * u128::from(AT_LIMIT) / u128::from(whole.max(1));
    u32::try_from(thousandths).unwrap_or(u32::MAX)
}
