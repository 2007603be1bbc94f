//! A unit that moves freely: its way in terms of a velocity, and the height that goes with it in the air.
//!
//! Direction and speed are `navigation`'s, as on wheels: the unit goes ahead and turns. Standing still is no rest
//! there, so rest is a motion that the plant has by itself.

use config::platform::Aloft;
use wire::drive::SetPoint;

use crate::extent::Extent;
use crate::geofence::{Motion, Point};
use crate::navigation;

/// Climb asked for by the distance from the height that is flown at, 1/s.
const CLIMB: f64 = 1.0;

/// Below this the unit hovers, mm/s: it turns about itself, since a hover has no arc to turn on.
const HOVERS_MM_S: f64 = 100.0;

/// Room to walls that a body in the air keeps by going sideways, millimetres: that of the narrowest way that is
/// planned.
const KEEPS_OFF_MM: f64 = 500.0;
/// Speed away from a wall by the room that is missing, 1/s: at the shell's margin (250 mm) that with which gusts move a
/// hover (0.5 m/s).
const KEEPS_OFF: f64 = 2.0;
/// Most of it, mm/s.
const KEEPS_OFF_MM_S: f64 = 500.0;
/// Deviations of both sources of height in the gate, by two (docs/reference/bounds.md#air).
const HEIGHT_ERRORS: f64 = 0.5;

/// A thing below the unit counts as in its way down to this distance below its height, millimetres: half of a body, and
/// the error of the height.
const BELOW_MM: f64 = 500.0;

/// The velocity that goes this way; in the air, at this height (mm), towards the height that is flown at, and off the
/// walls with a velocity ahead and to the left (mm/s). A hover turns on its curvature as at the speed `turning` (mm/s).
pub fn velocity(way: navigation::SetPoint, height: Option<(&Aloft, f64)>, (turning, off): (f64, Point)) -> SetPoint {
    let climb = height.map_or(0.0, |(limits, height)| {
        let most = f64::from(limits.climb_mm_s);
        ((f64::from(limits.cruise_mm) - height) * CLIMB).clamp(-most, most)
    });
    let hovers = height.is_some() && way.speed.abs() < HOVERS_MM_S;
    let turn = if hovers { turning } else { way.speed } * way.curvature * 1000.0;
    SetPoint::Velocity { mm_s: [(way.speed + off.0) as i32, off.1 as i32, climb as i32], turn_mrad_s: turn as i32 }
}

/// Velocity off the walls that are nearer to a round body than the narrowest way is, ahead and to the left, mm/s. A
/// heading alone holds no place, and gusts move a hover sideways.
pub fn off_walls<'a>(motion: &Motion, radius: f64, walls: impl Iterator<Item = &'a Extent>) -> Point {
    let near = walls.filter(|wall| wall.may_reach(motion.at, radius + KEEPS_OFF_MM)).map(|wall| {
        let (east, north) = wall.offset_to(motion.at);
        let distance = libm::hypot(east, north).max(1.0);
        let missing = (KEEPS_OFF_MM + radius - distance).max(0.0);
        (east / distance * missing * KEEPS_OFF, north / distance * missing * KEEPS_OFF)
    });
    let (east, north) = near.fold((0.0, 0.0), |all, one| (all.0 + one.0, all.1 + one.1));
    let share = (KEEPS_OFF_MM_S / libm::hypot(east, north).max(1.0)).min(1.0);
    let (sin, cos) = libm::sincos(motion.yaw);
    (share * (east * cos + north * sin), share * (north * cos - east * sin))
}

/// Least tops of the things that a unit at `height` must not touch, millimetres: of the map's, so that it stays as far
/// above them as above the ground at the floor; of others, which have the largest top of their class.
pub fn reached(limits: &Aloft, height: f64) -> [f64; 2] {
    [(height - f64::from(limits.floor_ceiling_mm[0])).max(0.0), height - BELOW_MM]
}

/// Greatest top of a thing that a way may lead over, above the ground, millimetres: the unit is as far above it as
/// above the ground at the floor, four deviations of the height below the one that is flown at.
pub fn flown_over(limits: &Aloft) -> f64 {
    let lowest = f64::from(limits.cruise_mm) - HEIGHT_ERRORS * f64::from(limits.height_gate_mm);
    (lowest - f64::from(limits.floor_ceiling_mm[0])).max(0.0)
}

/// Distance to the limits of height, `margin` (mm) off the ceiling, mm; negative outside. The floor is above the least
/// distance to the ground by itself.
pub fn spare(height: f64, limits: &Aloft, margin: f64) -> f64 {
    let [floor, ceiling] = limits.floor_ceiling_mm.map(f64::from);
    (height - floor).min(ceiling - margin - height)
}

/// A climb (mm/s) as far as the limits of height let it be followed, with the distance that [`spare`] asks for.
pub fn climb_within(climb: f64, height: f64, limits: &Aloft, margin: f64) -> f64 {
    let [floor, ceiling] = limits.floor_ceiling_mm.map(f64::from);
    let most = f64::from(limits.climb_mm_s);
    let (down, up) = ((height - floor - margin) * CLIMB, (ceiling - 2.0 * margin - height) * CLIMB);
    climb.min(up).max(-down.max(0.0)).clamp(-most, most)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) const LIMITS: Aloft = Aloft {
        cruise_mm: 2500,
        floor_ceiling_mm: [1000, 6000],
        climb_mm_s: 800,
        height_gate_mm: 800,
        gust_spare_mm_s: 0,
    };

    #[test]
    fn height_is_brought_back_within_the_climb() {
        let way = navigation::SetPoint { speed: 1000.0, curvature: 0.0004 };
        let requested = |height: f64| velocity(way, Some((&LIMITS, height)), (800.0, (0.0, 0.0)));
        let fly = |climb: i32| SetPoint::Velocity { mm_s: [1000, 0, climb], turn_mrad_s: 400 };
        assert_eq!([2500.0, 2400.0, 0.0, 9000.0].map(requested), [fly(0), fly(100), fly(800), fly(-800)]);
    }

    /// Towards the ceiling and the floor a climb ends where the height guard's margin begins.
    #[test]
    fn climb_ends_within_the_limits_of_height() {
        let [floor, ceiling] = LIMITS.floor_ceiling_mm.map(f64::from);
        let climb = |height, asked| climb_within(asked, height, &LIMITS, 500.0);
        let most = f64::from(LIMITS.climb_mm_s);
        assert_eq!((climb(2500.0, 9000.0), climb(ceiling - 1000.0, 900.0)), (most, 0.0));
        assert_eq!(climb(ceiling + 20_000.0, 0.0), -most, "far above it the unit comes down no faster than it may");
        assert_eq!((climb(floor + 500.0, -900.0), climb(floor + 600.0, -900.0)), (0.0, -100.0));
    }

    /// A hovering unit has no reverse gear, and something may stand close ahead.
    #[test]
    fn hover_turns_about_itself() {
        let way = navigation::SetPoint { speed: 0.0, curvature: 0.0004 };
        let turns = |height| match velocity(way, height, (800.0, (0.0, 0.0))) {
            SetPoint::Velocity { turn_mrad_s, .. } => turn_mrad_s,
            other @ (SetPoint::Course { .. } | SetPoint::Rest) => panic!("{other:?}"),
        };
        assert_eq!((turns(Some((&LIMITS, 2500.0))), turns(None)), (320, 0), "in the air; a line of sight");
    }

    #[test]
    fn body_near_a_wall_goes_off_it_sideways() {
        let wall = Extent::new((0.0, 1000.0), 0.0, (5000.0, 500.0));
        let off = |y: f64, yaw: f64, walls: &[Extent]| {
            off_walls(&Motion { at: (0.0, y), yaw, speed: 0.0 }, 350.0, walls.iter())
        };
        assert_eq!(off(-400.0, 0.0, &[wall]), (0.0, 0.0), "900 mm away");
        assert_eq!(off(-100.0, 0.0, &[wall]), (0.0, -500.0), "at the shell's margin");
        let (ahead, left) = off(-250.0, core::f64::consts::FRAC_PI_2, &[wall]);
        assert!((ahead + 200.0).abs() < 1e-6 && left.abs() < 1e-6, "backwards, where it faces it");
        let other = Extent { at: (0.0, -1500.0), ..wall };
        assert_eq!(off(-250.0, 0.0, &[wall, other]), (0.0, 0.0), "in the middle of a passage");
    }

    /// Four deviations of the height stay above the floor's distance.
    #[test]
    fn ways_lead_over_what_is_low() {
        assert_eq!(flown_over(&LIMITS), 1100.0);
        assert_eq!(reached(&LIMITS, 2500.0), [1500.0, 2000.0]);
    }

    #[test]
    fn envelope_has_a_floor_and_a_ceiling() {
        let spare = |height: f64| spare(height, &LIMITS, 500.0);
        assert_eq!([2500.0, 900.0, 5600.0].map(spare), [1500.0, -100.0, -100.0]);
    }
}
