//! The pose under fixes that the unit says it distrusts.

use evidence::{Evidence, Micros};
use ground_truth::{Any, Note, Sensor};

use super::{Finding, Property, finding};
use crate::facts::Span;
use crate::facts::braking::OVERSPEED;
use crate::facts::place::{Place, length, minus, stated_poses, true_places};

/// Error that odometry may have while fixes are not used: millimetres, a share of the way, and mm/s however slowly the
/// unit goes: wheels that hold it on a slope were seen to turn by 1 to 2 mm/s.
const ODOMETRY: (f64, f64, f64) = (100.0, 0.05, 5.0);

/// Times at which odometry had a fault.
fn odometry_faults(evidence: &Evidence) -> Vec<Span> {
    let mut spans: Vec<Span> = Vec::new();
    for w in &evidence.entries {
        match w.entry.event {
            Any::Instrument(Note::Fault { sensor: Sensor::Odometry, active: true, .. }) => {
                spans.push((w.at, Micros::MAX))
            }
            Any::Instrument(Note::Fault { sensor: Sensor::Odometry, active: false, .. }) => {
                spans.iter_mut().for_each(|(_, to)| *to = w.at.min(*to));
            }
            _ => {}
        }
    }
    spans
}

/// Pose that moves under fixes that the unit says it distrusts: only odometry may move it then, which goes as the unit
/// goes. While odometry has a fault itself the pose may lag behind by all that the unit can go.
pub(super) fn moved_by_distrusted_fixes(evidence: &Evidence) -> Option<Finding> {
    let truth = true_places(evidence);
    let faults = odometry_faults(evidence);
    let mut distrusted: Option<(Micros, Place, Place)> = None;
    // A unit that goes round comes back to its place after a long way.
    let (mut way, mut last) = (0.0, (0.0, 0.0));
    for s in stated_poses(evidence) {
        let Some([x, y]) = truth.value_at(s.stamp) else { continue };
        if !s.distrusted {
            distrusted = None;
            continue;
        }
        if distrusted.is_none() {
            (way, last) = (0.0, (x, y));
        }
        let (since, pose, place) = *distrusted.get_or_insert((s.at, s.pose, (x, y)));
        way += length(minus((x, y), last));
        last = (x, y);
        let (moved, driven) = (minus(s.pose, pose), minus((x, y), place));
        let off = length(minus(moved, driven));
        let lasted = (s.at - since) as f64 / 1e6;
        let overlap = |(from, to): &Span| s.at.min(*to).saturating_sub(since.max(*from)) as f64 / 1e6;
        let fastest = f64::from(evidence.bounds.max_speed_mm_s) + f64::from(OVERSPEED);
        let unseen = faults.iter().map(overlap).sum::<f64>() * fastest;
        let allowed = ODOMETRY.0 + ODOMETRY.1 * way + ODOMETRY.2 * lasted + unseen;
        if length(moved) > ODOMETRY.0 && off > allowed {
            let message = format!("a pose moved by {off:.0} mm under fixes that the unit distrusts");
            return Some(finding(Property::P5, s.at, message));
        }
    }
    None
}
