//! Rounds along a fence: the corridor between the geofence and an inner fence, with walls across it and a gate in each.
//!
//! Places along the corridor are reported by the side of the fence and by the depth, from the geofence inwards.

use super::chance::Chance;
use super::plan::{Plan, rounds};
use crate::footprint::At;

/// Thickness and height of a fence.
const FENCE: [f64; 2] = [0.3, 1.8];
/// Longest part of a fence.
const PART: f64 = 18.0;

/// The corridor.
struct Corridor {
    /// Half of the geofence's sides.
    half: At,
    width: f64,
}

pub(super) fn plan(chance: &mut Chance) -> Plan {
    let half = [chance.uniform(30.0, 44.0), chance.uniform(24.0, 42.0)];
    let corridor = Corridor { half, width: chance.uniform(9.0, 11.0) };
    let middle = corridor.width / 2.0 + 0.75;
    let [x, y] = half.map(|side| side - middle);
    let mut plan = Plan::new([3.0 - x, -y], 0.0, half);
    plan.route = rounds(chance, &[[x, -y], [x, y], [-x, y], [-x, -y]]);
    plan.park_in_sight(chance, corridor.width - 1.3 - middle);
    for side in 0..4 {
        corridor.inner_fence(&mut plan, side);
        corridor.gates(chance, &mut plan, side);
    }
    plan
}

impl Corridor {
    /// The place `along` a side, anticlockwise from its middle, and `deep` inside the geofence; and the heading of the
    /// side.
    fn place(&self, side: usize, along: f64, deep: f64) -> (At, f64) {
        let [x, y] = self.half;
        let quarter = core::f64::consts::FRAC_PI_2;
        match side {
            0 => ([along, deep - y], 0.0),
            1 => ([x - deep, along], quarter),
            2 => ([-along, y - deep], 0.0),
            _ => ([deep - x, -along], quarter),
        }
    }

    /// Half of the inner fence's length on a side.
    fn inner_half(&self, side: usize) -> f64 {
        self.half[side % 2] - self.width
    }

    fn inner_fence(&self, plan: &mut Plan, side: usize) {
        let length = 2.0 * self.inner_half(side);
        let parts = libm::ceil(length / PART);
        for number in 0..parts as usize {
            let along = length * ((number as f64 + 0.5) / parts - 0.5);
            let (place, heading) = self.place(side, along, self.width + FENCE[0] / 2.0);
            plan.wall([length / parts, FENCE[0], FENCE[1]], place, heading);
        }
    }

    /// One gate or two on a side; on the first, behind the parked vehicle.
    fn gates(&self, chance: &mut Chance, plan: &mut Plan, side: usize) {
        let end = self.inner_half(side) - 3.0;
        let begin = if side == 0 { (26.0 - self.half[0] + self.width / 2.0).max(-end) } else { -end };
        let gates = if end - begin > 30.0 { chance.integer(1, 2) } else { 1 };
        for number in 0..gates {
            let share = (number as f64 + chance.uniform(0.2, 0.8)) / gates as f64;
            self.gate(chance, plan, side, begin + share * (end - begin));
        }
    }

    /// A wall across the corridor in two parts with a gate between them, and at some a person who walks to and fro before it.
    fn gate(&self, chance: &mut Chance, plan: &mut Plan, side: usize, along: f64) {
        let open = chance.uniform(2.4, 3.5);
        let middle = chance.uniform(1.8 + open / 2.0, self.width - open / 2.0 - 0.4);
        for [from, to] in [[0.0, middle - open / 2.0], [middle + open / 2.0, self.width]] {
            let (place, heading) = self.place(side, along, (from + to) / 2.0);
            plan.wall([to - from, FENCE[0], FENCE[1]], place, heading + core::f64::consts::FRAC_PI_2);
        }
        if chance.happens(0.4) {
            plan.person(chance, |chance| {
                let before = along + chance.side() * 2.5;
                [2.0, self.width - 1.0].map(|deep| self.place(side, before, deep).0)
            });
        }
    }
}
