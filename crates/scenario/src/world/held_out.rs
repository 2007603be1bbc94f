//! The held-out families. Their ranges were fixed before anything drove in them and are not changed by a result. No person there
//! walks through a still thing, as in every family; that rule came later, and also before anything drove in them. Of the first run in them
//! (docs/researcher/worlds.md) came one: a person's path leads somewhere.

use super::chance::Chance;
use super::plan::{Plan, wander};
use crate::footprint::At;

/// Rows of vans across lanes, with places free, fork lifts in the lanes, and a way along both ends.
pub(super) fn depot(chance: &mut Chance) -> Plan {
    let (lane, place) = (chance.uniform(5.0, 8.0), chance.uniform(3.0, 3.6));
    let (rows, places) = (chance.integer(3, 5), chance.integer(8, 14));
    let (van, share, angle) = ([6.0, 2.1, 2.6], chance.uniform(0.5, 0.8), chance.uniform(-0.4, 0.4));
    let pitch = lane + van[0] + 1.0;
    let [width, depth] = [places as f64 * place, rows as f64 * pitch + lane];
    let mut plan = Plan::new([-width / 2.0 - 8.0, 3.5 - depth / 2.0], 0.0, [width / 2.0 + 13.0, depth / 2.0 + 5.0]);
    let lanes: Vec<f64> = (0..=rows).map(|row| row as f64 * pitch + lane / 2.0 - depth / 2.0).collect();
    plan.route = wander(chance, plan.start.0, |chance| {
        [chance.uniform(-width / 2.0, width / 2.0), lanes[chance.integer(0, lanes.len() - 1)]]
    });
    plan.park_in_sight(chance, -5.5);
    for row in 0..rows {
        let north = row as f64 * pitch + lane + (pitch - lane) / 2.0 - depth / 2.0;
        for number in 0..places {
            let position = [(number as f64 + 0.5) * place - width / 2.0, north];
            if chance.happens(share) {
                plan.parked(chance, van, position, core::f64::consts::FRAC_PI_2 + angle);
            }
        }
    }
    for _ in 0..chance.integer(1, 3) {
        let north = lanes[chance.integer(0, lanes.len() - 1)] + chance.side() * (lane / 2.0 - 1.2);
        let speed = chance.uniform(0.8, 2.0);
        plan.cart(chance, [2.2, 1.1, 2.0], &[[-width / 2.0, north], [width / 2.0, north]], speed);
    }
    plan
}

/// Buildings of different sizes on a lattice, benches and bollards on the paths between them, people and bicycles.
pub(super) fn campus(chance: &mut Chance) -> Plan {
    let path = chance.uniform(6.0, 9.0);
    let pitch = path + chance.uniform(12.0, 15.0);
    let paths = [-1.5, -0.5, 0.5, 1.5].map(|number| number * pitch);
    let end = 1.5 * pitch;
    let mut plan = Plan::new([-end, -end], 0.0, [end + 6.0, end + 6.0]);
    let meeting = |chance: &mut Chance| [paths[chance.integer(0, 3)], paths[chance.integer(0, 3)]];
    plan.route = wander(chance, plan.start.0, meeting);
    plan.park_in_sight(chance, -3.6);
    let middle = |number: usize| (number as f64 - 1.0) * pitch;
    for (column, row) in (0..3).flat_map(|column| (0..3).map(move |row| (column, row))) {
        if chance.happens(0.85) {
            let [length, width] = [(); 2].map(|()| chance.uniform(7.0, pitch - path));
            let turned = chance.uniform(-0.1, 0.1);
            plan.block([length, width, 8.0], [middle(column), middle(row)], turned);
        }
    }
    for _ in 0..chance.integer(8, 20) {
        let along = chance.uniform(-end, end);
        let offset = paths[chance.integer(0, 3)] + chance.uniform(-path / 2.0, path / 2.0);
        let place: At = if chance.happens(0.5) { [along, offset] } else { [offset, along] };
        let size = [chance.uniform(0.3, 1.8), chance.uniform(0.3, 0.6), 0.9];
        let heading = chance.uniform(-1.5, 1.5);
        plan.block(size, place, heading);
    }
    for _ in 0..chance.integer(3, 7) {
        plan.person(chance, |chance| {
            let corners = [meeting(chance), meeting(chance)];
            [corners[0], [corners[1][0], corners[0][1]], corners[1], [corners[0][0], corners[1][1]]]
        });
    }
    for _ in 0..chance.integer(0, 2) {
        let (offset, speed) = (paths[chance.integer(0, 3)] + 1.5, chance.uniform(2.5, 4.0));
        plan.cart(chance, [1.8, 0.6, 1.6], &[[-end, offset], [end, offset]], speed);
    }
    plan
}
