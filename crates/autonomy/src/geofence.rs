//! The geofence: a polygon that the unit keeps inside of, with its stopping distance to spare.
//!
//! World frame, millimetres. The guard looks at two points: the unit's place, and the one at which it would come to
//! rest if it began to brake one reaction time from now. Both have to keep the margin. The response to a breach is left
//! to `transition`, keeping clear of one to `navigation`.

use config::platform::Limits;
use wire::bounds::Bounds;
use wire::mode::Because;

/// A point in the world frame: millimetres east, millimetres north.
pub type Point = (f64, f64);

/// The fence as a polygon.
#[derive(Clone, Debug)]
pub struct Geofence {
    corners: Vec<Point>,
}

/// Place of the unit and its motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Position, millimetres.
    pub at: Point,
    /// Heading, radians counter-clockwise from east.
    pub yaw: f64,
    /// Forward speed, mm/s.
    pub speed: f64,
}

impl Geofence {
    /// The fence with these corners, in order, three at least (checked by the configuration).
    pub fn new(corners: &[(i32, i32)]) -> Self {
        Geofence { corners: corners.iter().map(|(x, y)| (f64::from(*x), f64::from(*y))).collect() }
    }

    /// Corners in order, millimetres east and north.
    pub fn corners(&self) -> &[Point] {
        &self.corners
    }

    /// Distance to the nearest edge, millimetres; positive inside, negative outside.
    pub fn clearance(&self, place: Point) -> f64 {
        let edges = self.corners.iter().zip(self.corners.iter().cycle().skip(1));
        let (nearest, inside) = edges.fold((f64::MAX, false), |(nearest, inside), (a, b)| {
            (nearest.min(to_segment(place, *a, *b)), inside ^ crosses(place, *a, *b))
        });
        if inside { nearest } else { -nearest }
    }

    /// True if [`Self::clearance`] is `least` or more, which is positive: found without a root for each edge.
    pub fn keeps(&self, place: Point, least: f64) -> bool {
        let mut edges = self.corners.iter().zip(self.corners.iter().cycle().skip(1));
        let inside = edges.clone().fold(false, |inside, (a, b)| inside ^ crosses(place, *a, *b));
        inside && edges.all(|(a, b)| !nearer(place, nearest_on(place, *a, *b), least))
    }

    /// Clearance that is left at the worse of the two points, margin taken off; negative is a breach.
    pub fn spare(&self, motion: &Motion, bounds: &Bounds, limits: &Limits) -> f64 {
        let rest = ahead(motion, stopping_distance(motion.speed, bounds, limits));
        self.clearance(motion.at).min(self.clearance(rest)) - f64::from(bounds.fence_margin_mm)
    }

    /// True if a unit inside the fence with this motion comes to rest farther from it, by half of its way at least.
    /// Clearance grows by no more than the way, so on a shorter way than four times the clearance no side of the fence
    /// is crossed.
    pub(crate) fn leads_away(&self, motion: &Motion, bounds: &Bounds, limits: &Limits) -> bool {
        let way = stopping_distance(motion.speed, bounds, limits);
        let (clearance, rest) = (self.clearance(motion.at), self.clearance(ahead(motion, way)));
        way > 0.0 && way < 4.0 * clearance && rest - clearance >= way / 2.0
    }

    /// Reason that the fence guard fails, if it does.
    pub fn breached(&self, motion: &Motion, bounds: &Bounds, limits: &Limits) -> Option<Because> {
        (self.spare(motion, bounds, limits) < 0.0).then_some(Because::Itself)
    }
}

/// Distance to standstill from `speed` (mm/s, its sign kept), with the reaction time before it.
pub fn stopping_distance(speed: f64, bounds: &Bounds, limits: &Limits) -> f64 {
    speed * limits.reaction_s() + speed * speed.abs() / (2.0 * f64::from(bounds.braking_mm_s2))
}

/// The point `distance` ahead of the unit.
pub fn ahead(motion: &Motion, distance: f64) -> Point {
    (motion.at.0 + distance * libm::cos(motion.yaw), motion.at.1 + distance * libm::sin(motion.yaw))
}

/// Distance between two points.
pub fn distance(a: Point, b: Point) -> f64 {
    libm::hypot(a.0 - b.0, a.1 - b.1)
}

/// True if two points are less than `distance` apart, which is not negative.
pub fn nearer(a: Point, b: Point, distance: f64) -> bool {
    let (dx, dy) = (a.0 - b.0, a.1 - b.1);
    dx * dx + dy * dy < distance * distance
}

/// Distance from `p` to the segment from `a` to `b`.
pub fn to_segment(p: Point, a: Point, b: Point) -> f64 {
    distance(p, nearest_on(p, a, b))
}

/// The point of the segment from `a` to `b` nearest to `p`.
pub fn nearest_on(p: Point, a: Point, b: Point) -> Point {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let length_squared = dx * dx + dy * dy;
    let share = if length_squared > 0.0 { ((p.0 - a.0) * dx + (p.1 - a.1) * dy) / length_squared } else { 0.0 };
    let share = share.clamp(0.0, 1.0);
    (a.0 + share * dx, a.1 + share * dy)
}

/// True if a ray from `p` to the east crosses the edge from `a` to `b`.
fn crosses(p: Point, a: Point, b: Point) -> bool {
    (a.1 > p.1) != (b.1 > p.1) && p.0 < (b.0 - a.0) * (p.1 - a.1) / (b.1 - a.1) + a.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Geofence {
        Geofence::new(&[(0, 0), (10_000, 0), (10_000, 10_000), (0, 10_000)])
    }

    #[test]
    fn clearance_is_signed_distance_to_nearest_edge() {
        let l_shape = Geofence::new(&[(0, 0), (8000, 0), (8000, 3000), (3000, 3000), (3000, 8000), (0, 8000)]);
        assert_eq!(square().clearance((5000.0, 2000.0)), 2000.0);
        assert_eq!(square().clearance((13_000.0, 14_000.0)), -5000.0);
        assert_eq!(l_shape.clearance((6000.0, 6000.0)), -3000.0);
        assert_eq!(l_shape.clearance((1000.0, 6000.0)), 1000.0);
    }

    #[test]
    fn keeping_a_distance_agrees_with_clearance() {
        let slanted = Geofence::new(&[(0, 0), (9000, 1000), (12_000, 9000), (4000, 6000), (-1000, 8000)]);
        let places = (-10..140).flat_map(|x| (-10..100).map(move |y| (f64::from(x) * 100.0, f64::from(y) * 100.0)));
        let (mut inside, mut not) = (0, 0);
        for at in places {
            for (fence, least) in [(&slanted, 700.0), (&slanted, 1.0), (&square(), 1500.0)] {
                assert_eq!(fence.keeps(at, least), fence.clearance(at) >= least, "{at:?} {least}");
                if fence.keeps(at, least) { inside += 1 } else { not += 1 }
            }
        }
        assert!(inside > 5_000 && not > 5_000, "{inside} {not}");
    }

    #[test]
    fn guard_fails_while_stopping_room_remains() {
        let (bounds, limits) = (Bounds::GROUND, Limits::GROUND);
        let motion_at = |x: f64| Motion { at: (x, 5000.0), yaw: 0.0, speed: 3000.0 };
        assert_eq!(square().breached(&motion_at(7000.0), &bounds, &limits), None);
        assert!(square().breached(&motion_at(7100.0), &bounds, &limits).is_some());
        let along = Motion { at: (8900.0, 2000.0), yaw: core::f64::consts::FRAC_PI_2, speed: 3000.0 };
        assert_eq!(square().breached(&along, &bounds, &limits), None, "driving along the fence is no breach");
    }
}
