//! Extents of things on the ground plane: rectangles with a direction, their distance to a point, and the overlap of
//! two.
//!
//! World frame, millimetres. Two rectangles are apart where one of their four sides' normals separates them (separating
//! axes). No angle is taken here: a direction is a unit vector.

use crate::geofence::{Point, distance};

/// A rectangle with a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// Centre.
    pub at: Point,
    /// Unit vector along its length.
    pub axis: Point,
    /// Half of length and width.
    pub half: (f64, f64),
}

impl Extent {
    /// A rectangle of these half sides, its length `heading` radians counter-clockwise from east.
    pub fn new(at: Point, heading: f64, half: (f64, f64)) -> Self {
        let (sin, cos) = libm::sincos(heading);
        Extent { at, axis: (cos, sin), half }
    }

    /// A square that contains a disc.
    pub fn around_disc(at: Point, radius: f64) -> Self {
        Extent { at, axis: (1.0, 0.0), half: (radius, radius) }
    }

    /// The extent with every side further out by `margin`.
    #[must_use]
    pub fn grown(self, margin: f64) -> Self {
        Extent { half: (self.half.0 + margin, self.half.1 + margin), ..self }
    }

    /// Radius of the circle around it.
    pub fn radius(&self) -> f64 {
        libm::hypot(self.half.0, self.half.1)
    }

    /// Distance of a point to it, 0 inside.
    pub fn distance(&self, p: Point) -> f64 {
        let (along, across) = self.local_point(p);
        libm::hypot((along.abs() - self.half.0).max(0.0), (across.abs() - self.half.1).max(0.0))
    }

    /// The way from the nearest of its points to a point, 0 inside.
    pub fn offset_to(&self, p: Point) -> Point {
        let (along, across) = self.local_point(p);
        let excess = |part: f64, half: f64| part - part.clamp(-half, half);
        let (along, across) = (excess(along, self.half.0), excess(across, self.half.1));
        (along * self.axis.0 - across * self.axis.1, along * self.axis.1 + across * self.axis.0)
    }

    /// True if the two have a point in common.
    pub fn overlaps(&self, other: &Extent) -> bool {
        let (dx, dy) = (other.at.0 - self.at.0, other.at.1 - self.at.1);
        let reach = self.radius() + other.radius();
        if dx * dx + dy * dy > reach * reach {
            return false;
        }
        let (cos, sin) = (dot(self.axis, other.axis).abs(), cross(self.axis, other.axis).abs());
        let separated = |one: &Extent, other: &Extent| {
            let (along, across) = one.local_point(other.at);
            along.abs() > one.half.0 + other.half.0 * cos + other.half.1 * sin
                || across.abs() > one.half.1 + other.half.0 * sin + other.half.1 * cos
        };
        !separated(self, other) && !separated(other, self)
    }

    /// A point in the rectangle's own axes, its centre the origin.
    fn local_point(&self, p: Point) -> Point {
        let d = (p.0 - self.at.0, p.1 - self.at.1);
        (dot(d, self.axis), cross(self.axis, d))
    }

    /// True if it may reach a thing within `reach` of `p`.
    pub fn may_reach(&self, p: Point, reach: f64) -> bool {
        distance(self.at, p) <= reach + self.radius()
    }
}

fn dot(a: Point, b: Point) -> f64 {
    a.0 * b.0 + a.1 * b.1
}

fn cross(a: Point, b: Point) -> f64 {
    a.0 * b.1 - a.1 * b.0
}

#[cfg(test)]
mod tests {
    use core::f64::consts::FRAC_PI_4;

    use super::*;

    #[test]
    fn distance_is_to_the_nearest_side_or_corner() {
        let car = Extent::new((0.0, 0.0), 0.0, (2100.0, 900.0));
        assert_eq!((car.distance((0.0, 1900.0)), car.distance((2600.0, 0.0))), (1000.0, 500.0));
        assert_eq!((car.distance((2400.0, 1300.0)), car.distance((100.0, 100.0))), (500.0, 0.0));
    }

    /// A rectangle turned by 45° with a corner towards a wall: the two circumscribed circles overlap long before the
    /// rectangles do.
    #[test]
    fn turned_rectangles_overlap_where_they_touch() {
        let wall = Extent::new((0.0, 0.0), 0.0, (5000.0, 100.0));
        let turned = |north| Extent::new((3000.0, north), FRAC_PI_4, (1000.0, 1000.0));
        assert!(wall.overlaps(&turned(1500.0)) && turned(1500.0).overlaps(&wall));
        assert!(!wall.overlaps(&turned(1520.0)) && !turned(1520.0).overlaps(&wall));
        assert!(wall.overlaps(&turned(1500.0).grown(50.0)));
    }
}
