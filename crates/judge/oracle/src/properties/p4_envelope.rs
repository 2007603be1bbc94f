//! P4: never outside the envelope, from the true pose, moving or not; never driving into an object; no settings under which a blind unit
//! leaves the fence; and the speed of READY, which the fence margin is derived from.

use evidence::Micros;
use ground_truth::{Any, Note};
use wire::command::CommandKind;
use wire::event::Event;
use wire::id::ObjectId;

use super::limit::{Limit, LimitRow, millionths};
use super::{BareGuest, Finding, Property, finding, speed};
use crate::facts::motion::STANDING;
use crate::facts::timeline::Timeline;
use crate::facts::{Facts, reaction_ms};

pub(super) const BARE_GUEST: BareGuest = BareGuest { check: motion_breaks, not_judged: None };

pub(super) const LIMITS: [LimitRow; 1] = [LimitRow {
    limit: Limit::Fence,
    name: "distance kept to the fence",
    length_ms: None,
    approach: |facts, _| fence_approach(facts),
}];

/// Time after a touch in which one more, with the unit on its way off, is the object's pushing: a body that is pushed hops.
const PUSHES: Micros = 2_000_000;

pub(super) fn check(facts: &Facts) -> Vec<Finding> {
    let mut found = motion_breaks(facts);
    found.extend(settings_that_leave_fence(facts));
    found
}

/// Breaks by the motion of the plant.
fn motion_breaks(facts: &Facts) -> Vec<Finding> {
    let mut found = speed::check(facts, Property::P4);
    found.extend(outside_fence(&facts.timeline));
    found.extend(drive_into_object(&facts.timeline));
    found
}

fn outside_fence(timeline: &Timeline) -> Option<Finding> {
    let outside = timeline.truth.iter().find(|t| t.fence < 0)?;
    Some(finding(Property::P4, outside.at, format!("{} mm outside the fence", -outside.fence)))
}

/// Drive into an object. The unit's own speed along the contact counts, in either sense: an object that runs into a standing unit or
/// into its side is no collision of the unit's, one that catches up with a driving unit is. One that pushes on is not: it has touched before.
fn drive_into_object(timeline: &Timeline) -> Option<Finding> {
    let pushes = |(touched_at, object, speed): &(Micros, ObjectId, i32)| {
        let before = timeline.collisions.iter().filter(|(first, other, _)| other == object && first < touched_at);
        *speed < 0 && before.map(|(first, ..)| touched_at - first).min().is_some_and(|pause| pause <= PUSHES)
    };
    let counts = |touch: &&(Micros, ObjectId, i32)| touch.2.abs() > STANDING && !pushes(touch);
    let (touched_at, object, speed) = timeline.collisions.iter().find(counts)?;
    Some(finding(Property::P4, *touched_at, format!("drives into object {} at {speed} mm/s", object.0)))
}

/// Accepted settings under which a unit that loses its place at the margin may leave the fence.
fn settings_that_leave_fence(facts: &Facts) -> Vec<Finding> {
    let bounds = &facts.evidence.bounds;
    // The way within the guard's own reaction is in the distance that the guard keeps.
    let blind_ms = (bounds.product_limit_ms + bounds.control_period_ms).saturating_sub(reaction_ms(bounds));
    let set = facts.evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Service(Event::Executed { kind: CommandKind::Configure(values), refused: None, .. }) => {
            Some((w.at, values))
        }
        _ => None,
    });
    let leaving = set.filter(|(_, v)| u64::from(v.speed_mm_s) * blind_ms / 1000 > u64::from(v.margin_mm));
    leaving
        .map(|(set_at, v)| finding(Property::P4, set_at, format!("set to leave the fence when blind: {v:?}")))
        .collect()
}

/// Largest share of the fence margin that the vehicle used up, millionths.
fn fence_approach(facts: &Facts) -> Option<u32> {
    let margin = u64::from(facts.evidence.bounds.fence_margin_mm);
    let entries = facts.evidence.entries.iter().filter(|w| w.at <= facts.evidence.duration);
    let approaches = entries.filter_map(|w| match w.entry.event {
        Any::Instrument(Note::Truth { unit, fence_mm, .. }) if unit == facts.evidence.under.unit => {
            let left = u64::try_from(fence_mm).unwrap_or(0).min(margin);
            Some(millionths(margin - left, margin))
        }
        _ => None,
    });
    approaches.max()
}
