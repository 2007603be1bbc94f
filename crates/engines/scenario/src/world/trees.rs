//! A slope with trees: trunks at least a distance apart (Poisson discs, by throwing darts) on uneven ground.

use super::chance::Chance;
use super::plan::{Plan, wander};
use crate::footprint::At;

/// Trunks of a world; a denser stand is a smaller one.
const TRUNKS: f64 = 52.0;
/// Least distance between trunks as a share of their mean distance.
const APART: f64 = 0.7;
/// Darts for a trunk.
const DARTS: usize = 60;

pub(super) fn plan(chance: &mut Chance) -> Plan {
    let a_hectare = chance.uniform(100.0, 400.0);
    let side = (TRUNKS / a_hectare).sqrt() * 100.0;
    let half = side / 2.0;
    let mut plan = Plan::new([1.0 - half, -half - 5.0], 0.0, [half + 5.0, half + 11.5]);
    plan.amplitude = chance.uniform(0.4, 0.9);
    let inside = |chance: &mut Chance| [(); 2].map(|()| chance.uniform(1.0 - half, half - 1.0));
    plan.route = wander(chance, plan.start.0, inside);
    plan.park_in_sight(chance, -3.8);
    let distance = APART * 100.0 / a_hectare.sqrt();
    let mut trunks: Vec<At> = Vec::new();
    for _ in 0..TRUNKS as usize {
        let trunk = chance.uniform(0.25, 0.6);
        let darts: Vec<At> = (0..DARTS).map(|_| inside(chance)).collect();
        let far = |dart: &At| trunks.iter().all(|tree| libm::hypot(tree[0] - dart[0], tree[1] - dart[1]) >= distance);
        let hit = darts.into_iter().find(|dart| far(dart) && plan.block([trunk, trunk, 6.0], *dart, 0.0));
        trunks.extend(hit);
    }
    for _ in 0..chance.integer(0, 2) {
        plan.person(chance, |chance| [inside(chance), inside(chance)]);
    }
    plan
}
