//! A large site, 400 to 960 m by the same: way points far apart on a round about its middle, things on the lines between them and beside them, sheds,
//! people who cross and carts that pass.

use core::f64::consts::TAU;

use super::chance::Chance;
use super::plan::Plan;
use crate::footprint::At;

/// Distance of way points and things from the fence, metres.
const INSIDE: f64 = 20.0;
/// Shortest and longest circumference of the ellipse that way points lie on or somewhat inside, metres: driven in ten minutes.
const ROUND_M: [f64; 2] = [800.0, 1300.0];

pub(super) fn plan(chance: &mut Chance) -> Plan {
    let half = [chance.uniform(200.0, 480.0), chance.uniform(200.0, 480.0)];
    let places = round(chance, half);
    let (start, first) = (places[0], places[1]);
    let heading = libm::atan2(first[1] - start[1], first[0] - start[0]);
    let mut plan = Plan::new(start, heading, half);
    plan.amplitude = 0.35;
    plan.route = places.iter().copied().cycle().skip(1).take(places.len()).collect();
    // The last way point is the start: a thing leaves room around both.
    plan.park_in_sight(chance, -4.5);
    for (from, to) in legs(&places) {
        add_things(chance, &mut plan, (from, to));
    }
    for (from, to) in legs(&places) {
        add_movers(chance, &mut plan, (from, to));
    }
    plan
}

/// Places on an ellipse around a middle that fits inside the fence, each moved by chance.
fn round(chance: &mut Chance, half: At) -> Vec<At> {
    let number = chance.integer(8, 14);
    let length = chance.uniform(ROUND_M[0], ROUND_M[1]);
    let flat = chance.uniform(0.6, 1.0);
    // The circumference of an ellipse that is nearly round is that of a circle of the mean radius.
    let radius = length / TAU * 2.0 / (1.0 + flat);
    let radii = [radius, radius * flat].map(|along| along.min(half[0].min(half[1]) - INSIDE));
    let room = [0, 1].map(|axis| half[axis] - INSIDE - radii[axis]);
    let middle = room.map(|room| chance.uniform(-room, room));
    let begin = chance.uniform(0.0, TAU);
    let place = |number_of: usize, chance: &mut Chance| {
        let (sin, cos) = libm::sincos(begin + TAU * number_of as f64 / number as f64);
        let nearer = chance.uniform(0.8, 1.0);
        [middle[0] + radii[0] * nearer * cos, middle[1] + radii[1] * nearer * sin]
    };
    (0..number).map(|number_of| place(number_of, chance)).collect()
}

fn legs(places: &[At]) -> Vec<(At, At)> {
    places.iter().copied().zip(places.iter().copied().cycle().skip(1)).collect()
}

/// The place at a share of a leg, and `left` metres to its left.
fn place((from, to): (At, At), share: f64, left: f64) -> At {
    let [east, north] = [0, 1].map(|axis| to[axis] - from[axis]);
    let length = libm::hypot(east, north).max(1.0);
    [from[0] + share * east - left * north / length, from[1] + share * north + left * east / length]
}

/// A thing on the line of six legs in ten, and two beside each: crates, parked cars and, further away, sheds.
fn add_things(chance: &mut Chance, plan: &mut Plan, leg: (At, At)) {
    if chance.happens(0.6) {
        let (share, left) = (chance.uniform(0.3, 0.7), chance.uniform(-0.8, 0.8));
        thing(chance, plan, place(leg, share, left));
    }
    for _ in 0..2 {
        let (share, left) = (chance.uniform(0.1, 0.9), chance.side() * chance.uniform(3.0, 20.0));
        let position = place(leg, share, left);
        if left.abs() > 12.0 {
            let size = [chance.uniform(6.0, 14.0), chance.uniform(5.0, 8.0), chance.uniform(3.0, 6.0)];
            let heading = chance.uniform(-3.0, 3.0);
            plan.block(size, position, heading);
        } else {
            thing(chance, plan, position);
        }
    }
}

fn thing(chance: &mut Chance, plan: &mut Plan, place: At) {
    let heading = chance.uniform(-3.0, 3.0);
    if chance.happens(0.4) {
        plan.car(chance, place, heading);
    } else {
        let size = [chance.uniform(0.8, 4.0), chance.uniform(0.8, 2.5), chance.uniform(0.8, 2.0)];
        plan.block(size, place, heading);
    }
}

/// A person who crosses four legs in ten, and on one in ten a cart that passes beside the line.
fn add_movers(chance: &mut Chance, plan: &mut Plan, leg: (At, At)) {
    if chance.happens(0.4) {
        plan.person(chance, |chance| {
            let share = chance.uniform(0.2, 0.8);
            [-8.0, 8.0].map(|left| place(leg, share, left))
        });
    }
    if chance.happens(0.1) {
        let (left, speed) = (chance.side() * 2.5, chance.uniform(0.8, 2.0));
        let ends = [0.15, 0.85].map(|share| place(leg, share, left));
        plan.cart(chance, [2.2, 1.1, 2.0], &ends, speed);
    }
}
