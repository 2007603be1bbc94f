//! Speed, judged at the plant: the set-points that it holds and the speed that it truly has, against the limit of the unit's mode
//! by the platform's bounds, or by an operator's settings where these are lower.
//!
//! The mode is the unit's own word; whether it should be another one is the business of P2 and P3. A set-point too fast for
//! DEGRADED breaks P2, for HOLD_SAFE P3, for IDLE P9, and one above the largest speed P4, since the fence margin is derived
//! from that speed. The plant logs the set-point that it holds ten times a second; others in between
//! show in its true speed alone.

use evidence::Micros;
use wire::bounds::Bounds;
use wire::command::CommandKind;
use wire::mode::{Cause, Mode};

use super::{Finding, Property, finding};
use crate::facts::Facts;
use crate::facts::braking::{OVERSPEED, braked_to, set_point_lapsed};
use crate::facts::motion::{STANDING, Truth};
use crate::facts::timeline::Timeline;

/// A stretch of time in one mode.
struct ModeStay {
    mode: Mode,
    from: Micros,
    until: Micros,
}

/// Speeds above the limit of the modes that `property` limits.
pub(super) fn check(facts: &Facts, property: Property) -> Vec<Finding> {
    let stays = mode_stays(&facts.timeline);
    stays
        .iter()
        .filter(|stay| limits_speed_of(stay.mode) == property)
        .flat_map(|stay| speeds_above_limit(facts, stay))
        .collect()
}

/// The property that a higher speed in a mode breaks.
fn limits_speed_of(mode: Mode) -> Property {
    match mode {
        Mode::Idle => Property::P9,
        Mode::HoldSafe => Property::P3,
        Mode::Degraded => Property::P2,
        Mode::Ready | Mode::PrepareToAct => Property::P4,
    }
}

fn mode_stays(timeline: &Timeline) -> Vec<ModeStay> {
    let starts = std::iter::once((0, Mode::Idle)).chain(timeline.changes.iter().map(|c| (c.at, c.to)));
    let ends = timeline.changes.iter().map(|c| c.at).chain([Micros::MAX]);
    starts.zip(ends).map(|((from, mode), until)| ModeStay { mode, from, until }).collect()
}

fn speeds_above_limit(facts: &Facts, stay: &ModeStay) -> Vec<Finding> {
    let Facts { evidence, timeline, .. } = facts;
    let ModeStay { mode, from, until } = *stay;
    let property = limits_speed_of(mode);
    let limit = largest_set_point(&evidence.bounds, timeline, stay);
    let first = |since: Micros, test: &dyn Fn(&Truth) -> bool| {
        let mut samples = timeline.truth.iter().filter(|t| t.at >= since && t.at < until);
        samples.find(|t| test(t))
    };
    // Until its lease ends the plant follows a set-point of the mode before.
    let due = set_point_lapsed(evidence, from);
    let name = mode.name();
    let set_too_fast = first(due, &|t| limit.map_or(!t.asked_safe, |limit| t.set_speed.abs() > limit)).map(|t| {
        let message =
            format!("{name}, and the plant still follows {} mm/s, {} expected", t.set_speed, expected_speed(limit));
        finding(property, t.at, message)
    });
    let slow = braked_to(evidence, due, limit.unwrap_or(STANDING));
    let driven_too_fast = first(slow, &|t| limit.map_or(!t.safe, |limit| t.speed > limit + OVERSPEED)).map(|t| {
        let message = format!("{name}, and the plant moves at {} mm/s, {} expected", t.speed, expected_speed(limit));
        finding(property, t.at, message)
    });
    set_too_fast.into_iter().chain(driven_too_fast).collect()
}

fn expected_speed(limit: Option<i32>) -> String {
    limit.map_or_else(|| "its safe motion".to_owned(), |limit| format!("at most {limit}"))
}

/// The largest set-point, mm/s; none where the platform has to be in its safe motion.
fn largest_set_point(bounds: &Bounds, timeline: &Timeline, stay: &ModeStay) -> Option<i32> {
    let set = settings_speed(timeline, stay.from).unwrap_or(u32::MAX);
    let mm = |speed: u32| i32::try_from(speed.min(set)).unwrap_or(i32::MAX);
    match stay.mode {
        Mode::Idle | Mode::HoldSafe => None,
        Mode::Degraded => Some(mm(bounds.degraded_speed_mm_s)),
        Mode::Ready | Mode::PrepareToAct => Some(mm(bounds.max_speed_mm_s)),
    }
}

/// The largest speed that an operator has set by `time`, mm/s; a restarted unit knows of none.
fn settings_speed(timeline: &Timeline, time: Micros) -> Option<u32> {
    let started = timeline.changes.iter().rev().find(|c| c.cause == Cause::Start && c.at <= time).map_or(0, |c| c.at);
    timeline.executed.iter().rev().find_map(|(set_at, _, kind)| match kind {
        CommandKind::Configure(values) if (started..=time).contains(set_at) => Some(u32::from(values.speed_mm_s)),
        _ => None,
    })
}
