//! Progress of a mission along its route, by the plant's truth alone.
//!
//! A class names the guard that tripped and the property that was broken. A vehicle that stands still breaks no property, so the class does
//! not show whether it did its work; the progress does. The oracle computes it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::witnessed::Micros;

/// Distance from a way point within which it counts as passed, mm: twice that within which the platform's own mission takes it for reached,
/// for its own place may be off.
pub const PASSED_MM: f64 = 2000.0;
/// Distance within which a vehicle makes no progress, mm: the default of Nav2's `SimpleProgressChecker` (`required_movement_radius`, 0.5 m).
pub const STUCK_MM: f64 = 500.0;
/// Time without progress after which a vehicle is stuck, microseconds: the default there (`movement_time_allowance`, 10 s).
pub const STUCK_AFTER: Micros = 10_000_000;
/// Time in driving modes after which a vehicle that never left its place is stuck, microseconds: a run may be shorter than the bound above.
pub const UNMOVED_AFTER: Micros = 5_000_000;

/// Wait that a leg of the route may take in driving modes, microseconds, beside its straight length at a slow pace. A vehicle that moves to
/// and fro for longer makes no progress either.
pub const LEG_WAIT: Micros = 120_000_000;
/// The slow pace, mm/s.
pub const LEG_MM_S: f64 = 500.0;

/// Route that the unit under test is to go.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Route {
    /// Way points in order, east and north, mm; none of a body that has no way to go, as a satellite.
    pub points_mm: Vec<(i32, i32)>,
    /// True if it begins again after the last of them.
    pub looped: bool,
    /// True if the body follows it in DEGRADED too, in place of stopping or circling.
    pub in_degraded: bool,
}

/// Progress along the route.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    /// Way points passed, in order and within 2 m; on a looped route of all laps together.
    pub passed: u32,
    /// Way points of the route; on a looped route of all laps begun.
    #[serde(rename = "of")]
    pub total: u32,
    /// Share of the route's length covered, 0 to 1; on a looped route of its first lap.
    pub covered: f64,
    /// Seconds in modes that let it drive, with way points left.
    pub driving_s: f64,
    /// Largest distance in that time from the place where it could first drive, metres.
    pub farthest_m: f64,
    /// Seconds of that time without progress: stretches of 10 s or more within 0.5 m, or all of it if it never left its place.
    pub stuck_s: f64,
    /// True if the last such stretch lasted to the end of the run.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub stuck_at_end: bool,
    /// Seconds in driving modes from the last way point that it passed to the end of the run, where the leg may not take as many.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub astray_s: Option<f64>,
    /// The longest such stretch; none without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stuck: Option<Stretch>,
}

/// A stretch in which the vehicle stayed in place, though its mode let it drive and way points were left.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stretch {
    /// Its beginning, milliseconds of the run.
    pub from_ms: f64,
    /// Its length, seconds.
    pub s: f64,
    /// Reason, as far as the log has one.
    #[serde(rename = "why")]
    pub reason: Standstill,
}

/// Reason that a vehicle stood though it could have driven, by a witness in the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Standstill {
    /// The plant held no set-point whose lease stood.
    NoSetPoint,
    /// The plant held a set-point to move, and did not.
    NotFollowed,
    /// The unit had no recent place.
    NoPlace,
    /// The platform's own planner asked for rest.
    Planner,
    /// The guest asked for rest: its set-points were not limited once in the run.
    Guest,
    /// The guest asked for rest, or the guards limited it to that.
    GuestOrGuards,
}

impl Standstill {
    /// The reason in words, with its witness.
    pub fn describe(self) -> &'static str {
        match self {
            Standstill::NoSetPoint => "no set-point with a lease, by the plant",
            Standstill::NotFollowed => "a set-point that the vehicle does not follow, by the plant",
            Standstill::NoPlace => "no recent place, by the unit's own judgement",
            Standstill::Planner => "rest asked for by the platform's own planner, by the set-point at the plant",
            Standstill::Guest => {
                "rest asked for by the guest, by the set-point at the plant and the unit's count of limited ones"
            }
            Standstill::GuestOrGuards => {
                "rest at the plant, asked for by the guest or left of its set-points by the guards, which of them the log does not say"
            }
        }
    }
}

impl Progress {
    /// True if it is stuck: without progress at the end of the run, or for half of the time or more, or driving without reaching a way point.
    /// A wait with progress after it does not count.
    pub fn is_stuck(&self) -> bool {
        self.stays_in_place() || self.astray_s.is_some()
    }

    fn stays_in_place(&self) -> bool {
        self.stuck.is_some() && (self.stuck_at_end || 2.0 * self.stuck_s >= self.driving_s)
    }

    /// Description of the time without progress, the decisive one first; none where there is none.
    pub fn describe(&self) -> Option<String> {
        let Self { passed, total, .. } = self;
        if let Some(s) = self.astray_s.filter(|_| !self.stays_in_place()) {
            return Some(format!("astray: no way point in {s:.1} s of driving, {passed} of {total} passed"));
        }
        let Stretch { from_ms, s, reason } = self.stuck?;
        let reason = reason.describe();
        Some(format!("stuck for {s:.1} s from {from_ms:.0} ms, {passed} of {total} way points passed: {reason}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A short stop on the way is not yet stuck.
    #[test]
    fn finding_names_the_reason_for_being_stuck() {
        let stretch = Stretch { from_ms: 1000.0, s: 12.0, reason: Standstill::Planner };
        let astray = Progress {
            passed: 1,
            total: 8,
            covered: 0.2,
            driving_s: 400.0,
            farthest_m: 30.0,
            stuck_s: 12.0,
            stuck_at_end: false,
            astray_s: Some(300.0),
            stuck: Some(stretch),
        };
        assert!(astray.is_stuck() && astray.describe().unwrap().starts_with("astray: no way point in 300.0 s"));
        let stopped = Progress { stuck_at_end: true, ..astray };
        assert!(stopped.describe().unwrap().starts_with("stuck for 12.0 s"));
    }
}
