//! A yard of 40 to 80 m: way points anywhere, things on the straight lines between them, people who walk about.

use super::chance::Chance;
use super::plan::{Plan, rounds};
use crate::footprint::At;

pub(super) fn plan(chance: &mut Chance) -> Plan {
    let half = chance.uniform(20.0, 40.0);
    let mut plan = Plan::new([5.0 - half, 7.0 - half], 0.0, [half, half]);
    plan.amplitude = 0.35;
    let inside = |chance: &mut Chance| [(); 2].map(|()| chance.uniform(5.0 - half, half - 5.0));
    let places: Vec<At> = (0..chance.integer(4, 8)).map(|_| inside(chance)).collect();
    plan.route = rounds(chance, &places);
    plan.park_in_sight(chance, -3.8);
    for (from, to) in places.iter().zip(places.iter().cycle().skip(1)) {
        if chance.happens(0.7) {
            let (share, offset) = (chance.uniform(0.3, 0.7), chance.uniform(-0.6, 0.6));
            let place = [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]) + offset);
            thing(chance, &mut plan, place);
        }
    }
    for _ in 0..chance.integer(4, 14) {
        let place = inside(chance);
        thing(chance, &mut plan, place);
    }
    for _ in 0..chance.integer(1, 4) {
        plan.person(chance, |chance| [inside(chance), inside(chance), inside(chance)]);
    }
    plan
}

/// A crate or, one time in four, a parked car.
fn thing(chance: &mut Chance, plan: &mut Plan, place: At) {
    let heading = chance.uniform(-3.0, 3.0);
    if chance.happens(0.25) {
        plan.car(chance, place, heading);
    } else {
        let size = [chance.uniform(0.8, 3.0), chance.uniform(0.8, 2.0), chance.uniform(0.8, 1.6)];
        plan.block(size, place, heading);
    }
}
