//! The check that a drawn world can be driven: the middle of a body of some width gets from the start to every way point.
//!
//! Free is each cell of 0.25 m with a middle that keeps its distance from every still thing and from the fence. A flood over neighbours with a
//! common side joins them. Moving objects do not count, and neither does a turning radius. The check shares no code with a planner.

use super::{Body, SPARE_M};
use crate::footprint::{At, Footprint};
use crate::scene::{Point, Scene};
use crate::terms::Class;

/// True if the world can be driven and has a parked vehicle in sight of the start.
pub(super) fn holds(scene: &Scene, body: &Body) -> bool {
    has_parked_in_sight(scene) && starts_alone(scene) && drivable(scene, body)
}

/// Room around the start that no actor is in, metres.
const ALONE_M: f64 = 3.0;

/// True if no actor begins at the start.
fn starts_alone(scene: &Scene) -> bool {
    let at = metres(&scene.start.at_m);
    let far = |p: At| libm::hypot(p[0] - at[0], p[1] - at[1]) >= ALONE_M;
    scene.object.iter().filter(|o| o.speed_m_s.get() > 0.0).all(|o| o.path_m.first().is_none_or(|p| far(metres(p))))
}

/// Longest distance of the parked vehicle from the start, metres.
const SIGHT_M: f64 = 15.0;
/// Side of a cell, metres.
const CELL: f64 = 0.25;
/// Cells along a side: a scene's 100 m, and its edge.
const SIDE: usize = 401;

/// True if the body gets from the start to every way point.
fn drivable(scene: &Scene, body: &Body) -> bool {
    let mut free = free(scene, body);
    let mut reached = vec![false; SIDE * SIDE];
    let mut open = vec![cell_of(&scene.start.at_m)];
    while let Some(cell) = open.pop() {
        // A cell is looked at once; those at the edge are closed, so each has four neighbours.
        if free[cell] {
            free[cell] = false;
            reached[cell] = true;
            open.extend([cell - 1, cell + 1, cell - SIDE, cell + SIDE]);
        }
    }
    scene.route.iter().all(|point| reached[cell_of(point)])
}

/// True if a parked vehicle is the first object, within 15 m of the start, and no other still thing is in the line to it.
fn has_parked_in_sight(scene: &Scene) -> bool {
    let start = metres(&scene.start.at_m);
    let parked = scene.object.first().filter(|object| object.class == Class::Vehicle && object.speed_m_s.get() == 0.0);
    let Some(at) = parked.and_then(|object| object.path_m.first()).map(metres) else { return false };
    let samples = (0..=60).map(|step| f64::from(step) / 60.0);
    let line: Vec<At> =
        samples.map(|t| [start[0] + t * (at[0] - start[0]), start[1] + t * (at[1] - start[1])]).collect();
    let hidden = still(scene).skip(1).any(|thing| line.iter().any(|place| thing.distance(*place) < SPARE_M));
    libm::hypot(at[0] - start[0], at[1] - start[1]) <= SIGHT_M && !hidden
}

/// Cells with a middle far enough from the fence's sides and from every still thing.
fn free(scene: &Scene, body: &Body) -> Vec<bool> {
    let within = |step: usize| (1..SIDE - 1).contains(&step);
    let mut free: Vec<bool> = (0..SIDE * SIDE).map(|cell| within(cell % SIDE) && within(cell / SIDE)).collect();
    let reach = body.width_m / 2.0 + SPARE_M;
    let things = still(scene).map(|thing| (thing, reach)).chain(sides(scene).map(|side| (side, body.fence_m)));
    for (thing, reach) in things {
        let (corners, distance) = (thing.corners(), thing.distances());
        let nearest = |axis: usize| corners.iter().map(|at| at[axis]).fold(f64::MAX, f64::min) - reach;
        let furthest = |axis: usize| corners.iter().map(|at| at[axis]).fold(f64::MIN, f64::max) + reach;
        for row in index(nearest(1))..=index(furthest(1)) {
            let cells = row * SIDE + index(nearest(0))..=row * SIDE + index(furthest(0));
            for (cell, free) in cells.clone().zip(&mut free[cells]) {
                *free &= distance(middle(cell)) >= reach;
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
pub(super) fn still(scene: &Scene) -> impl Iterator<Item = Footprint> {
    let stands = scene.object.iter().filter(|object| object.speed_m_s.get() == 0.0);
    stands.filter_map(|object| {
        let [length, width, _] = object.size_m.map(|edge| edge.get());
        let at = metres(object.path_m.first()?);
        Some(Footprint { at, heading: object.heading_rad.get(), size: [length, width] })
    })
}

/// A point of a file in metres.
pub(super) fn metres(point: &Point) -> At {
    point.map(|along| along.get())
}

fn index(along: f64) -> usize {
    ((along + 50.0) / CELL).clamp(0.0, SIDE as f64 - 1.0) as usize
}

fn cell_of(point: &Point) -> usize {
    let [east, north] = metres(point).map(index);
    north * SIDE + east
}

fn middle(cell: usize) -> At {
    [cell % SIDE, cell / SIDE].map(|step| (step as f64 + 0.5) * CELL - 50.0)
}
