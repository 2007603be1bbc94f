//! The tables of a platform that flies, and their checks: a body on rotors in place of `[vehicle]`, and the limits of the guards of any that flies.
//!
//! Ranges are held by the types; the values' meaning is given by `config::platform`.

use config::platform::{Aloft, Multirotor};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::body::GRAVITY;
use super::check::{at_least, at_most, inertia, unless};
use super::tables::SafeAction;
use super::{Platform, wing};
use crate::finding::Finding;
use crate::value::{Located, Real, Whole};

/// Metres of a body.
type Metres = Real<10, 10_000>;
/// Millimetres of height.
type Height = Whole<0, 100_000>;

/// A body on four rotors with the loops of a flight controller, in place of `[vehicle]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MultirotorTable {
    /// Mass, kg.
    pub mass_kg: Located<Real<10, 100_000>>,
    /// Moments of inertia about x, y and z, kg·m².
    pub inertia_kg_m2: Located<[Small; 3]>,
    /// Length, width and height of the body, metres.
    pub body_m: [Metres; 3],
    /// Lever of each rotor about x and about y, metres.
    pub arm_m: Metres,
    /// Greatest thrust of a rotor, N.
    pub thrust_n: Located<Real<50, 1_000_000>>,
    /// Greatest torque of a rotor about z, N·m.
    pub torque_n_m: Located<Small>,
    /// Time constant of a rotor, seconds.
    pub rotor_s: Real<5, 500>,
    /// Drag by airspeed, N·s/m.
    pub drag_n_s_m: Real<0, 50_000>,
    /// Drag by rate of turn, N·m·s.
    pub spin_drag_n_m_s: Real<0, 10_000>,
    /// Greatest horizontal speed of a set-point, m/s.
    pub max_speed_m_s: Located<Real<100, 30_000>>,
    /// Greatest vertical speed of a set-point, up or down, m/s.
    pub max_climb_m_s: Located<Real<100, 10_000>>,
    /// Greatest turn of a set-point, rad/s.
    pub max_turn_rad_s: Real<100, 6_000>,
    /// Change of the velocity that the controller follows, speeding up and braking, m/s².
    pub acceleration_m_s2: Located<[Real<100, 20_000>; 2]>,
    /// Greatest tilt, degrees.
    pub tilt_deg: Located<Real<5_000, 60_000>>,
    /// Capacity of the battery, W·h.
    pub battery_w_h: Real<10, 10_000_000>,
    /// Power in a hover, and of everything but the rotors, W.
    pub power_w: [Real<100, 100_000_000>; 2],
    /// Height at which a run begins, metres above the ground.
    pub cruise_m: Located<Real<500, 100_000>>,
    /// Time for which the body loiters without set-points before it lands, seconds.
    pub loiter_s: Real<0, 3_600_000>,
    /// Speed of the descent to land, m/s.
    pub descent_m_s: Located<Real<100, 5_000>>,
    /// Greatest horizontal speed of its safe motion, m/s.
    pub drift_m_s: Located<Real<100, 5_000>>,
    /// Least height above the surface below under set-points, metres.
    pub clearance_m: Located<Real<100, 50_000>>,
}

/// Small quantities: moments and torques.
pub type Small = Real<0, 100_000>;

/// Limits of the guards of a platform that flies. Heights are above the world's origin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AloftTable {
    /// Height that is flown at, millimetres.
    pub cruise_mm: Located<Height>,
    /// Lowest and highest height of the envelope, millimetres.
    pub floor_ceiling_mm: Located<[Height; 2]>,
    /// Greatest climb and descent that is asked for, mm/s.
    pub climb_mm_s: Located<Whole<1, 10_000>>,
    /// Distance between two sources of height, or between one and dead reckoning, that their errors can explain, millimetres.
    pub height_gate_mm: Located<Whole<100, 10_000>>,
    /// Room that set-points leave below `max_speed_mm_s`, for the part that gusts add, mm/s.
    #[serde(default)]
    pub gust_spare_mm_s: Whole<0, 10_000>,
}

impl MultirotorTable {
    /// The body as the simulation knows it.
    pub(super) fn body(&self, aloft: Option<&AloftTable>) -> Multirotor {
        Multirotor {
            ceiling_m: ceiling_m(aloft),
            mass_kg: self.mass_kg.get() as f32,
            inertia_kg_m2: self.inertia_kg_m2.map(|i| i.get() as f32),
            body_m: self.body_m.map(|edge| edge.get() as f32),
            arm_m: self.arm_m.get() as f32,
            thrust_n: self.thrust_n.get() as f32,
            torque_n_m: self.torque_n_m.get() as f32,
            rotor_s: self.rotor_s.get() as f32,
            drag_n_s_m: self.drag_n_s_m.get() as f32,
            spin_drag_n_m_s: self.spin_drag_n_m_s.get() as f32,
            max_speed_m_s: self.max_speed_m_s.get() as f32,
            max_climb_m_s: self.max_climb_m_s.get() as f32,
            max_turn_rad_s: self.max_turn_rad_s.get() as f32,
            acceleration_m_s2: self.acceleration_m_s2.map(|a| a.get() as f32),
            tilt_deg: self.tilt_deg.get() as f32,
            battery_w_h: self.battery_w_h.get() as f32,
            power_w: self.power_w.map(|w| w.get() as f32),
            cruise_m: self.cruise_m.get() as f32,
            loiter_s: self.loiter_s.get() as f32,
            descent_m_s: self.descent_m_s.get() as f32,
            drift_m_s: self.drift_m_s.get() as f32,
            clearance_m: self.clearance_m.get() as f32,
        }
    }
}

/// Greatest height above the world's origin, metres.
pub(super) fn ceiling_m(aloft: Option<&AloftTable>) -> f32 {
    aloft.map_or(f32::INFINITY, |aloft| aloft.floor_ceiling_mm[1].get() as f32 / 1000.0)
}

impl AloftTable {
    /// The limits as autonomy knows them.
    pub(super) fn limits(&self) -> Aloft {
        Aloft {
            cruise_mm: self.cruise_mm.unsigned() as u32,
            floor_ceiling_mm: self.floor_ceiling_mm.map(|mm| mm.unsigned() as u32),
            climb_mm_s: self.climb_mm_s.unsigned() as u32,
            height_gate_mm: self.height_gate_mm.unsigned() as u32,
            gust_spare_mm_s: self.gust_spare_mm_s.unsigned() as u32,
        }
    }
}

/// Share of the rotors' thrust that is left for torques.
const SPARE: f64 = 0.9;

/// Every mistake in the tables of a platform that flies.
pub(super) fn check(platform: &Platform) -> Vec<Finding> {
    let (able, cruise) = match (&platform.multirotor, &platform.fixed_wing) {
        (Some(body), None) => {
            (able(platform, body), Cruise::new(&body.cruise_m, &body.clearance_m, body.max_climb_m_s.get()))
        }
        (None, Some(body)) => {
            (wing::check(platform, body), Cruise::new(&body.cruise_m, &body.clearance_m, body.max_climb_m_s.get()))
        }
        (None, None) | (Some(_), Some(_)) => return paired(platform),
    };
    let Some(aloft) = &platform.aloft else { return paired(platform) };
    [able, heights(platform, &cruise, aloft), safe(platform)].into_iter().flatten().collect()
}

/// A body's part in the checks of height.
struct Cruise<'a> {
    begins_m: &'a Located<Real<500, 100_000>>,
    clearance_m: &'a Located<Real<100, 50_000>>,
    climb_m_s: f64,
}

impl<'a> Cruise<'a> {
    fn new(
        begins_m: &'a Located<Real<500, 100_000>>,
        clearance_m: &'a Located<Real<100, 50_000>>,
        climb_m_s: f64,
    ) -> Cruise<'a> {
        Cruise { begins_m, clearance_m, climb_m_s }
    }
}

/// One body that flies and the limits of its guards come together.
fn paired(platform: &Platform) -> Vec<Finding> {
    let (rotors, wing) = (platform.multirotor.as_ref(), platform.fixed_wing.as_ref());
    if let (Some(_), Some(wing)) = (rotors, wing) {
        let both = || "a body on rotors and on a fixed wing".to_owned();
        return unless(&wing.mass_kg, false, both, "take one of the two tables out").into_iter().collect();
    }
    let of_body = rotors.map(|body| &body.mass_kg).or(wing.map(|body| &body.mass_kg)).and_then(|mass| {
        let no_limits = || "a body that flies without limits of height".to_owned();
        unless(mass, false, no_limits, "state them in a table `[aloft]`")
    });
    let of_limits = platform.aloft.as_ref().and_then(|aloft| {
        unless(
            &aloft.cruise_mm,
            false,
            || "limits of height without a body that flies".to_owned(),
            "state it in a table `[multirotor]` or `[fixed_wing]`",
        )
    });
    of_body.into_iter().chain(of_limits).collect()
}

/// The body against the bounds.
fn able(platform: &Platform, body: &MultirotorTable) -> Vec<Finding> {
    let b = &platform.bounds;
    let [_, slower] = body.acceleration_m_s2.map(|a| a.get());
    let leans = GRAVITY * libm::tan(body.tilt_deg.get().to_radians());
    let weight = body.mass_kg.get() * GRAVITY;
    let level = weight / libm::cos(body.tilt_deg.get().to_radians());
    let found = [
        inertia(&body.inertia_kg_m2, body.inertia_kg_m2.map(|i| i.get())),
        unless(
            &body.torque_n_m,
            body.torque_n_m.get() > 0.0,
            || "rotors without a torque cannot turn the body about z".to_owned(),
            "state the greatest torque of a rotor",
        ),
        at_least(
            &body.acceleration_m_s2,
            (slower, b.braking_mm_s2.get() as f64 / 1000.0),
            "m/s²",
            "the body brakes less than `braking_mm_s2`",
            "state stronger braking, or lower `braking_mm_s2`",
        ),
        at_least(
            &body.tilt_deg,
            (leans, slower + body.drag_n_s_m.get() * body.max_speed_m_s.get() / body.mass_kg.get()),
            "m/s²",
            "at its greatest tilt the body cannot brake as stated against a wind of its largest speed",
            "state a greater tilt, or less braking",
        ),
        at_least(
            &body.thrust_n,
            (SPARE * 4.0 * body.thrust_n.get(), level),
            "N",
            "nine tenths of the rotors' thrust do not hold the body up at its greatest tilt",
            "state stronger rotors, or a smaller tilt",
        ),
        at_least(
            &body.max_speed_m_s,
            (body.max_speed_m_s.get(), b.max_speed_mm_s.get() as f64 / 1000.0),
            "m/s",
            "the body never reaches `max_speed_mm_s`, from which the margins are derived",
            "lower `max_speed_mm_s`, or state a faster body",
        ),
        at_most(
            &b.exclusion_mm,
            (b.exclusion_mm.get() as f64, body.body_m[0].get() * 1000.0),
            "mm",
            "two units may truly be nearer than that (length of the body)",
            "lower `exclusion_mm`",
        ),
        at_most(
            &body.drift_m_s,
            (body.drift_m_s.get(), b.max_speed_mm_s.get() as f64 / 1000.0),
            "m/s",
            "the safe motion is faster than the largest speed",
            "lower it",
        ),
    ];
    found.into_iter().flatten().collect()
}

/// Heights against each other.
fn heights(platform: &Platform, body: &Cruise<'_>, aloft: &AloftTable) -> Vec<Finding> {
    let [floor, ceiling] = aloft.floor_ceiling_mm.map(|mm| mm.get() as f64);
    let (cruise, gate) = (aloft.cruise_mm.get() as f64, aloft.height_gate_mm.get() as f64);
    let margin = platform.bounds.fence_margin_mm.get() as f64;
    let found = [
        at_least(
            &aloft.floor_ceiling_mm,
            (cruise - gate, floor),
            "mm",
            "a height that is wrong by the gate puts the body below its floor",
            "lower the floor or the gate, or fly higher",
        ),
        at_most(
            &aloft.floor_ceiling_mm,
            (cruise + gate + margin, ceiling),
            "mm",
            "a height that is wrong by the gate puts the body within the margin of its ceiling (`fence_margin_mm`)",
            "raise the ceiling, lower the gate, or fly lower",
        ),
        unless(
            body.begins_m,
            (body.begins_m.get() * 1000.0 - cruise).abs() <= gate,
            || "a run begins further from the height that is flown at than the gate".to_owned(),
            "make `cruise_m` and `cruise_mm` agree",
        ),
        at_most(
            &aloft.height_gate_mm,
            (gate, margin),
            "mm",
            "heights are believed that are wrong by more than the margin of the envelope (`fence_margin_mm`)",
            "narrow the gate",
        ),
        at_most(
            &aloft.climb_mm_s,
            (aloft.climb_mm_s.get() as f64, body.climb_m_s * 1000.0),
            "mm/s",
            "the guards' climb is faster than the body's",
            "lower it",
        ),
        at_most(
            body.clearance_m,
            (body.clearance_m.get() * 1000.0, cruise - gate),
            "mm",
            "the least height above the surface below is not kept at the height that is flown at",
            "lower it, or fly higher",
        ),
    ];
    found.into_iter().flatten().collect()
}

fn safe(platform: &Platform) -> Vec<Finding> {
    let action = &platform.safe.action;
    let stops = || "a body that flies does not stop in the air".to_owned();
    unless(action, **action == SafeAction::LoiterThenLand, stops, "state `action = \"loiter-then-land\"`")
        .into_iter()
        .collect()
}
