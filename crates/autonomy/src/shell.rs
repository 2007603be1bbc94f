//! The shell around driving: the fastest speed at which the body, on the arc that it is to follow, still stops before
//! the nearest thing.
//!
//! Things come from the map and from perception ([`crate::things`]), each with its extent. The body is its rectangle,
//! grown by a margin. The shell plans with the brakes of driving (`comfort_mm_s2`): a set-point that falls
//! as fast as the brakes allow is not followed in time.
//!
//! - *Within the margin of a thing*: the body may move along the thing and away, not nearer; within the margin of a
//!   person, only away.
//! - *A moving thing* may go on, stop or turn back while the unit brakes as hard as it surely can. At no moment may the
//!   two meet: passive safety (Bouraine, Fraichard and Salhi, *Provably safe navigation for mobile robots with limited
//!   field-of-views in dynamic environments*, Autonomous Robots 32, 2012).
//! - *A standing person* may walk off. The unit passes so slowly that it stands before the two can meet, or creeps.
//!
//! The way is left to `navigation` and to guests. World frame, millimetres.

use config::platform::Limits;
use wire::bounds::Bounds;

use crate::extent::Extent;
use crate::geofence::Motion;
use crate::things::Obstacle;

/// Room around the body, millimetres: four deviations of a fix (160 mm) and the way by which steering lags behind.
const SPARE_MM: f64 = 250.0;
/// Room given up to something that the unit stands beside already, millimetres: the swing of the rear when the unit
/// turns away.
const SWING_MM: f64 = 30.0;
/// Least room that is left after [`SWING_MM`], millimetres.
const LEAST_MM: f64 = 60.0;
/// Distance between two tested places along an arc, millimetres: less than the thinnest thing that counts, with the
/// margin on both sides.
const STEP_MM: f64 = 150.0;
/// Least gain of distance from a person by one step that counts as leaving, millimetres: a third of the step.
const LEAVES_MM: f64 = 50.0;
/// Time between two tested moments of braking, seconds: in 0.1 s unit and thing come nearer by less than the margin.
const TICK_S: f64 = 0.1;
/// Speed with which a person who stands is passed however near, mm/s: the body stands within 0.03 m.
const CREEPS_MM_S: f64 = 300.0;
/// Steps in which the speed is lowered until nothing is met.
const SLOWER: u32 = 8;

/// The two decelerations of a unit, as driving plans it and as it surely can, mm/s², and the time before either begins,
/// seconds.
#[derive(Clone, Copy, Debug)]
pub struct Brakes {
    comfort: f64,
    hard: f64,
    reaction: f64,
}

impl Brakes {
    /// Brakes of a platform.
    pub fn new(bounds: &Bounds, limits: &Limits) -> Self {
        let [comfort, hard] = [limits.comfort_mm_s2, bounds.braking_mm_s2].map(f64::from);
        Brakes { comfort, hard, reaction: limits.reaction_s() }
    }
}

/// The fastest forward speed, at most `speed`, that leaves room to stop on an arc of `curvature`. Steering lags, so the
/// present curvature `before` and the mean of the two are tested too.
pub fn speed_along(
    motion: &Motion,
    (speed, curvature, before): (f64, f64, f64),
    things: &[Obstacle],
    brakes: Brakes,
    limits: &Limits,
) -> f64 {
    within_room(motion, (speed, [curvature, before, (curvature + before) / 2.0]), STEP_MM, things, (brakes, limits))
}

/// The fastest backward speed, at most `speed`, that leaves room to stop on an arc of `curvature`; without a sign.
pub fn speed_back(
    motion: &Motion,
    (speed, curvature): (f64, f64),
    things: &[Obstacle],
    brakes: Brakes,
    limits: &Limits,
) -> f64 {
    within_room(motion, (speed, [curvature]), -STEP_MM, things, (brakes, limits))
}

/// Length of the arc backwards that the body can follow, at most `most`.
pub fn room_back(motion: &Motion, curvature: f64, most: f64, things: &[Obstacle], limits: &Limits) -> f64 {
    let things: Vec<&Extent> = things.iter().map(|thing| &thing.extent).collect();
    free_along(motion, (curvature, -STEP_MM), most, limits, &things)
}

/// The fastest speed up to `speed` that leaves room to stop on each of the arcs, in steps of `step`.
fn within_room<const ARCS: usize>(
    motion: &Motion,
    (speed, arcs): (f64, [f64; ARCS]),
    step: f64,
    things: &[Obstacle],
    (brakes, limits): (Brakes, &Limits),
) -> f64 {
    let reach = speed * brakes.reaction + speed * speed / (2.0 * brakes.comfort) + STEP_MM;
    let half = limits.body_mm.map(|mm| f64::from(mm) / 2.0);
    let body = libm::hypot(half[0], half[1]) + SPARE_MM;
    if speed <= 0.0 {
        return speed;
    }
    let stops_in = brakes.reaction + speed / brakes.hard;
    let near = |thing: &&Obstacle| thing.extent_after(stops_in).may_reach(motion.at, reach + body);
    let (move_by, stand): (Vec<&Obstacle>, Vec<&Obstacle>) =
        things.iter().filter(near).partition(|thing| thing.moves());
    let walk_off: Vec<&Obstacle> = stand.iter().copied().filter(|thing| thing.may_walk).collect();
    let stays = |person: &&Obstacle| arcs.iter().any(|arc| stays_beside(motion, (*arc, step), &person.extent, limits));
    if walk_off.iter().any(stays) {
        return 0.0;
    }
    let stand: Vec<&Extent> = stand.into_iter().map(|thing| &thing.extent).collect();
    let free = arcs.into_iter().map(|arc| free_along(motion, (arc, step), reach, limits, &stand)).fold(reach, f64::min);
    let free = if free >= reach { speed } else { stops_within(free, brakes.comfort, brakes.reaction).min(speed) };
    let meets = |speed: f64, things: &[&Obstacle]| {
        arcs.iter()
            .any(|arc| things.iter().any(|thing| meets(motion, (speed * step.signum(), *arc), thing, brakes, limits)))
    };
    let may = |speed: f64| !meets(speed, &move_by) && (speed <= CREEPS_MM_S || !meets(speed, &walk_off));
    let slower = (0..SLOWER).map(|i| free * f64::from(SLOWER - i) / f64::from(SLOWER));
    let creeping = free.min(CREEPS_MM_S);
    slower.filter(|speed| *speed > creeping).chain([creeping]).find(|speed| may(*speed)).unwrap_or(0.0)
}

/// True if the body, braking from `speed` on an arc after its reaction, and something that moves can be at one place at
/// one time.
fn meets(motion: &Motion, (speed, curvature): (f64, f64), thing: &Obstacle, brakes: Brakes, limits: &Limits) -> bool {
    let mut body = body_of(motion, limits);
    let (mut passed, mut left) = (0.0, speed.abs());
    while left > 0.0 {
        passed += TICK_S;
        if passed > brakes.reaction {
            left -= brakes.hard * TICK_S;
        }
        body = moved(&body, left.max(0.0).copysign(speed) * TICK_S, curvature, limits);
        if body.overlaps(&thing.extent_after(passed).grown(SPARE_MM)) {
            return true;
        }
    }
    false
}

/// True if the body is within the margin of a person and the first step of the arc does not lead away.
fn stays_beside(motion: &Motion, (curvature, step): (f64, f64), person: &Extent, limits: &Limits) -> bool {
    let body = body_of(motion, limits);
    let gap = body.distance(person.at) - person.half.0;
    gap < SPARE_MM && moved(&body, step, curvature, limits).distance(person.at) - person.half.0 < gap + LEAVES_MM
}

/// The body where it is.
fn body_of(motion: &Motion, limits: &Limits) -> Extent {
    let (sin, cos) = libm::sincos(motion.yaw);
    let [length, width] = limits.body_mm.map(f64::from);
    Extent { at: motion.at, axis: (cos, sin), half: (length / 2.0, width / 2.0) }
}

/// The body `step` further on an arc. Wheels that do not steer do not slide: their axle follows the heading, and the
/// middle swings about it.
fn moved(body: &Extent, step: f64, curvature: f64, limits: &Limits) -> Extent {
    let (sin, cos) = libm::sincos(curvature * step);
    let (axis, axle_behind) = (body.axis, f64::from(limits.rear_axle_mm));
    let axle = (body.at.0 + (step - axle_behind) * axis.0, body.at.1 + (step - axle_behind) * axis.1);
    let axis = (axis.0 * cos - axis.1 * sin, axis.0 * sin + axis.1 * cos);
    Extent { at: (axle.0 + axle_behind * axis.0, axle.1 + axle_behind * axis.1), axis, ..*body }
}

/// Length of the arc that the body can follow, in steps of `step`, before it touches something that stands; at most
/// `reach`.
fn free_along(motion: &Motion, (curvature, step): (f64, f64), reach: f64, limits: &Limits, things: &[&Extent]) -> f64 {
    let mut body = body_of(motion, limits);
    let rooms: Vec<Kept> = things.iter().map(|thing| Kept::between(thing, &body)).collect();
    let steps = libm::ceil(reach / STEP_MM) as u32;
    for taken in 1..=steps {
        body = moved(&body, step, curvature, limits);
        if rooms.iter().any(|room| room.is_broken(&body)) {
            return f64::from(taken - 1) * STEP_MM;
        }
    }
    reach
}

/// The room that is kept to a thing.
enum Kept {
    /// Room around the body: the margin, or about as much as there is where that is less.
    Room(Extent, f64),
    /// A fix places the body in it: its middle comes no nearer than this.
    Middle(Extent, f64),
}

impl Kept {
    fn between(thing: &Extent, body: &Extent) -> Kept {
        if !body.grown(SPARE_MM).overlaps(thing) {
            return Kept::Room(*thing, SPARE_MM);
        }
        if body.overlaps(thing) {
            // A body whose middle is in it shows that the thing is smaller, and not on which side.
            let distance = thing.distance(body.at);
            let middle = Extent { half: (0.0, 0.0), ..*thing };
            let inside = Kept::Middle(middle, middle.distance(body.at));
            return if distance > 0.0 { Kept::Middle(*thing, distance) } else { inside };
        }
        let free = most(SPARE_MM, |room| !body.grown(room).overlaps(thing));
        Kept::Room(*thing, (free - SWING_MM).max(LEAST_MM.min(free)))
    }

    fn is_broken(&self, body: &Extent) -> bool {
        match self {
            Kept::Room(thing, room) => body.grown(*room).overlaps(thing),
            Kept::Middle(thing, distance) => thing.distance(body.at) < *distance,
        }
    }
}

/// The most up to `limit`, to a millimetre, that holds; nought holds.
fn most(limit: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let (mut least, mut excess) = (0.0, limit);
    while excess - least > 1.0 {
        let middle = (least + excess) / 2.0;
        *if holds(middle) { &mut least } else { &mut excess } = middle;
    }
    least
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

    fn brakes() -> Brakes {
        Brakes::new(&Bounds::GROUND, &Limits::GROUND)
    }

    fn standing(extent: Extent) -> Obstacle {
        Obstacle { extent, velocity: (0.0, 0.0), may_walk: false }
    }

    fn standing_person(place: (f64, f64)) -> Obstacle {
        Obstacle { may_walk: true, ..standing(Extent::around_disc(place, 300.0)) }
    }

    #[test]
    fn car_beside_the_centre_line_is_not_passed_through() {
        // Its middle is 2 m beside the way, its side reaches over it.
        let car = [standing(Extent::new((8000.0, 2000.0), 1.2, (2100.0, 900.0)))];
        let along = |x| speed_along(&from(x, 0.0), (3000.0, 0.0, 0.0), &car, brakes(), &Limits::GROUND);
        assert_eq!(along(0.0), 3000.0);
        assert!(along(3000.0) < 2500.0 && along(6400.0) < 300.0, "{} {}", along(3000.0), along(6400.0));
        let aside = [standing(Extent::new((8000.0, 3200.0), 0.0, (2100.0, 900.0)))];
        assert_eq!(speed_along(&from(6400.0, 0.0), (3000.0, 0.0, 0.0), &aside, brakes(), &Limits::GROUND), 3000.0);
    }

    #[test]
    fn arc_between_two_curvatures_is_kept_free() {
        let post = [standing(Extent::around_disc((2500.0, 300.0), 100.0))];
        let turning = |before| speed_along(&from(0.0, 0.0), (3000.0, 0.4e-3, before), &post, brakes(), &Limits::GROUND);
        assert!(turning(0.0) < 3000.0, "it goes straight on for a while");
    }

    /// Within the margin of a wall at its side it goes on, not into the wall.
    #[test]
    fn unit_beside_a_wall_may_leave_it() {
        let wall = [standing(Extent::new((0.0, 600.0), 0.0, (9000.0, 50.0)))];
        let along =
            |curvature| speed_along(&from(0.0, 0.0), (1000.0, curvature, curvature), &wall, brakes(), &Limits::GROUND);
        assert_eq!(along(0.0), 1000.0);
        assert!(along(-0.4e-3) > 0.0 && along(0.4e-3) < 400.0, "{} {}", along(-0.4e-3), along(0.4e-3));
    }

    #[test]
    fn walker_who_crosses_is_not_met() {
        let walker =
            |place, velocity| [Obstacle { extent: Extent::around_disc(place, 300.0), velocity, may_walk: true }];
        let along =
            |things: &[Obstacle]| speed_along(&from(0.0, 0.0), (3000.0, 0.0, 0.0), things, brakes(), &Limits::GROUND);
        let crosses = along(&walker((2500.0, -2000.0), (0.0, 1400.0)));
        assert!(crosses < 2500.0, "{crosses}");
        assert_eq!(along(&walker((2500.0, -2000.0), (0.0, -1400.0))), crosses, "he may turn back");
        let clear_speed = along(&walker((2500.0, -2000.0), (1400.0, 0.0)));
        assert!((crosses..3000.0).contains(&clear_speed), "he walks beside it and may turn towards it: {clear_speed}");
        assert_eq!(along(&walker((2500.0, -3000.0), (1400.0, 0.0))), 3000.0, "farther away");
        assert_eq!(along(&walker((2500.0, -4000.0), (0.0, 1400.0))), 3000.0, "it stands before he is there");
        assert_eq!(along(&walker((900.0, 0.0), (-1400.0, 0.0))), 0.0, "he walks into it");
    }

    /// However near he stands, for he may stand there for ever.
    #[test]
    fn person_who_stands_is_passed_slowly() {
        let past = |place, may_walk| {
            let obstacles = [Obstacle { extent: Extent::around_disc(place, 300.0), velocity: (0.0, 0.0), may_walk }];
            speed_along(&from(0.0, 0.0), (3000.0, 0.0, 0.0), &obstacles, brakes(), &Limits::GROUND)
        };
        assert_eq!(past((1500.0, -1050.0), true), CREEPS_MM_S);
        assert_eq!(
            (past((1500.0, -1050.0), false), past((1500.0, -2500.0), true)),
            (3000.0, 3000.0),
            "a post; farther away"
        );
        let distance = past((1500.0, -1500.0), true);
        assert!((CREEPS_MM_S + 1.0..2500.0).contains(&distance), "{distance}");
    }

    /// A thing may be left along its side; a person may step aside, and where one stands is known to a decimetre.
    #[test]
    fn unit_may_only_leave_the_margin_of_a_person() {
        let clear_at = |may_walk, distance: f64| {
            let person = [Obstacle { may_walk, ..standing_person((0.0, -450.0 - distance - 300.0)) }];
            let back = speed_back(&from(0.0, 0.0), (500.0, 0.0), &person, brakes(), &Limits::GROUND);
            let ahead = speed_along(&from(0.0, 0.0), (500.0, 0.0, 0.0), &person, brakes(), &Limits::GROUND);
            (ahead, back)
        };
        assert_eq!(clear_at(true, 200.0), (0.0, 0.0));
        let (ahead, back) = clear_at(false, 200.0);
        assert!(ahead > 0.0 && back > 0.0, "{ahead} {back}");
        assert_eq!(clear_at(true, 300.0), (CREEPS_MM_S, CREEPS_MM_S));
        let obstacles = [standing_person((-1300.0, 200.0))];
        let ahead = speed_along(&from(0.0, 0.0), (500.0, 0.0, 0.0), &obstacles, brakes(), &Limits::GROUND);
        let back = speed_back(&from(0.0, 0.0), (500.0, 0.0), &obstacles, brakes(), &Limits::GROUND);
        assert_eq!((ahead, back), (CREEPS_MM_S, 0.0), "it leaves");
    }

    /// A car that is seen from its side, turned anyhow.
    #[test]
    fn unit_within_a_greatest_extent_may_only_leave_it() {
        let car = [standing(Extent::around_disc((1800.0, 1200.0), 2000.0))];
        let along =
            |curvature| speed_along(&from(0.0, 0.0), (1000.0, curvature, curvature), &car, brakes(), &Limits::GROUND);
        assert!(along(0.4e-3) < 100.0, "{}", along(0.4e-3));
        let back = speed_back(&from(0.0, 0.0), (500.0, 0.0), &car, brakes(), &Limits::GROUND);
        assert_eq!(back, 500.0);
    }

    /// LiDAR shows the middle and the width of its side, and the unit's middle is within that of both.
    #[test]
    fn car_across_the_nose_is_not_driven_into() {
        let car = [standing(Extent::around_disc((1000.0, 1000.0), 2100.0))];
        let ahead = speed_along(&from(0.0, 0.0), (1000.0, 0.0, 0.0), &car, brakes(), &Limits::GROUND);
        assert!(ahead < 100.0, "{ahead}");
        assert_eq!(speed_back(&from(0.0, 0.0), (500.0, 0.0), &car, brakes(), &Limits::GROUND), 500.0);
    }

    #[test]
    fn room_behind_is_that_of_the_arc_backwards() {
        let post = [standing(Extent::around_disc((-2500.0, 900.0), 200.0))];
        let back = |curvature| speed_back(&from(0.0, 0.0), (500.0, curvature), &post, brakes(), &Limits::GROUND);
        // Backwards a curve to the right swings the rear to the right, away from the post.
        assert_eq!((back(0.4e-3), back(0.0)), (500.0, 500.0));
        let near = [standing(Extent::around_disc((-1200.0, 0.0), 100.0))];
        assert!(speed_back(&from(0.0, 0.0), (500.0, 0.0), &near, brakes(), &Limits::GROUND) < 200.0);
    }
}
