//! The table of a body on a fixed wing, and its checks against the bounds. Limits of height are checked with the limits of other bodies that fly.
//!
//! Ranges are held by the types; the values' meaning is given by `config::platform`.

use config::platform::FixedWing;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Platform;
use super::body::GRAVITY;
use super::check::{at_least, at_most};
use super::flight::{AloftTable, ceiling_m};
use crate::finding::Finding;
use crate::value::{Located, Real};

/// A body on a fixed wing with an autopilot, in place of `[vehicle]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FixedWingTable {
    /// Mass, kg.
    pub mass_kg: Located<Real<10, 100_000>>,
    /// Length, span and height of the body, metres.
    pub body_m: [Real<10, 10_000>; 3],
    /// Least airspeed, m/s.
    pub min_speed_m_s: Located<Real<100, 30_000>>,
    /// Greatest airspeed of a set-point, m/s.
    pub max_speed_m_s: Located<Real<100, 30_000>>,
    /// Greatest climb and descent of a set-point, m/s.
    pub max_climb_m_s: Real<100, 10_000>,
    /// Greatest turn of a set-point, rad/s.
    pub max_turn_rad_s: Real<100, 6_000>,
    /// Change of the airspeed, speeding up and slowing down, m/s².
    pub acceleration_m_s2: [Real<100, 20_000>; 2],
    /// Greatest bank, degrees.
    pub bank_deg: Located<Real<5_000, 60_000>>,
    /// Natural frequency of the bank, rad/s, and its damping.
    pub roll: [Real<300, 30_000>; 2],
    /// Time constant of the climb, seconds.
    pub climb_s: Real<50, 5_000>,
    /// Capacity of the battery, W·h.
    pub battery_w_h: Real<10, 10_000_000>,
    /// Power in flight, and on the ground, W.
    pub power_w: [Real<100, 100_000_000>; 2],
    /// Height at which a run begins, metres above the ground.
    pub cruise_m: Located<Real<500, 100_000>>,
    /// Airspeed on the circle of its safe motion, m/s.
    pub circle_m_s: Located<Real<100, 30_000>>,
    /// Bank on it, degrees.
    pub circle_bank_deg: Located<Real<5_000, 60_000>>,
    /// Time for which the body circles without set-points before it lands, seconds.
    pub circle_s: Real<0, 3_600_000>,
    /// Horizontal distance that it keeps to the place where a circle began, metres.
    pub stays_m: Located<Real<500, 1_000_000>>,
    /// Speed of the descent, m/s.
    pub descent_m_s: Real<100, 5_000>,
    /// Speed of the wind that its safe motion allows for, m/s.
    pub drift_m_s: Real<100, 5_000>,
    /// Least height above the surface below under set-points, metres.
    pub clearance_m: Located<Real<100, 50_000>>,
}

impl FixedWingTable {
    /// The body as the simulation knows it.
    pub(super) fn body(&self, aloft: Option<&AloftTable>) -> FixedWing {
        FixedWing {
            ceiling_m: ceiling_m(aloft),
            mass_kg: self.mass_kg.get() as f32,
            body_m: self.body_m.map(|edge| edge.get() as f32),
            min_speed_m_s: self.min_speed_m_s.get() as f32,
            max_speed_m_s: self.max_speed_m_s.get() as f32,
            max_climb_m_s: self.max_climb_m_s.get() as f32,
            max_turn_rad_s: self.max_turn_rad_s.get() as f32,
            acceleration_m_s2: self.acceleration_m_s2.map(|a| a.get() as f32),
            bank_deg: self.bank_deg.get() as f32,
            roll: self.roll.map(|part| part.get() as f32),
            climb_s: self.climb_s.get() as f32,
            battery_w_h: self.battery_w_h.get() as f32,
            power_w: self.power_w.map(|w| w.get() as f32),
            cruise_m: self.cruise_m.get() as f32,
            circle_m_s: self.circle_m_s.get() as f32,
            circle_bank_deg: self.circle_bank_deg.get() as f32,
            circle_s: self.circle_s.get() as f32,
            stays_m: self.stays_m.get() as f32,
            descent_m_s: self.descent_m_s.get() as f32,
            drift_m_s: self.drift_m_s.get() as f32,
            clearance_m: self.clearance_m.get() as f32,
        }
    }

    /// Rate of turn on the circle of its safe motion, rad/s: that of a coordinated turn, g tan φ / v.
    fn circling(&self) -> f64 {
        GRAVITY * libm::tan(self.circle_bank_deg.get().to_radians()) / self.circle_m_s.get()
    }
}

/// Time until the bank of a circle is taken up, as a share of its natural period: a critically damped one is within a tenth by then.
const BANKS: f64 = 4.0;

/// The body against the bounds.
pub(super) fn check(platform: &Platform, body: &FixedWingTable) -> Vec<Finding> {
    let b = &platform.bounds;
    let (fastest, braking) = (b.max_speed_mm_s.get() as f64 / 1000.0, b.braking_mm_s2.get() as f64 / 1000.0);
    let turns = GRAVITY * libm::tan(body.bank_deg.get().to_radians()) / fastest;
    // Starting at full speed it flies ahead until it banks, and then around a circle.
    let banks_s = BANKS / body.roll[0].get();
    let ahead = fastest * banks_s + fastest / body.circling();
    let stops = fastest * platform.guards.reaction_ms.get() as f64 / 1000.0 + fastest.powi(2) / (2.0 * braking);
    let found = [
        at_least(
            &body.max_speed_m_s,
            (body.max_speed_m_s.get(), fastest),
            "m/s",
            "the body never reaches `max_speed_mm_s`, from which the margins are derived",
            "lower `max_speed_mm_s`, or state a faster body",
        ),
        at_most(
            &body.min_speed_m_s,
            (body.min_speed_m_s.get(), body.circle_m_s.get()),
            "m/s",
            "the circle is slower than the least airspeed",
            "state a faster circle",
        ),
        at_most(
            &body.circle_m_s,
            (body.circle_m_s.get() * 1000.0, b.degraded_speed_mm_s.get() as f64),
            "mm/s",
            "DEGRADED is flown as a circle, which is faster than `degraded_speed_mm_s`",
            "raise `degraded_speed_mm_s`, or state a slower circle",
        ),
        at_least(
            &body.bank_deg,
            (turns, body.max_turn_rad_s.get()),
            "rad/s",
            "at its greatest bank and speed the body turns less than its set-points may ask for",
            "state a greater bank, or a smaller `max_turn_rad_s`",
        ),
        at_most(
            &body.circle_bank_deg,
            (body.circle_bank_deg.get(), body.bank_deg.get()),
            "degrees",
            "the circle is banked more than the body may be",
            "lower it",
        ),
        at_most(
            &body.circle_bank_deg,
            (body.circling(), body.max_turn_rad_s.get()),
            "rad/s",
            "the circle turns faster than a set-point may ask for",
            "state a wider circle: a smaller bank or a greater speed",
        ),
        at_least(
            &body.stays_m,
            (body.stays_m.get(), fastest * banks_s + 2.0 * body.circle_m_s.get() / body.circling()),
            "m",
            "the circle is wider than the place that it keeps to",
            "state a narrower circle or a wider place",
        ),
        at_most(
            &b.exclusion_mm,
            (b.exclusion_mm.get() as f64, body.body_m[1].get() * 1000.0),
            "mm",
            "two units may truly be nearer than that (span of the body)",
            "lower `exclusion_mm`",
        ),
        at_least(
            &b.fence_margin_mm,
            (stops + b.fence_margin_mm.get() as f64 / 1000.0, ahead),
            "m",
            "at full speed the body flies further ahead, before it circles, than the way to stop and the margin from which the fence guard is derived",
            "lower `braking_mm_s2`, or state a tighter circle",
        ),
    ];
    found.into_iter().flatten().collect()
}
