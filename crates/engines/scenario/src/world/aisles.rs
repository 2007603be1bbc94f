//! A store: racks in rows with cross aisles, pallets left in one aisle of five, people and a cart.
//!
//! The route leads to and fro between the ends of the store, to the mouth of an aisle each time.

use super::chance::Chance;
use super::plan::{Plan, wander};
use crate::footprint::At;

/// Depth of a rack.
const RACK: f64 = 1.2;
/// Distance from the racks to the middle of the ends' way.
const HEAD: f64 = 3.2;

/// The racks, around the middle.
struct Store {
    /// Free width of an aisle.
    aisle: f64,
    aisles: usize,
    /// Racks behind each other in a row.
    bays: usize,
    /// Length of a rack.
    bay: f64,
    /// Free width between racks behind each other.
    cross: f64,
}

pub(super) fn plan(chance: &mut Chance) -> Plan {
    let store = Store {
        aisle: chance.uniform(2.6, 4.0),
        aisles: chance.integer(5, 9),
        bays: chance.integer(2, 3),
        bay: chance.uniform(8.0, 14.0),
        cross: chance.uniform(3.5, 4.5),
    };
    let [width, length] = store.size();
    let mut plan =
        Plan::new([-width / 2.0 - 8.0, -length / 2.0 - HEAD], 0.0, [width / 2.0 + 12.0, length / 2.0 + 11.0]);
    // The furthest of three places is taken: nearly always one at the other end.
    plan.route = wander(chance, plan.start.0, |chance| {
        [store.middle(chance.integer(0, store.aisles - 1)), chance.side() * (length / 2.0 + HEAD)]
    });
    plan.park_in_sight(chance, -4.0);
    racks(&mut plan, &store);
    pallets_and_people(chance, &mut plan, &store);
    let way = length / 2.0 + 6.5;
    plan.cart(chance, [1.4, 0.8, 1.2], &[[-width / 2.0, way], [width / 2.0, way]], 1.0);
    plan
}

impl Store {
    /// East and north.
    fn size(&self) -> At {
        let (aisles, bays) = (self.aisles as f64, self.bays as f64);
        [aisles * (self.aisle + RACK) + RACK, bays * self.bay + (bays - 1.0) * self.cross]
    }

    /// Middle of an aisle, east.
    fn middle(&self, number: usize) -> f64 {
        (number as f64 + 0.5) * (self.aisle + RACK) + RACK / 2.0 - self.size()[0] / 2.0
    }

    /// Middle of a rack of this number from the south, north.
    fn bay_middle(&self, number: usize) -> f64 {
        number as f64 * (self.bay + self.cross) + self.bay / 2.0 - self.size()[1] / 2.0
    }
}

fn racks(plan: &mut Plan, store: &Store) {
    for row in 0..=store.aisles {
        let east = row as f64 * (store.aisle + RACK) + RACK / 2.0 - store.size()[0] / 2.0;
        for bay in 0..store.bays {
            plan.block([store.bay, RACK, 3.0], [east, store.bay_middle(bay)], core::f64::consts::FRAC_PI_2);
        }
    }
}

/// A pallet in one aisle of five, and up to six people in the others, each at one side of its aisle.
fn pallets_and_people(chance: &mut Chance, plan: &mut Plan, store: &Store) {
    let end = store.size()[1] / 2.0;
    let mut people = chance.integer(0, 6);
    for number in 0..store.aisles {
        let middle = store.middle(number);
        if chance.happens(0.2) {
            let bay = store.bay_middle(chance.integer(0, store.bays - 1));
            let reach = store.aisle / 2.0 - 0.6;
            let place = [middle + chance.uniform(-reach, reach), bay + chance.uniform(-3.0, 3.0)];
            plan.block([1.2, 0.8, 1.1], place, chance.uniform(-0.2, 0.2));
        } else if people > 0 && chance.happens(0.7) {
            people -= 1;
            plan.person(chance, |chance| {
                let east = middle + chance.side() * (store.aisle / 2.0 - 0.5);
                [[east, -end], [east, end]]
            });
        }
    }
}
