//! Turning in more moves than one: where the unit cannot follow the way ahead from where it stands, it backs up with
//! its wheels turned the other way, as a driver turns in a narrow street, and goes on from there.
//!
//! The recovery is that of Nav2 (Macenski, Martín, White and Ginés Clavero, *The Marathon 2: A Navigation System*, IROS
//! 2020), on an arc. A move is slow and short, and needs LiDAR to look behind. Where one move does not help, the next
//! ones go straight back and farther: a unit that comes to a gate at an angle needs the way to straighten. The way is
//! left to `mission`, following it to `navigation`. World frame, millimetres; curvature in 1/mm, positive to the left.

use wire::time::{Instant, Span};

use crate::geofence::{Motion, Point, distance};
use crate::navigation::{self, SetPoint, Surroundings};
use crate::shell;

/// Below this the unit stands, and a set-point asks it to, mm/s: above the noise of odometry.
const STANDS_MM_S: f64 = 100.0;
/// Time for which it stands before it backs up.
const PATIENCE: Span = Span::s(2);
/// Way of the first move, at most, and of any move, at least, millimetres.
const BACK_MM: f64 = 2000.0;
const LEAST_MM: f64 = 300.0;
/// Factor up to which the way grows from try to try.
const FARTHER: u32 = 3;
/// Distance from the first move within which the next one is a try of the same, millimetres.
const AGAIN_MM: f64 = 8000.0;
/// Speed of a move, mm/s.
const BACK_MM_S: f64 = 500.0;
/// Time that a move may take beyond its way at half of the speed, milliseconds.
const LONGEST_MS: f64 = 2000.0;

/// State of turning.
#[derive(Clone, Copy, Debug, Default)]
pub struct Turn {
    stands: Option<Instant>,
    back: Option<Back>,
    /// Place of the first of several tries of one move, and their number.
    tries: Option<(Point, u32)>,
}

/// A move backwards.
#[derive(Clone, Copy, Debug)]
struct Back {
    curvature: f64,
    from: Point,
    length: f64,
    until: Instant,
}

impl Turn {
    /// Ends a move under way: the unit is not to drive, or has no way.
    pub fn end(&mut self) {
        (self.stands, self.back) = (None, None);
    }

    /// The set-point in place of `requested`, which follows the way. LiDAR has to look behind the unit.
    pub fn back_up(&mut self, requested: SetPoint, motion: &Motion, env: &Surroundings<'_>, now: Instant) -> SetPoint {
        if let Some(back) = self.back {
            let going = back.set_point(motion, env);
            let goes_on = now < back.until && distance(motion.at, back.from) < back.length;
            if goes_on && going.speed < -STANDS_MM_S {
                return going;
            }
            self.end();
            return SetPoint { speed: 0.0, ..requested };
        }
        if requested.speed > STANDS_MM_S || motion.speed.abs() > STANDS_MM_S {
            self.stands = None;
            return requested;
        }
        if now.since(*self.stands.get_or_insert(now)) >= PATIENCE {
            self.stands = None;
            self.begin(requested.curvature, motion, env, now);
        }
        requested
    }

    /// Begins a move: first on the arc with the most room, of that which turns on, straight back, and that which was
    /// come by; then straight back, where there is room. None without room or reverse gear.
    fn begin(&mut self, curvature: f64, motion: &Motion, env: &Surroundings<'_>, now: Instant) {
        if env.limits.reverse_mm_s == 0 {
            return;
        }
        let (first, tries) =
            self.tries.filter(|(place, _)| distance(*place, motion.at) < AGAIN_MM).unwrap_or((motion.at, 0));
        let length = BACK_MM * f64::from(1 + tries % FARTHER);
        let room = |curvature: f64| shell::room_back(motion, curvature, length, env.things, env.limits);
        let arcs = [-curvature, 0.0, curvature].map(|curvature| (curvature, room(curvature)));
        let straight = arcs.into_iter().find(|(arc, room)| *arc == 0.0 && *room >= LEAST_MM && length > BACK_MM);
        // The first of equal ones.
        let widest = arcs.into_iter().rev().max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((curvature, length)) = straight.or(widest).filter(|(_, room)| *room >= LEAST_MM) {
            let longest = Span::ms((LONGEST_MS + 2.0 * length / BACK_MM_S * 1000.0) as u64);
            self.back = Some(Back { curvature, from: motion.at, length, until: now + longest });
            self.tries = Some((first, tries + 1));
        }
    }
}

impl Back {
    fn set_point(&self, motion: &Motion, env: &Surroundings<'_>) -> SetPoint {
        let fastest = BACK_MM_S.min(env.mode_speed).min(f64::from(env.limits.reverse_mm_s));
        navigation::backwards(SetPoint { speed: fastest, curvature: self.curvature }, motion, env)
    }
}

#[cfg(test)]
mod tests {
    use config::platform::Limits;
    use wire::bounds::Bounds;

    use super::*;
    use crate::extent::Extent;
    use crate::geofence::Geofence;
    use crate::things::Obstacle;

    const AT_THE_ORIGIN: Motion = Motion { at: (0.0, 0.0), yaw: 0.0, speed: 0.0 };

    /// Between fences far away to the north, east and south, and one at `west`.
    fn fence(west: i32) -> Geofence {
        Geofence::new(&[(west, -50_000), (50_000, -50_000), (50_000, 50_000), (west, 50_000)])
    }

    fn surroundings<'a>(things: &'a [Obstacle], fence: &'a Geofence, limits: &'a Limits) -> Surroundings<'a> {
        Surroundings { mode_speed: 3000.0, seen: &[], things, steered: 0.0, fence, bounds: &Bounds::GROUND, limits }
    }

    /// Set-points of a unit that stands at the origin and is asked to turn left into something, ten a second.
    fn asked_of(things: &[Obstacle], limits: &Limits, seconds: u64) -> Vec<SetPoint> {
        let fence = fence(-50_000);
        let env = surroundings(things, &fence, limits);
        let (requested, mut turn) = (SetPoint { speed: 0.0, curvature: 0.4e-3 }, Turn::default());
        let ticks = (0..seconds * 10).map(|tick| Instant(0) + Span::ms(100 * tick));
        ticks.map(|now| turn.back_up(requested, &AT_THE_ORIGIN, &env, now)).collect()
    }

    fn wall(place: Point) -> Obstacle {
        Obstacle { extent: Extent::new(place, 0.0, (300.0, 3000.0)), velocity: (0.0, 0.0), may_walk: false }
    }

    #[test]
    fn unit_before_a_wall_backs_up_turning_on() {
        let points = asked_of(&[wall((1500.0, 0.0))], &Limits::GROUND, 5);
        assert!(points[..19].iter().all(|set_point| set_point.speed == 0.0), "for two seconds it stands");
        let back = points.last().unwrap();
        assert_eq!((back.speed, back.curvature), (-BACK_MM_S, -0.4e-3));
    }

    #[test]
    fn unit_does_not_back_into_who_walks_behind() {
        let ahead = wall((1500.0, 0.0));
        let backs = |place| {
            let walker = Obstacle { extent: Extent::around_disc(place, 300.0), velocity: (0.0, 900.0), may_walk: true };
            asked_of(&[ahead, walker], &Limits::GROUND, 20).iter().any(|set_point| set_point.speed < 0.0)
        };
        assert_eq!((backs((-1500.0, -500.0)), backs((-5000.0, 3500.0))), (false, true), "behind it and farther away");
    }

    /// Backwards the unit creeps up to the margin as it does forwards; from the margin it backs away.
    #[test]
    fn unit_does_not_back_over_the_fences_margin() {
        let fence = fence(-2400);
        let env = surroundings(&[], &fence, &Limits::GROUND);
        let backing = Back { curvature: 0.0, from: (0.0, 0.0), length: 4000.0, until: Instant(0) };
        let facing_it = Motion { at: (-1350.0, 0.0), yaw: core::f64::consts::PI, speed: 0.0 };
        assert_eq!(backing.set_point(&facing_it, &env).speed, -BACK_MM_S);
        let back = Back { curvature: 0.0, from: (0.0, 0.0), length: 4000.0, until: Instant(0) };
        let speed = |x| back.set_point(&Motion { at: (x, 0.0), ..AT_THE_ORIGIN }, &env).speed;
        let creeping = f64::from(Limits::GROUND.turning_mm_s) / 2.0;
        assert_eq!([3000.0, -950.0, -1250.0].map(speed), [-BACK_MM_S, -creeping, 0.0]);
    }

    #[test]
    fn next_tries_are_longer_and_straight() {
        let (mut turn, fence, things) = (Turn::default(), fence(-50_000), [wall((1500.0, 0.0))]);
        let env = surroundings(&things, &fence, &Limits::GROUND);
        let mut next = || {
            turn.begin(0.4e-3, &AT_THE_ORIGIN, &env, Instant(0));
            turn.back.take().map(|back| (back.curvature, back.length))
        };
        let moves = [next(), next(), next(), next()];
        assert_eq!(moves, [(-0.4e-3, 2000.0), (0.0, 4000.0), (0.0, 6000.0), (-0.4e-3, 2000.0)].map(Some));
    }

    #[test]
    fn a_move_that_was_ended_does_not_go_on() {
        let (fence, things) = (fence(-50_000), [wall((1500.0, 0.0))]);
        let env = surroundings(&things, &fence, &Limits::GROUND);
        let (requested, mut turn) = (SetPoint { speed: 0.0, curvature: 0.4e-3 }, Turn::default());
        let set_point_at =
            |turn: &mut Turn, ms| turn.back_up(requested, &AT_THE_ORIGIN, &env, Instant(0) + Span::ms(ms)).speed;
        let _stands = (set_point_at(&mut turn, 0), set_point_at(&mut turn, 2000));
        assert!(set_point_at(&mut turn, 2100) < 0.0);
        turn.end();
        assert_eq!(set_point_at(&mut turn, 2200), 0.0);
    }

    #[test]
    fn without_room_or_reverse_gear_it_stands() {
        let ahead = wall((1500.0, 0.0));
        let obstacle = wall((-1500.0, 0.0));
        let all_zero = |points: Vec<SetPoint>| points.iter().all(|set_point| set_point.speed == 0.0);
        assert!(all_zero(asked_of(&[ahead, obstacle], &Limits::GROUND, 20)));
        assert!(all_zero(asked_of(&[ahead], &Limits { reverse_mm_s: 0, ..Limits::GROUND }, 20)));
    }
}
