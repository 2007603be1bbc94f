//! Speed, judged at the plant: the set-points that it holds and the speed that it truly has, against the limit of the unit's mode
//! by the platform's bounds, or by an operator's settings where these are lower.
//!
//! The mode is the unit's own word; whether it should be another one is the business of P2 and P3. A set-point too fast for
//! DEGRADED breaks P2, for HOLD_SAFE P3, for IDLE P9, and one above the largest speed P4, since the fence margin is derived
//! from that speed. Of set-points the plant tells the one that it holds ten times a second; others in between
//! show in its true speed alone.

use evidence::{Evidence, Finding, Micros, Property};
use wire::bounds::Bounds;
use wire::command::CommandKind;
use wire::mode::{Cause, Mode};

use crate::SLACK;
use crate::motion::STANDING;
use crate::timeline::{Timeline, Truth};
use crate::{finding, process_fault};

/// By how much a plant that drives may be faster than its set-point, mm/s: on the steepest ground that a scene may have,
/// downhill adds 1 m/s² (`docs/reference/bounds.md`), and the plant corrects 4 m/s² for each m/s.
pub(crate) const OVERSPEED: i32 = 250;

/// A stretch of time in one mode.
struct Stay {
    mode: Mode,
    from: Micros,
    until: Micros,
}

/// Judges the speeds of every mode.
pub(crate) fn check(evidence: &Evidence, line: &Timeline) -> Vec<Finding> {
    stays(line).iter().flat_map(|stay| too_fast(evidence, line, stay)).collect()
}

/// Time at which the last set-point from before `at` no longer drives the plant, whatever became of its sender: its lease has ended. A
/// plant with a world that hung obeys once that goes on.
pub(crate) fn followed(evidence: &Evidence, at: Micros) -> Micros {
    let lapsed = at + evidence.bounds.set_point_lease_ms * 1000 + SLACK;
    process_fault::can_judge(evidence, evidence.under.sim, lapsed)
}

/// Time at which a plant that has braked since `at`, from the largest speed to `to`, is that slow.
pub(crate) fn braked(evidence: &Evidence, at: Micros, to: i32) -> Micros {
    let Bounds { max_speed_mm_s, braking_mm_s2, .. } = evidence.bounds;
    let above = u64::from(max_speed_mm_s.saturating_sub(to.unsigned_abs()));
    let takes = above * 1_000_000 / u64::from(braking_mm_s2).max(1);
    let slow = process_fault::can_judge(evidence, evidence.under.sim, at + takes);
    // Nothing brakes in a world that hangs.
    if slow > at + takes { slow + takes } else { slow }
}

fn stays(line: &Timeline) -> Vec<Stay> {
    let starts = std::iter::once((0, Mode::Idle)).chain(line.changes.iter().map(|c| (c.at, c.to)));
    let ends = line.changes.iter().map(|c| c.at).chain([Micros::MAX]);
    starts.zip(ends).map(|((from, mode), until)| Stay { mode, from, until }).collect()
}

fn too_fast(evidence: &Evidence, line: &Timeline, stay: &Stay) -> Vec<Finding> {
    let Stay { mode, from, until } = *stay;
    let (property, limit) = allowed(&evidence.bounds, line, stay);
    let first = |since: Micros, test: &dyn Fn(&Truth) -> bool| {
        let mut within = line.truth.iter().filter(|t| t.at >= since && t.at < until);
        within.find(|t| test(t))
    };
    let due = followed(evidence, from);
    let name = mode.name();
    let asked = first(due, &|t| limit.map_or(!t.asked_safe, |limit| t.set_speed.abs() > limit)).map(|t| {
        let what = format!("{name}, and the plant still follows {} mm/s, {} expected", t.set_speed, told(limit));
        finding(property, t.at, what)
    });
    let slow = braked(evidence, due, limit.unwrap_or(STANDING));
    let driven = first(slow, &|t| limit.map_or(!t.safe, |limit| t.speed > limit + OVERSPEED)).map(|t| {
        let what = format!("{name}, and the plant moves at {} mm/s, {} expected", t.speed, told(limit));
        finding(property, t.at, what)
    });
    asked.into_iter().chain(driven).collect()
}

fn told(limit: Option<i32>) -> String {
    limit.map_or_else(|| "its safe motion".to_owned(), |limit| format!("at most {limit}"))
}

/// The property that a higher speed breaks, and the largest set-point, mm/s; none where the platform's safe motion is owed.
fn allowed(bounds: &Bounds, line: &Timeline, stay: &Stay) -> (Property, Option<i32>) {
    let set = settings_speed(line, stay.from).unwrap_or(u32::MAX);
    let mm = |speed: u32| i32::try_from(speed.min(set)).unwrap_or(i32::MAX);
    match stay.mode {
        Mode::Idle => (Property::P9, None),
        Mode::HoldSafe => (Property::P3, None),
        Mode::Degraded => (Property::P2, Some(mm(bounds.degraded_speed_mm_s))),
        Mode::Ready | Mode::PrepareToAct => (Property::P4, Some(mm(bounds.max_speed_mm_s))),
    }
}

/// The largest speed that an operator has set by `at`, mm/s; a unit that starts anew knows of none.
fn settings_speed(line: &Timeline, at: Micros) -> Option<u32> {
    let started = line.changes.iter().rev().find(|c| c.cause == Cause::Start && c.at <= at).map_or(0, |c| c.at);
    line.executed.iter().rev().find_map(|(when, _, kind)| match kind {
        CommandKind::Configure(values) if (started..=at).contains(when) => Some(u32::from(values.speed_mm_s)),
        _ => None,
    })
}
