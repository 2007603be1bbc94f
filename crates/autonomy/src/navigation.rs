//! Following a way: regulated pure pursuit, and how fast.
//!
//! The curvature is that of the arc through a point of the way one lookahead ahead; the lookahead grows with speed. The
//! speed is the lowest of the limits of the mode, the curve, the end of the way, the obstacles seen
//! ahead, the fence, and the shell. World frame, millimetres; curvature in 1/mm, positive to the left.

use config::platform::Limits;
use wire::bounds::Bounds;

use crate::geofence::{Geofence, Motion, Point, distance, nearest_on};
use crate::grid::Keepout;
use crate::localisation::wrap;
use crate::mission::{PlannedWay, REACHED_MM};
use crate::shell::{self, Brakes};
use crate::things::Obstacle;

/// Steps in which the speed is lowered until the fence allows it.
const FENCE_STEPS: u32 = 12;
/// Least room from which a creeping unit turns away, millimetres: five deviations of the pose.
const NOISE_MM: f64 = 100.0;
/// Way on which a creeping unit has to come away from the fence, millimetres: about the way in which it stops.
const ARC_MM: f64 = 100.0;
/// Share of the room before the fence guard that a creeping unit leaves.
const CREEPING_SHARE: f64 = 0.25;

/// Request to the plant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SetPoint {
    /// Forward speed, mm/s.
    pub speed: f64,
    /// Curvature, 1/mm, positive to the left.
    pub curvature: f64,
}

/// Limits of the speed.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings<'a> {
    /// The most that the mode allows, mm/s.
    pub mode_speed: f64,
    /// Things seen around that are on no map: the unit stands off from them.
    pub seen: &'a [Keepout],
    /// Things that the body must not touch.
    pub things: &'a [Obstacle],
    /// Curvature that the plant was asked for last, 1/mm.
    pub steered: f64,
    /// The mission's fence.
    pub fence: &'a Geofence,
    /// The platform's bounds.
    pub bounds: &'a Bounds,
    /// The platform's limits of driving.
    pub limits: &'a Limits,
}

impl Surroundings<'_> {
    /// The platform's brakes.
    pub(crate) fn brakes(&self) -> Brakes {
        Brakes::new(self.bounds, self.limits)
    }
}

/// The set-point that follows `way`.
pub fn follow(motion: &Motion, way: &PlannedWay<'_>, env: &Surroundings<'_>) -> SetPoint {
    if env.mode_speed <= 0.0 {
        return SetPoint::default();
    }
    let limits = env.limits;
    let most = limits.curvature_per_mm();
    let [nearest, furthest] = limits.lookahead_mm.map(f64::from);
    let lookahead = (motion.speed.abs() * (f64::from(limits.lookahead_ms) / 1000.0)).clamp(nearest, furthest);
    let (carrot, left) = carrot(motion.at, way, lookahead);
    let end = way.points.last().copied().unwrap_or(motion.at);
    if left <= 2.0 / most && is_within_turn(motion, end, most) {
        let to_end = wrap(libm::atan2(end.1 - motion.at.1, end.0 - motion.at.0) - motion.yaw);
        return SetPoint { speed: 0.0, curvature: most.copysign(to_end) };
    }
    let distance = distance(motion.at, carrot).max(1.0);
    let bearing = wrap(libm::atan2(carrot.1 - motion.at.1, carrot.0 - motion.at.0) - motion.yaw);
    let is_behind = bearing.abs() > core::f64::consts::FRAC_PI_2;
    let arc = 2.0 * libm::sin(bearing) / distance;
    let curvature = if is_behind { most.copysign(bearing) } else { arc.clamp(-most, most) };
    let curve_speed = if is_behind { f64::from(limits.turning_mm_s) } else { curve_speed(curvature, limits) };
    let end_speed = if way.beyond.is_some() { f64::MAX } else { stop_within(left, limits) };
    let speed = env.mode_speed.min(curve_speed).min(end_speed).min(free_ahead(motion, env));
    limit_set_point(SetPoint { speed, curvature }, motion, env)
}

/// True if a point lies so far within the circle of the sharpest turn towards it that no turn reaches it: the unit
/// would drive around it for ever.
fn is_within_turn(motion: &Motion, point: Point, most: f64) -> bool {
    let (sin, cos) = libm::sincos(motion.yaw);
    let (dx, dy) = (point.0 - motion.at.0, point.1 - motion.at.1);
    let (forward, left) = (dx * cos + dy * sin, dy * cos - dx * sin);
    let radius = 1.0 / most;
    libm::hypot(forward, left.abs() - radius) < radius - REACHED_MM
}

/// A guest's set-point under the limits that [`follow`] keeps to by itself. Backwards is not driven.
pub fn limited(requested: SetPoint, motion: &Motion, env: &Surroundings<'_>) -> SetPoint {
    let most = env.limits.curvature_per_mm();
    let curvature = requested.curvature.clamp(-most, most);
    let curve_speed = curve_speed(curvature, env.limits);
    let speed = requested.speed.max(0.0).min(env.mode_speed).min(curve_speed).min(free_ahead(motion, env));
    limit_set_point(SetPoint { speed, curvature }, motion, env)
}

/// A guest's set-point backwards under the limits of [`crate::turn`], which drives backwards by itself. LiDAR has to look
/// behind the unit.
pub fn limited_back(requested: SetPoint, motion: &Motion, env: &Surroundings<'_>) -> SetPoint {
    let most = env.limits.curvature_per_mm();
    let curvature = requested.curvature.clamp(-most, most);
    let fastest = (-requested.speed).min(env.mode_speed).min(f64::from(env.limits.reverse_mm_s));
    backwards(SetPoint { speed: fastest, curvature }, motion, env)
}

/// The set-point backwards, at most as fast as `requested.speed` (without a sign), within the fence and the shell.
pub(crate) fn backwards(requested: SetPoint, motion: &Motion, env: &Surroundings<'_>) -> SetPoint {
    let facing_back = Motion { yaw: motion.yaw + core::f64::consts::PI, speed: -motion.speed, ..*motion };
    let SetPoint { speed, curvature } = requested;
    let fenced = within_fence(&facing_back, SetPoint { speed, curvature: -curvature }, env);
    let speed = shell::speed_back(motion, (fenced, curvature), env.things, env.brakes(), env.limits);
    SetPoint { speed: -speed, curvature }
}

/// A set-point within the fence and the shell.
fn limit_set_point(requested: SetPoint, motion: &Motion, env: &Surroundings<'_>) -> SetPoint {
    let speed = within_fence(motion, requested, env);
    let arc = (speed, requested.curvature, env.steered);
    SetPoint { speed: shell::speed_along(motion, arc, env.things, env.brakes(), env.limits), ..requested }
}

/// The point of the way one lookahead beyond the point nearest to `place`, and the distance left to the way's end.
fn carrot(place: Point, way: &PlannedWay<'_>, lookahead: f64) -> (Point, f64) {
    let legs = way.points.windows(2).enumerate().map(|(i, ab)| (i, nearest_on(place, ab[0], ab[1])));
    let start = (0, way.points[0]);
    let (leg, foot) = legs.min_by(|a, b| distance(place, a.1).total_cmp(&distance(place, b.1))).unwrap_or(start);
    let ahead = way.points[leg + 1..].iter();
    let (mut from, mut left) = (foot, 0.0);
    let mut carrot = None;
    for to in ahead {
        let length = distance(from, *to);
        if carrot.is_none() && left + length >= lookahead {
            carrot = Some(point_along(from, *to, lookahead - left));
        }
        left += length;
        from = *to;
    }
    let next_point = way.beyond.map_or(from, |to| point_along(from, to, (lookahead - left).max(0.0)));
    (carrot.unwrap_or(next_point), left)
}

/// The point `way` from `a` towards `b`, not beyond it.
fn point_along(a: Point, b: Point, way: f64) -> Point {
    let length = distance(a, b);
    let share = if length > 0.0 { (way / length).min(1.0) } else { 1.0 };
    (a.0 + share * (b.0 - a.0), a.1 + share * (b.1 - a.1))
}

/// The highest speed in a curve, mm/s.
fn curve_speed(curvature: f64, limits: &Limits) -> f64 {
    (f64::from(limits.sideways_mm_s2) / curvature.abs().max(1e-9)).sqrt()
}

fn stop_within(distance: f64, limits: &Limits) -> f64 {
    (2.0 * f64::from(limits.comfort_mm_s2) * distance.max(0.0)).sqrt()
}

/// The speed from which one can stop off the nearest thing in the corridor ahead that is on no map.
fn free_ahead(motion: &Motion, env: &Surroundings<'_>) -> f64 {
    let limits = env.limits;
    let (sin, cos) = libm::sincos(motion.yaw);
    let in_corridor = env.seen.iter().filter_map(|keepout| {
        let (dx, dy) = (keepout.at.0 - motion.at.0, keepout.at.1 - motion.at.1);
        let (forward, left) = (dx * cos + dy * sin, dy * cos - dx * sin);
        (forward > 0.0 && left.abs() < f64::from(limits.corridor_mm)).then_some(forward)
    });
    stop_within(in_corridor.fold(f64::MAX, f64::min) - f64::from(limits.standoff_mm), limits)
}

/// The highest speed up to the one that is asked for that leaves the fence guard room. A creeping unit leaves a quarter
/// of it, or less where its arc leads away from the fence: a wheeled unit turns on no other. A unit without a reverse
/// gear, and one without wheels, creeps in any case.
pub(crate) fn within_fence(motion: &Motion, requested: SetPoint, env: &Surroundings<'_>) -> f64 {
    let Surroundings { fence, bounds, limits, .. } = *env;
    let creeping = requested.speed.min(f64::from(limits.turning_mm_s) / 2.0);
    let creeps = Motion { speed: creeping, ..*motion };
    let has_room = fence.spare(&creeps, bounds, limits) >= f64::from(limits.fence_spare_mm) * CREEPING_SHARE;
    let turns_away = || {
        fence.spare(&Motion { speed: 0.0, ..*motion }, bounds, limits) >= NOISE_MM
            && fence.clearance(after_arc(motion, ARC_MM, requested.curvature)) > fence.clearance(motion.at)
    };
    let may_creep = has_room || limits.reverse_mm_s == 0 || limits.free || turns_away();
    inside_fence(motion, requested.speed, env).max(if may_creep { creeping } else { 0.0 })
}

/// The place `distance` further on an arc.
fn after_arc(motion: &Motion, distance: f64, curvature: f64) -> Point {
    let half = curvature * distance / 2.0;
    let chord = if half.abs() > 1e-9 { distance * libm::sin(half) / half } else { distance };
    let (sin, cos) = libm::sincos(motion.yaw + half);
    (motion.at.0 + chord * cos, motion.at.1 + chord * sin)
}

/// The highest speed up to `speed` that leaves the fence guard room or leads away from the fence; nought where none
/// does.
fn inside_fence(motion: &Motion, speed: f64, env: &Surroundings<'_>) -> f64 {
    let with_speed = |speed: f64| Motion { speed, ..*motion };
    let spare = |speed: f64| env.fence.spare(&with_speed(speed), env.bounds, env.limits);
    let leads_away = |speed: f64| env.fence.leads_away(&with_speed(speed), env.bounds, env.limits);
    let allowed = |speed: f64| spare(speed) >= f64::from(env.limits.fence_spare_mm) || leads_away(speed);
    let steps = (0..FENCE_STEPS).map(|i| speed * f64::from(FENCE_STEPS - i) / f64::from(FENCE_STEPS));
    steps.into_iter().find(|speed| allowed(*speed)).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fence() -> Geofence {
        Geofence::new(&[(-50_000, -50_000), (50_000, -50_000), (50_000, 50_000), (-50_000, 50_000)])
    }

    fn surroundings<'a>(
        mode_speed: f64,
        seen: &'a [Keepout],
        (fence, bounds): (&'a Geofence, &'a Bounds),
    ) -> Surroundings<'a> {
        Surroundings { mode_speed, seen, things: &[], steered: 0.0, fence, bounds, limits: &Limits::GROUND }
    }

    /// Drives a point along `way` for `seconds` and gives where it ends up and its greatest distance from the way.
    fn drive(way: &PlannedWay<'_>, seconds: f64, mode_speed: f64) -> (Motion, f64) {
        let (fence, bounds) = (fence(), Bounds::GROUND);
        let env = surroundings(mode_speed, &[], (&fence, &bounds));
        let mut motion = Motion { at: (0.0, 0.0), yaw: 0.0, speed: 0.0 };
        let mut worst: f64 = 0.0;
        for _ in 0..(seconds * 20.0) as u32 {
            let requested = follow(&motion, way, &env);
            motion.speed += (requested.speed - motion.speed).clamp(-150.0, 75.0);
            motion.yaw = wrap(motion.yaw + motion.speed * requested.curvature * 0.05);
            motion.at = crate::geofence::ahead(&motion, motion.speed * 0.05);
            let off = way.points.windows(2).map(|ab| crate::geofence::to_segment(motion.at, ab[0], ab[1]));
            worst = worst.max(off.fold(f64::MAX, f64::min));
        }
        (motion, worst)
    }

    #[test]
    fn cornered_way_is_followed_without_overrun() {
        let way = PlannedWay { points: &[(0.0, 0.0), (15_000.0, 0.0), (15_000.0, 12_000.0)], beyond: None };
        let (motion, worst) = drive(&way, 30.0, 3000.0);
        assert!(distance(motion.at, (15_000.0, 12_000.0)) < 500.0, "{motion:?}");
        assert!(worst < 1500.0, "{worst}");
    }

    /// The unit stops before an obstacle ahead, and at once when the mode requires a stop.
    #[test]
    fn navigation_stops_for_obstacles_and_for_the_mode() {
        let (fence, bounds) = (fence(), Bounds::GROUND);
        let way = PlannedWay { points: &[(0.0, 0.0), (20_000.0, 0.0)], beyond: None };
        let motion = Motion { at: (0.0, 0.0), yaw: 0.0, speed: 1000.0 };
        let wall = [Keepout { at: (2900.0, 0.0), radius: 1000.0, least: 1000.0 }];
        let mut env = surroundings(3000.0, &wall, (&fence, &bounds));
        assert_eq!(follow(&motion, &way, &env).speed, 0.0);
        env.seen = &[];
        assert!(follow(&motion, &way, &env).speed > 2000.0);
        env.mode_speed = 0.0;
        assert_eq!(follow(&motion, &way, &env), SetPoint::default());
    }

    /// A point within the turning circle cannot be reached by driving on: the unit stands, and `turn` backs up.
    #[test]
    fn unit_stands_before_a_way_point_within_its_turn() {
        let (fence, bounds) = (fence(), Bounds::GROUND);
        let env = surroundings(3000.0, &[], (&fence, &bounds));
        let motion = Motion { at: (0.0, 0.0), yaw: 0.0, speed: 800.0 };
        let requested =
            |end| follow(&motion, &PlannedWay { points: &[(0.0, 0.0), end], beyond: Some((0.0, 9000.0)) }, &env);
        assert_eq!(requested((200.0, 2600.0)), SetPoint { speed: 0.0, curvature: 0.4e-3 });
        assert!(requested((2500.0, 1500.0)).speed > 0.0 && requested((200.0, 6000.0)).speed > 0.0);
    }

    /// At the margin itself it stands, and goes on only away from the fence.
    #[test]
    fn navigation_creeps_no_farther_than_the_margin() {
        let (fence, bounds) = (fence(), Bounds::GROUND);
        let env = surroundings(3000.0, &[], (&fence, &bounds));
        let ahead = SetPoint { speed: 3000.0, curvature: 0.0 };
        let speed = |x, yaw| within_fence(&Motion { at: (x, 0.0), yaw, speed: 0.0 }, ahead, &env);
        assert!(speed(40_000.0, 0.0) > 2000.0);
        assert_eq!(speed(48_500.0, 0.0), f64::from(Limits::GROUND.turning_mm_s) / 2.0);
        assert_eq!(speed(48_900.0, 0.0), 0.0);
        assert!(speed(48_900.0, core::f64::consts::PI) > 2000.0);
        let along = Motion { at: (48_890.0, 0.0), yaw: core::f64::consts::FRAC_PI_2 - 0.01, speed: 0.0 };
        assert_eq!(within_fence(&along, ahead, &env), 0.0);
        let turning = SetPoint { curvature: 0.4e-3, ..ahead };
        assert_eq!(within_fence(&along, turning, &env), f64::from(Limits::GROUND.turning_mm_s) / 2.0);
    }

    #[test]
    fn navigation_slows_before_the_fence_guard_trips() {
        let (fence, bounds) = (fence(), Bounds::GROUND);
        let way = PlannedWay { points: &[(40_000.0, 0.0), (49_900.0, 0.0)], beyond: Some((0.0, 0.0)) };
        let env = surroundings(3000.0, &[], (&fence, &bounds));
        let motion = Motion { at: (47_000.0, 0.0), yaw: 0.0, speed: 3000.0 };
        let requested = follow(&motion, &way, &env);
        assert!(
            fence.breached(&Motion { speed: requested.speed, ..motion }, &bounds, &Limits::GROUND).is_none(),
            "{requested:?}"
        );
    }
}
