//! An inspection flight: rounds along the walls of halls and towers in a works yard, for a body that flies low.
//!
//! Between the structures stand masts and things as high as the body flies, and low things that it flies over. Wires are left out: a thing of a
//! scene stands on the ground.

use super::chance::Chance;
use super::plan::{Plan, distance, rounds};
use crate::footprint::{At, Footprint};

/// Distance of the way points' lines from a wall.
const WALL: (f64, f64) = (2.1, 4.0);
/// Least gap between structures: two such lines side by side, with room between.
const BETWEEN: f64 = 9.0;
/// Room of a structure's middle to the fence, beyond half of its diagonal: a corner of the outermost line and the fence's margin.
const FENCE: f64 = 8.0;
/// Room of a structure to the start and to the parked vehicle.
const START: f64 = 7.0;
/// Places that are tried for a structure.
const PLACES: usize = 60;

pub(super) fn plan(chance: &mut Chance) -> Plan {
    let half = [chance.uniform(32.0, 44.0), chance.uniform(32.0, 44.0)];
    let start = [6.0 - half[0], 8.0 - half[1]];
    let mut plan = Plan::new(start, 0.0, half);
    // No more relief than the platform's floor allows for (docs/reference/bounds.md#air).
    plan.amplitude = chance.uniform(0.1, 0.35);
    plan.park_in_sight(chance, -3.8);
    let mut walls: Vec<Footprint> = Vec::new();
    for _ in 0..chance.integer(3, 5) {
        let (size, turned) = (structure(chance), chance.uniform(-0.5, 0.5));
        let tries: Vec<At> = (0..PLACES).map(|_| inside(chance, half, 0.0)).collect();
        let footprint = |place: &At| Footprint { at: *place, heading: turned, size: [size[0], size[1]] };
        let fits = |wall: &Footprint| stands_free(wall, &walls, (start, half));
        if let Some(wall) = tries.iter().map(footprint).find(fits) {
            plan.block(size, wall.at, turned);
            walls.push(wall);
        }
    }
    let lines = way_points(chance, start, walls);
    plan.route = rounds(chance, &lines);
    add_obstacles(chance, &mut plan, half);
    add_low_things(chance, &mut plan, half);
    plan
}

/// A hall or, two times in five, a tank or tower: 5 to 20 m high, which is the most that a thing of a scene can be.
fn structure(chance: &mut Chance) -> [f64; 3] {
    if chance.happens(0.4) {
        let side = chance.uniform(3.0, 8.0);
        [side, side, chance.uniform(8.0, 20.0)]
    } else {
        [chance.uniform(10.0, 20.0), chance.uniform(7.0, 14.0), chance.uniform(5.0, 12.0)]
    }
}

/// True if a structure has room for the lines along its walls.
fn stands_free(wall: &Footprint, other_footprints: &[Footprint], (start, half): (At, At)) -> bool {
    let reach = libm::hypot(wall.size[0], wall.size[1]) / 2.0 + FENCE;
    let is_inside = [0, 1].iter().all(|axis| wall.at[*axis].abs() + reach <= half[*axis]);
    let in_sight = [0.0, 7.0, 14.0].map(|ahead| [start[0] + ahead, start[1]]);
    is_inside
        && in_sight.iter().all(|place| wall.distance(*place) >= START)
        && other_footprints.iter().all(|o| !wall.meets(o, BETWEEN))
}

/// Way points around each structure, at its own distance from the walls, the nearest structure first, this way round or that.
fn way_points(chance: &mut Chance, start: At, mut walls: Vec<Footprint>) -> Vec<At> {
    let (mut last, mut points) = (start, Vec::new());
    while !walls.is_empty() {
        let near = |wall: &Footprint| distance(wall.at, last);
        let nearest = (0..walls.len()).min_by(|a, b| near(&walls[*a]).total_cmp(&near(&walls[*b]))).unwrap_or(0);
        let wall = walls.remove(nearest);
        let off = 2.0 * chance.uniform(WALL.0, WALL.1);
        let line = Footprint { size: wall.size.map(|side| side + off), ..wall };
        let mut corners = line.corners();
        if chance.happens(0.5) {
            corners.reverse();
        }
        let first =
            (0..4).min_by(|a, b| distance(corners[*a], last).total_cmp(&distance(corners[*b], last))).unwrap_or(0);
        corners.rotate_left(first);
        points.extend(corners);
        // All four walls are seen before it goes on.
        points.push(corners[0]);
        last = corners[0];
    }
    points
}

/// Masts, and things as high as the body flies: containers and sheds.
fn add_obstacles(chance: &mut Chance, plan: &mut Plan, half: At) {
    for _ in 0..chance.integer(1, 4) {
        let (side, high) = (chance.uniform(0.3, 0.6), chance.uniform(8.0, 20.0));
        let place = inside(chance, half, 4.0);
        plan.block([side, side, high], place, 0.0);
    }
    for _ in 0..chance.integer(1, 5) {
        let size = [chance.uniform(2.5, 6.1), chance.uniform(2.0, 2.5), chance.uniform(2.2, 3.2)];
        let (place, heading) = (inside(chance, half, 5.0), chance.uniform(-3.0, 3.0));
        plan.block(size, place, heading);
    }
}

/// Things that are flown over: parked cars and crates; people, and a vehicle that drives about.
fn add_low_things(chance: &mut Chance, plan: &mut Plan, half: At) {
    for _ in 0..chance.integer(0, 3) {
        let (place, heading) = (inside(chance, half, 5.0), chance.uniform(-3.0, 3.0));
        plan.car(chance, place, heading);
    }
    for _ in 0..chance.integer(3, 12) {
        let size = [chance.uniform(0.8, 3.0), chance.uniform(0.8, 2.0), chance.uniform(0.5, 1.5)];
        let (place, heading) = (inside(chance, half, 4.0), chance.uniform(-3.0, 3.0));
        plan.block(size, place, heading);
    }
    for _ in 0..chance.integer(1, 4) {
        plan.person(chance, |chance| [(); 3].map(|()| inside(chance, half, 4.0)));
    }
    if chance.happens(0.5) {
        let speed = chance.uniform(1.5, 3.0);
        let path = [(); 2].map(|()| inside(chance, half, 5.0));
        plan.cart(chance, [4.2, 1.8, 1.6], &path, speed);
    }
}

/// A place at least `off` inside the fence.
fn inside(chance: &mut Chance, half: At, off: f64) -> At {
    half.map(|side| chance.uniform(off - side, side - off))
}
