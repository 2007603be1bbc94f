//! The held-out families. Their ranges are fixed before anything drives in them and are not changed by a result.
//!
//! A family that was driven once is developed from then on, as `depot` and `campus` are, and moves to a file of its own.

use super::chance::Chance;
use super::plan::{Plan, wander};
use crate::footprint::At;

/// An open square between two rows of houses, with kiosks, pillars and flower tubs anywhere, and people who cross it on ways of their own.
pub(super) fn plaza(chance: &mut Chance) -> Plan {
    let half = [chance.uniform(20.0, 30.0), chance.uniform(16.0, 24.0)];
    let mut plan = Plan::new([-half[0], -half[1]], 0.0, [half[0] + 6.0, half[1] + 12.0]);
    let anywhere = |chance: &mut Chance| half.map(|side| chance.uniform(-side, side));
    plan.route = wander(chance, plan.start.0, anywhere);
    plan.park_in_sight(chance, -3.6);
    for side in [-1.0, 1.0] {
        let mut east = -half[0];
        while east < half[0] {
            let [length, depth] = [chance.uniform(6.0, 12.0), chance.uniform(4.0, 7.0)];
            plan.wall([length, depth, 9.0], [east + length / 2.0, side * (half[1] + 4.0 + depth / 2.0)], 0.0);
            east += length + chance.uniform(0.0, 5.0);
        }
    }
    for _ in 0..chance.integer(3, 7) {
        let size = [chance.uniform(1.8, 4.0), chance.uniform(1.8, 3.0), chance.uniform(2.2, 3.0)];
        let (at, heading) = (anywhere(chance), chance.uniform(-1.5, 1.5));
        plan.block(size, at, heading);
    }
    for _ in 0..chance.integer(6, 18) {
        let (width, height) = (chance.uniform(0.4, 1.2), chance.uniform(0.8, 4.0));
        let at = anywhere(chance);
        plan.block([width, width, height], at, 0.0);
    }
    for _ in 0..chance.integer(3, 9) {
        plan.person(chance, |chance| [anywhere(chance), anywhere(chance), anywhere(chance)]);
    }
    if chance.happens(0.5) {
        let (from, to, speed) = (anywhere(chance), anywhere(chance), chance.uniform(2.0, 4.0));
        plan.cart(chance, [1.8, 0.6, 1.6], &[from, to], speed);
    }
    plan
}

/// Two lanes along a quay with stacks of containers between them, lorries on one, legs of cranes and people on the other beside the edge.
pub(super) fn quay(chance: &mut Chance) -> Plan {
    let (half, lane) = (chance.uniform(35.0, 60.0), chance.uniform(6.0, 9.0));
    let stacks = chance.integer(1, 3);
    let depth = stacks as f64 * 3.2;
    let apart = (depth + lane) / 2.0;
    let mut plan = Plan::new([-half, -apart], 0.0, [half + 8.0, apart + lane / 2.0 + 2.5]);
    plan.route = wander(chance, plan.start.0, |chance| [chance.uniform(-half, half), chance.side() * apart]);
    plan.park_in_sight(chance, -(lane / 2.0 - 0.6));
    let mut east = -half + lane;
    while east < half - lane {
        let length = if chance.happens(0.6) { 12.2 } else { 6.1 };
        for row in 0..stacks {
            let north = (row as f64 + 0.5) * 3.2 - depth / 2.0;
            if chance.happens(0.85) {
                plan.block([length, 2.44, 2.6 * chance.integer(1, 3) as f64], [east + length / 2.0, north], 0.0);
            }
        }
        east += length + if chance.happens(0.4) { chance.uniform(3.0, 8.0) } else { 0.5 };
    }
    for _ in 0..chance.integer(2, 5) {
        let leg: At = [chance.uniform(-half, half), apart + chance.side() * (lane / 2.0 - 0.8)];
        plan.block([1.4, 1.2, 8.0], leg, 0.0);
    }
    for _ in 0..chance.integer(0, 2) {
        let (north, speed) = (chance.side() * (lane / 2.0 - 1.6) - apart, chance.uniform(1.5, 3.5));
        plan.cart(chance, [5.0, 2.2, 2.8], &[[half, north], [10.0 - half, north]], speed);
    }
    for _ in 0..chance.integer(1, 5) {
        plan.person(chance, |chance| {
            let place = |chance: &mut Chance| [chance.uniform(-half, half), apart + chance.uniform(-2.0, 2.0)];
            [place(chance), place(chance)]
        });
    }
    plan
}
