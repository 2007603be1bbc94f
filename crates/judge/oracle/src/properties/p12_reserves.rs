//! P12: the stored energy takes the unit to safety at any time, and it keeps its distance to the surface below; from the plant's true
//! margins, for platforms that leave the ground.

use super::{Finding, Property, finding};
use crate::facts::Facts;
use crate::facts::motion::Reserves;

pub(super) fn check(facts: &Facts) -> Vec<Finding> {
    let first_below = |test: &dyn Fn(&Reserves) -> bool, message: &str| {
        let below = facts.timeline.truth.iter().find(|t| t.reserves.as_ref().is_some_and(test))?;
        Some(finding(Property::P12, below.at, message))
    };
    let energy = first_below(&|reserves| reserves.energy < 0, "less energy than the way to safety takes");
    let clearance =
        first_below(&|reserves| reserves.clearance < 0, "nearer than the least distance to the surface below");
    energy.into_iter().chain(clearance).collect()
}
