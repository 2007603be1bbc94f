//! A campus: buildings of different sizes on a lattice, benches and bollards on the paths between them, people and bicycles.

use super::chance::Chance;
use super::plan::{Plan, wander};
use crate::footprint::At;

pub(super) fn plan(chance: &mut Chance) -> Plan {
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
        let beside = paths[chance.integer(0, 3)] + chance.uniform(-path / 2.0, path / 2.0);
        let at: At = if chance.happens(0.5) { [along, beside] } else { [beside, along] };
        let size = [chance.uniform(0.3, 1.8), chance.uniform(0.3, 0.6), 0.9];
        let heading = chance.uniform(-1.5, 1.5);
        plan.block(size, at, heading);
    }
    for _ in 0..chance.integer(3, 7) {
        plan.person(chance, |chance| {
            let corners = [meeting(chance), meeting(chance)];
            [corners[0], [corners[1][0], corners[0][1]], corners[1], [corners[0][0], corners[1][1]]]
        });
    }
    for _ in 0..chance.integer(0, 2) {
        let (beside, speed) = (paths[chance.integer(0, 3)] + 1.5, chance.uniform(2.5, 4.0));
        plan.cart(chance, [1.8, 0.6, 1.6], &[[-end, beside], [end, beside]], speed);
    }
    plan
}
