//! A crossing: two streets between four blocks with a road around them, kiosks, parked cars, people who cross and vehicles that pass.

use super::chance::Chance;
use super::plan::{Plan, wander};
use crate::footprint::At;

/// Half of the fence's sides.
const HALF: f64 = 30.0;

pub(super) fn plan(chance: &mut Chance) -> Plan {
    let (street, block) = (chance.uniform(6.0, 8.0), chance.uniform(13.0, 17.0));
    let ring = (street / 2.0 + block + HALF - 1.5) / 2.0;
    let mut plan = Plan::new([-ring, -ring], 0.0, [HALF, HALF]);
    // Vehicles pass on the south half of the street from west to east.
    let lane = street / 4.0;
    let ends = [[ring, lane], [0.0, ring], [-ring, lane], [0.0, -ring]];
    let corners = [[ring, ring], [-ring, ring], [-ring, -ring], [ring, -ring]];
    let stations: Vec<At> = ends.into_iter().chain(corners).collect();
    plan.route = wander(chance, plan.start.0, |chance| stations[chance.integer(0, stations.len() - 1)]);
    plan.park_in_sight(chance, ring - HALF + 2.3);
    for (east, north) in [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)] {
        let middle = (street + block) / 2.0;
        plan.block([block, block, 6.0], [east * middle, north * middle], 0.0);
    }
    furniture(chance, &mut plan, street, block);
    people(chance, &mut plan, street, block);
    for _ in 0..chance.integer(1, 3) {
        let speed = chance.uniform(1.5, 2.5);
        let path = [[-46.0, -lane], [46.0, -lane], [46.0, 46.0], [-46.0, 46.0]];
        plan.cart(chance, [4.2, 1.8, 1.5], &path, speed);
    }
    plan
}

/// Kiosks at the walls of the street from south to north, and cars parked along the fence.
fn furniture(chance: &mut Chance, plan: &mut Plan, street: f64, block: f64) {
    let end = street / 2.0 + block;
    for _ in 0..chance.integer(3, 6) {
        let size = [chance.uniform(1.0, 2.2), chance.uniform(0.8, 1.2), 2.2];
        let north = chance.side() * chance.uniform(street / 2.0 + 1.0, end);
        plan.block(size, [chance.side() * (street / 2.0 - 0.8), north], core::f64::consts::FRAC_PI_2);
    }
    for _ in 0..chance.integer(4, 10) {
        let (along, far) = (chance.uniform(-end, end), chance.side() * (HALF - 2.3));
        let (place, heading) =
            if chance.happens(0.5) { ([along, far], 0.0) } else { ([far, along], core::f64::consts::FRAC_PI_2) };
        // Vehicles leave the street from west to east there.
        let is_before_the_street = heading > 0.0 && along.abs() < street / 2.0 + 3.0;
        if !is_before_the_street {
            plan.car(chance, place, heading);
        }
    }
}

/// People who walk along a stretch of a street, cross it, and come back on the other side.
fn people(chance: &mut Chance, plan: &mut Plan, street: f64, block: f64) {
    let edge = street / 2.0 - 0.4;
    for _ in 0..chance.integer(3, 9) {
        plan.person(chance, |chance| {
            let from = chance.side() * chance.uniform(street / 2.0, street / 2.0 + block - 2.0);
            let to = from + chance.uniform(-8.0, 8.0);
            let path = [[-edge, from], [edge, from], [edge, to], [-edge, to]];
            let turned = chance.happens(0.3);
            path.map(|[a, b]| if turned { [b, a] } else { [a, b] })
        });
    }
}
