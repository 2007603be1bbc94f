//! Rounds in a street: a lane around a block, with a row of parked cars on either side; some stand out into the lane, and people step out from
//! between them.

use super::chance::Chance;
use super::plan::{Plan, rounds};
use crate::footprint::At;

/// Distance from one parked car to the next, middle to middle; a person fits between two.
const PITCH: f64 = 5.2;
/// Mean length of a parked car.
const CAR: f64 = 4.25;
/// Distance from the lane's edge to the middle of a parked car.
const KERB: f64 = 1.05;
/// Kerb with one car that stands out.
const STANDS_OUT_EACH: f64 = 60.0;
const MOST_PEOPLE: usize = 6;

/// The middle line of the lane, and its width.
struct Street {
    /// Half of the middle line's sides.
    half: At,
    lane: f64,
    /// Probability that a place at the kerb is taken.
    taken: f64,
}

/// A row of places at the kerb.
struct Row {
    from: At,
    to: At,
    /// Cars may stand out of it.
    stands_out: bool,
}

pub(super) fn plan(chance: &mut Chance) -> Plan {
    let half = [chance.uniform(24.0, 32.0), chance.uniform(8.0, 12.0)];
    let lane = chance.uniform(4.0, 7.0);
    let street = Street { half, lane, taken: chance.uniform(0.4, 0.8) * PITCH / CAR };
    let [x, y] = half;
    let mut plan = Plan::new([4.0 - x, -y], 0.0, [x + lane / 2.0 + 5.0, y + lane / 2.0 + 5.0]);
    let bend = 3.0;
    let corners = [
        [x - bend, -y],
        [x, bend - y],
        [x, y - bend],
        [x - bend, y],
        [bend - x, y],
        [-x, y - bend],
        [-x, bend - y],
        [bend - x, -y],
    ];
    plan.route = rounds(chance, &corners);
    plan.park_in_sight(chance, -(lane / 2.0 + KERB));
    let mut since = chance.uniform(0.0, STANDS_OUT_EACH);
    for row in street.rows() {
        park(chance, &mut plan, &street, &row, &mut since);
    }
    people(chance, &mut plan, &street);
    plan
}

impl Street {
    /// The outer rows, then the inner ones.
    fn rows(&self) -> [Row; 8] {
        let ([x, y], kerb) = (self.half, self.lane / 2.0 + KERB);
        let outer = |from, to| Row { from, to, stands_out: true };
        let inner = |from, to| Row { from, to, stands_out: false };
        let (far, near) = ([x + kerb, y + kerb], [x - kerb, y - kerb]);
        // The start sees the parked vehicle behind the first free places; inner rows leave room for the bend.
        let (long, short) = (x - kerb - 2.0, y - kerb - 2.5);
        [
            outer([15.0 - x, -far[1]], [x, -far[1]]),
            outer([far[0], -y], [far[0], y]),
            outer([x, far[1]], [-x, far[1]]),
            outer([-far[0], y], [-far[0], -y]),
            inner([-long, -near[1]], [long, -near[1]]),
            inner([near[0], -short], [near[0], short]),
            inner([long, near[1]], [-long, near[1]]),
            inner([-near[0], short], [-near[0], -short]),
        ]
    }
}

/// Parks cars along a row. `since` is the kerb since the last one that stood out.
fn park(chance: &mut Chance, plan: &mut Plan, street: &Street, row: &Row, since: &mut f64) {
    let (east, north) = (row.to[0] - row.from[0], row.to[1] - row.from[1]);
    let length = libm::hypot(east, north);
    let heading = libm::atan2(north, east);
    let (sin, cos) = libm::sincos(heading);
    for place in 0..(length / PITCH).max(0.0) as usize {
        let along = (place as f64 + 0.5) * PITCH;
        *since += PITCH;
        if !chance.happens(street.taken) {
            continue;
        }
        let out = row.stands_out && *since >= STANDS_OUT_EACH && along > 8.0 && length - along > 8.0;
        // Rows run anticlockwise, so the lane is on the left of the outer ones.
        let aside = if out { street.lane - chance.uniform(2.4, 3.0) } else { chance.uniform(-0.05, 0.05) };
        let position = [row.from[0] + along * cos - aside * sin, row.from[1] + along * sin + aside * cos];
        if plan.car(chance, position, heading) && out {
            *since = 0.0;
        }
    }
}

/// People, up to four on 100 m: one half comes out from between cars of the row behind the block, one half walks along the inner cars.
fn people(chance: &mut Chance, plan: &mut Plan, street: &Street) {
    let ([x, y], edge) = (street.half, street.lane / 2.0);
    let most = (4.0 * 4.0 * (x + y) / 100.0) as usize;
    let back = y + edge + 2.6;
    for number in 0..chance.integer(0, most.min(MOST_PEOPLE)) {
        if number % 2 == 0 {
            let gap = |chance: &mut Chance| x - PITCH * chance.integer(1, (2.0 * x / PITCH) as usize - 1) as f64;
            plan.person(chance, |chance| {
                let (from, to) = (gap(chance), gap(chance));
                [[from, back], [from, y - edge + 0.5], [from, back], [to, back]]
            });
        } else {
            plan.person(chance, |chance| {
                let walked = chance.side() * (y - edge + 0.5);
                let from = chance.uniform(8.0 - x, x - 30.0);
                [[from, walked], [from + chance.uniform(10.0, 20.0), walked]]
            });
        }
    }
}
