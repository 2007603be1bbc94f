//! The place that the unit, or its guest, drives by, against the true one.
//!
//! The fence margin allows for a distance between the two. Two witnesses: the sim's truth, and the place that autonomy says it drives by. Sim
//! and autonomy share a host, so their stamps compare.

use evidence::Micros;
use ground_truth::Any;
use wire::event::Event;

use super::{Finding, Property, finding};
use crate::facts::Facts;
use crate::facts::braking::braked_to;
use crate::facts::guest::is_driving;
use crate::facts::place::{length, minus, stated_poses, true_places};
use crate::facts::timeline::is_resting;

/// Unit that has been away from its stated place by more than the fence margin for *Th*, and does not hold.
pub(super) fn unit_astray(facts: &Facts) -> Option<Finding> {
    let Facts { evidence, timeline, .. } = facts;
    let truth = true_places(evidence);
    let th = evidence.bounds.to_hold_safe_ms * 1000;
    let margin = f64::from(evidence.bounds.fence_margin_mm);
    let mut since: Option<Micros> = None;
    for s in stated_poses(evidence) {
        let Some([x, y]) = truth.value_at(s.stamp) else { continue };
        let off = length(minus(s.pose, (x, y)));
        since = (off > margin).then_some(since.unwrap_or(s.at));
        let mode = timeline.mode_at(s.at);
        if since.is_some_and(|since| s.at - since > th) && !is_resting(mode) {
            let message =
                format!("{off:.0} mm from where it takes itself to be for {} ms and {}", th / 1000, mode.name());
            return Some(finding(Property::P3, s.at, message));
        }
    }
    None
}

/// Bare guest that has driven away from its stated place by more than the fence margin for *Th*, and does not stand; time to brake is granted
/// on top.
pub(super) fn guest_astray(facts: &Facts) -> Option<Finding> {
    let Facts { evidence, timeline, .. } = facts;
    let th = evidence.bounds.to_hold_safe_ms * 1000;
    let margin = f64::from(evidence.bounds.fence_margin_mm);
    let truth = true_places(evidence);
    let by_unit = evidence.entries.iter().filter(|w| w.entry.node == evidence.under.node());
    let places = by_unit.filter_map(|w| match w.entry.event {
        Any::Service(Event::GuestPlaced { x_mm, y_mm }) => Some((w.at, w.entry.at, (f64::from(x_mm), f64::from(y_mm)))),
        _ => None,
    });
    // Begin of the time astray, and begin of a stop meanwhile: a short stop clears no false place.
    let (mut since, mut stood): (Option<Micros>, Option<Micros>) = (None, None);
    for (time, stamp, place) in places {
        let Some([x, y]) = truth.last_before(stamp) else { continue };
        let off = length(minus(place, (x, y)));
        let moves = timeline.truth.iter().rev().find(|t| t.at <= time).is_some_and(is_driving);
        stood = if moves { None } else { stood.or(Some(time)) };
        if off <= margin || stood.is_some_and(|stood| time - stood >= th) {
            since = None;
        } else if moves {
            since = since.or(Some(time));
        }
        let Some(from) = since.filter(|since| moves && time - since > th) else { continue };
        let due = braked_to(evidence, from + th, 0);
        if time > due {
            let message = format!(
                "drives {off:.0} mm from the place that it goes by, {} ms after that began",
                (time - from) / 1000
            );
            return Some(finding(Property::P3, time, message));
        }
    }
    None
}
