//! The shell around driving: the fastest speed from which the body, along the arc that it is asked to follow, still stops before the nearest thing.
//! It brakes as driving plans to (`comfort_mm_s2`): a set-point that falls as fast as the brakes allow is not followed in time.
//!
//! Things are the map's and those that were perceived ([`crate::things`]), each with its extent. The body is its rectangle, grown by a spare
//! margin. The way is left to `navigation` and to guests; a unit that stands already within the margin of something may move
//! along it and away, not nearer. World frame, millimetres.

use wire::platform::Limits;

use crate::extent::Extent;
use crate::geofence::Motion;

/// Room around the body: four deviations of a fix (160 mm) and the way by which steering lags behind.
const SPARE_MM: f64 = 250.0;
/// Of the room to something that the unit is beside already, the part that its rear takes when it turns away.
const SWING_MM: f64 = 30.0;
/// And the least that is left by that.
const LEAST_MM: f64 = 60.0;
/// Between two places of the body along an arc: less than the thinnest thing that counts, with the margin on both sides.
const STEP_MM: f64 = 150.0;

/// The fastest forward speed up to `speed` on an arc of `curvature` that leaves room to stop. Steering takes time to follow, so the arc between
/// is looked at too: from the curvature of now, `before`.
pub fn speed_along(
    motion: &Motion,
    (speed, curvature, before): (f64, f64, f64),
    things: &[Extent],
    limits: &Limits,
) -> f64 {
    let (braking, reaction) = (f64::from(limits.comfort_mm_s2), limits.reaction_s());
    let reach = speed * reaction + speed * speed / (2.0 * braking) + STEP_MM;
    let half = limits.body_mm.map(|mm| f64::from(mm) / 2.0);
    let body = libm::hypot(half[0], half[1]) + SPARE_MM;
    let near: Vec<&Extent> = things.iter().filter(|thing| thing.near(motion.at, reach + body)).collect();
    if near.is_empty() || speed <= 0.0 {
        return speed;
    }
    let arcs = [curvature, before, (curvature + before) / 2.0];
    let free = arcs.into_iter().map(|arc| free_along(motion, arc, reach, limits, &near)).fold(reach, f64::min);
    if free >= reach { speed } else { stops_within(free, braking, reaction).min(speed) }
}

/// Length of the arc that the body can follow before it touches something, at most `reach`.
fn free_along(motion: &Motion, curvature: f64, reach: f64, limits: &Limits, things: &[&Extent]) -> f64 {
    let (sin, cos) = libm::sincos(motion.yaw);
    let (turn_sin, turn_cos) = libm::sincos(curvature * STEP_MM);
    let [length, width] = limits.body_mm.map(f64::from);
    let mut body = Extent { at: motion.at, axis: (cos, sin), half: (length / 2.0, width / 2.0) };
    // Wheels that do not steer do not slide: their axle follows the heading, and the middle swings about it.
    let axle_behind = f64::from(limits.rear_axle_mm);
    let kept: Vec<Kept> = things.iter().map(|thing| Kept::to(thing, &body)).collect();
    let steps = libm::ceil(reach / STEP_MM) as u32;
    for step in 1..=steps {
        let axis = body.axis;
        let axle = (body.at.0 + (STEP_MM - axle_behind) * axis.0, body.at.1 + (STEP_MM - axle_behind) * axis.1);
        body.axis = (axis.0 * turn_cos - axis.1 * turn_sin, axis.0 * turn_sin + axis.1 * turn_cos);
        body.at = (axle.0 + axle_behind * body.axis.0, axle.1 + axle_behind * body.axis.1);
        if things.iter().zip(&kept).any(|(thing, kept)| kept.is_broken(thing, &body)) {
            return f64::from(step - 1) * STEP_MM;
        }
    }
    reach
}

/// The room that is kept to a thing.
enum Kept {
    /// So much around the body: the margin, or about as much as there is where that is less.
    Room(f64),
    /// By the fix the body is in it: its middle comes no nearer than this.
    Middle(f64),
}

impl Kept {
    fn to(thing: &Extent, body: &Extent) -> Kept {
        if !body.grown(SPARE_MM).overlaps(thing) {
            return Kept::Room(SPARE_MM);
        }
        if body.overlaps(thing) {
            return Kept::Middle(thing.distance(body.at));
        }
        let (mut free, mut taken) = (0.0, SPARE_MM);
        while taken - free > 1.0 {
            let room = (free + taken) / 2.0;
            *if body.grown(room).overlaps(thing) { &mut taken } else { &mut free } = room;
        }
        Kept::Room((free - SWING_MM).max(LEAST_MM.min(free)))
    }

    fn is_broken(&self, thing: &Extent, body: &Extent) -> bool {
        match self {
            Kept::Room(room) => body.grown(*room).overlaps(thing),
            Kept::Middle(distance) => thing.distance(body.at) < *distance,
        }
    }
}

/// The speed from which the reaction and the brakes take `distance`: v t + v² / 2 b = d.
fn stops_within(distance: f64, braking: f64, reaction: f64) -> f64 {
    let lost = braking * reaction;
    (lost * lost + 2.0 * braking * distance).sqrt() - lost
}

#[cfg(test)]
mod tests {
    use super::*;

    fn from(x: f64, y: f64) -> Motion {
        Motion { at: (x, y), yaw: 0.0, speed: 3000.0 }
    }

    #[test]
    fn car_beside_the_centre_line_is_not_passed_through() {
        // Its middle is 2 m beside the way, its side reaches over it.
        let car = [Extent::new((8000.0, 2000.0), 1.2, (2100.0, 900.0))];
        let along = |x| speed_along(&from(x, 0.0), (3000.0, 0.0, 0.0), &car, &Limits::GROUND);
        assert_eq!(along(0.0), 3000.0);
        assert!(along(3000.0) < 2500.0 && along(6400.0) < 300.0, "{} {}", along(3000.0), along(6400.0));
        let aside = [Extent::new((8000.0, 3200.0), 0.0, (2100.0, 900.0))];
        assert_eq!(speed_along(&from(6400.0, 0.0), (3000.0, 0.0, 0.0), &aside, &Limits::GROUND), 3000.0);
    }

    #[test]
    fn arc_between_two_curvatures_is_kept_free() {
        let post = [Extent::around((2500.0, 300.0), 100.0)];
        let turning = |before| speed_along(&from(0.0, 0.0), (3000.0, 0.4e-3, before), &post, &Limits::GROUND);
        assert!(turning(0.0) < 3000.0, "it goes straight on for a while");
    }

    /// Within the margin of a wall at its side it goes on, not into the wall.
    #[test]
    fn unit_beside_a_wall_may_leave_it() {
        let wall = [Extent::new((0.0, 600.0), 0.0, (9000.0, 50.0))];
        let along = |curvature| speed_along(&from(0.0, 0.0), (1000.0, curvature, curvature), &wall, &Limits::GROUND);
        assert_eq!(along(0.0), 1000.0);
        assert!(along(-0.4e-3) > 0.0 && along(0.4e-3) < 400.0, "{} {}", along(-0.4e-3), along(0.4e-3));
    }
}
