//! A depot: rows of vans across lanes, with places free, fork lifts in the lanes, and a way along both ends.

use super::chance::Chance;
use super::plan::{Plan, wander};

pub(super) fn plan(chance: &mut Chance) -> Plan {
    let (lane, place) = (chance.uniform(5.0, 8.0), chance.uniform(3.0, 3.6));
    let (rows, places) = (chance.integer(3, 5), chance.integer(8, 14));
    let (van, taken, angle) = ([6.0, 2.1, 2.6], chance.uniform(0.5, 0.8), chance.uniform(-0.4, 0.4));
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
            let at = [(number as f64 + 0.5) * place - width / 2.0, north];
            if chance.happens(taken) {
                plan.parked(chance, van, at, core::f64::consts::FRAC_PI_2 + angle);
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
