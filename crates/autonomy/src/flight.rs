//! A unit that moves freely: its way in terms of a velocity, and the height that goes with it in the air.
//!
//! Direction and speed are `navigation`'s, as on wheels: the unit goes ahead and turns. Standing still is no rest there, so rest is a motion that
//! the plant has by itself.

use wire::drive::SetPoint;
use wire::platform::Aloft;

use crate::navigation;

/// Climb asked for by the distance from the height that is flown at, 1/s.
const CLIMB: f64 = 1.0;

/// Below this the unit hovers, mm/s: it turns about itself, since a hover has no arc to turn on.
const HOVERS_MM_S: f64 = 100.0;

/// A thing below the unit counts as in its way down to this distance below its height, millimetres: half of a body, and the error of the height.
pub const BELOW_MM: f64 = 500.0;

/// The velocity that goes this way; in the air, at this height (mm), towards the height that is flown at. A hover turns on its curvature as at the
/// speed `turning` (mm/s).
pub fn velocity(way: navigation::SetPoint, height: Option<(&Aloft, f64)>, turning: f64) -> SetPoint {
    let climb = height.map_or(0.0, |(limits, height)| {
        let most = f64::from(limits.climb_mm_s);
        ((f64::from(limits.cruise_mm) - height) * CLIMB).clamp(-most, most)
    });
    let hovers = height.is_some() && way.speed.abs() < HOVERS_MM_S;
    let turn = if hovers { turning } else { way.speed } * way.curvature * 1000.0;
    SetPoint::Velocity { mm_s: [way.speed as i32, 0, climb as i32], turn_mrad_s: turn as i32 }
}

/// Greatest top of a thing that a way may lead over, above the ground, millimetres: at the height that is flown at the unit is as far above it as
/// above the ground at the floor.
pub fn flown_over(limits: &Aloft) -> f64 {
    f64::from(limits.cruise_mm) - f64::from(limits.floor_ceiling_mm[0])
}

/// Distance to the limits of height, `margin` (mm) off the ceiling, mm; negative outside. The floor is above the least distance to the ground by
/// itself.
pub fn spare(height: f64, limits: &Aloft, margin: f64) -> f64 {
    let [floor, ceiling] = limits.floor_ceiling_mm.map(f64::from);
    (height - floor).min(ceiling - margin - height)
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
        let asked = |height: f64| velocity(way, Some((&LIMITS, height)), 800.0);
        let fly = |climb: i32| SetPoint::Velocity { mm_s: [1000, 0, climb], turn_mrad_s: 400 };
        assert_eq!([2500.0, 2400.0, 0.0, 9000.0].map(asked), [fly(0), fly(100), fly(800), fly(-800)]);
    }

    /// It has no reverse gear, and something may stand close ahead.
    #[test]
    fn hover_turns_about_itself() {
        let way = navigation::SetPoint { speed: 0.0, curvature: 0.0004 };
        let turns = |height| match velocity(way, height, 800.0) {
            SetPoint::Velocity { turn_mrad_s, .. } => turn_mrad_s,
            other => panic!("{other:?}"),
        };
        assert_eq!((turns(Some((&LIMITS, 2500.0))), turns(None)), (320, 0), "in the air; a line of sight");
    }

    #[test]
    fn envelope_has_a_floor_and_a_ceiling() {
        let spare = |height: f64| spare(height, &LIMITS, 500.0);
        assert_eq!([2500.0, 900.0, 5600.0].map(spare), [1500.0, -100.0, -100.0]);
    }
}
