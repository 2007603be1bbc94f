//! The check that a drawn world can be driven: the middle of a body of some width gets from the start to every way point.
//!
//! Free is each cell of 0.25 m with a middle that keeps its distance from every still thing and from the fence. A flood over neighbours with a
//! common side joins them. Moving objects do not count, and neither does a turning radius. The check shares no code with a planner.

use super::{Body, SPARE_M};
use crate::footprint::{At, Footprint};
use crate::scene::{Point, Scene};
use wire::sensor::Class;

/// True if the world can be driven and has a parked vehicle in sight of the start.
pub(super) fn holds(scene: &Scene, body: &Body) -> bool {
    has_parked_in_sight(scene) && starts_alone(scene) && drivable(scene, body)
}

/// Room around the start that no actor is in, metres.
const ALONE_M: f64 = 3.0;

/// True if no actor begins at the start.
fn starts_alone(scene: &Scene) -> bool {
    let place = metres(&scene.start.at_m);
    let far = |p: At| libm::hypot(p[0] - place[0], p[1] - place[1]) >= ALONE_M;
    scene.object.iter().filter(|o| o.speed_m_s.get() > 0.0).all(|o| o.path_m.first().is_none_or(|p| far(metres(p))))
}

/// Longest distance of the parked vehicle from the start, metres.
const SIGHT_M: f64 = 15.0;
/// Side of a cell, metres.
const CELL: f64 = 0.25;
/// Least distance of the edge from the middle, metres.
const LEAST_HALF_M: f64 = 50.0;

/// Square cells over a scene.
struct Cells {
    /// Distance of the edge from the middle, metres.
    half_m: f64,
    /// Cells along a side, with the edge.
    side: usize,
}

impl Cells {
    /// As far as its fence reaches.
    fn covering(scene: &Scene) -> Self {
        let reach = scene.geofence.iter().flat_map(metres).fold(0.0, |reach: f64, along| reach.max(along.abs()));
        let half_m = libm::ceil(reach).max(LEAST_HALF_M);
        Self { half_m, side: (2.0 * half_m / CELL) as usize + 1 }
    }

    fn index(&self, along: f64) -> usize {
        ((along + self.half_m) / CELL).clamp(0.0, self.side as f64 - 1.0) as usize
    }

    fn index_of(&self, point: &Point) -> usize {
        let [east, north] = metres(point).map(|along| self.index(along));
        north * self.side + east
    }

    fn middle(&self, cell: usize) -> At {
        [cell % self.side, cell / self.side].map(|step| (step as f64 + 0.5) * CELL - self.half_m)
    }
}

/// True if the body gets from the start to every way point.
fn drivable(scene: &Scene, body: &Body) -> bool {
    let cells = Cells::covering(scene);
    let mut free = free(scene, body, &cells);
    let mut reached = vec![false; free.len()];
    let mut open = vec![cells.index_of(&scene.start.at_m)];
    while let Some(cell) = open.pop() {
        // A cell is looked at once; those at the edge are closed, so each has four neighbours.
        if free[cell] {
            free[cell] = false;
            reached[cell] = true;
            open.extend([cell - 1, cell + 1, cell - cells.side, cell + cells.side]);
        }
    }
    scene.route.iter().all(|point| reached[cells.index_of(point)])
}

/// True if a parked vehicle is the first object, within 15 m of the start, and no other still thing is in the line to it.
fn has_parked_in_sight(scene: &Scene) -> bool {
    let start = metres(&scene.start.at_m);
    let parked = scene.object.first().filter(|object| object.class == Class::Vehicle && object.speed_m_s.get() == 0.0);
    let Some(position) = parked.and_then(|object| object.path_m.first()).map(metres) else { return false };
    let samples = (0..=60).map(|step| f64::from(step) / 60.0);
    let line: Vec<At> =
        samples.map(|t| [start[0] + t * (position[0] - start[0]), start[1] + t * (position[1] - start[1])]).collect();
    let hidden =
        static_footprints(scene).skip(1).any(|thing| line.iter().any(|place| thing.distance(*place) < SPARE_M));
    libm::hypot(position[0] - start[0], position[1] - start[1]) <= SIGHT_M && !hidden
}

/// Cells with a middle far enough from the fence's sides and from every still thing.
fn free(scene: &Scene, body: &Body, all: &Cells) -> Vec<bool> {
    let side = all.side;
    let is_inner = |step: usize| (1..side - 1).contains(&step);
    let mut free: Vec<bool> = (0..side * side).map(|cell| is_inner(cell % side) && is_inner(cell / side)).collect();
    let reach = body.width_m / 2.0 + SPARE_M;
    let things =
        static_footprints(scene).map(|thing| (thing, reach)).chain(sides(scene).map(|side| (side, body.fence_m)));
    for (thing, reach) in things {
        let (corners, distance) = (thing.corners(), thing.distances());
        let nearest = |axis: usize| corners.iter().map(|place| place[axis]).fold(f64::MAX, f64::min) - reach;
        let furthest = |axis: usize| corners.iter().map(|place| place[axis]).fold(f64::MIN, f64::max) + reach;
        for row in all.index(nearest(1))..=all.index(furthest(1)) {
            let cells = row * side + all.index(nearest(0))..=row * side + all.index(furthest(0));
            for (cell, free) in cells.clone().zip(&mut free[cells]) {
                *free &= distance(all.middle(cell)) >= reach;
            }
        }
    }
    free
}

/// The sides of the fence, without a width. The start is inside, and the flood does not get across them.
fn sides(scene: &Scene) -> impl Iterator<Item = Footprint> {
    let ends = scene.geofence.iter().zip(scene.geofence.iter().cycle().skip(1));
    ends.map(|(from, to)| {
        let ([a, b], [c, d]) = (metres(from), metres(to));
        let (east, north) = (c - a, d - b);
        let heading = libm::atan2(north, east);
        Footprint { at: [(a + c) / 2.0, (b + d) / 2.0], heading, size: [libm::hypot(east, north), 0.0] }
    })
}

/// Everything that never moves.
pub(super) fn static_footprints(scene: &Scene) -> impl Iterator<Item = Footprint> {
    let objects = scene.object.iter().filter(|object| object.speed_m_s.get() == 0.0);
    objects.filter_map(|object| {
        let [length, width, _] = object.size_m.map(|edge| edge.get());
        let at = metres(object.path_m.first()?);
        Some(Footprint { at, heading: object.heading_rad.get(), size: [length, width] })
    })
}

/// A point of a file in metres.
pub(super) fn metres(point: &Point) -> At {
    point.map(|along| along.get())
}
