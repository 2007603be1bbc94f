//! Events that can be estimated, and a twin's progress to them.
//!
//! A level is read after each event in the twin. It only steers: any choice of levels gives the same probability, a bad
//! one with more work or a wider interval.

use serde::{Deserialize, Serialize};
use twin::Twin;
use wire::mode::Mode;

/// An event that a run may reach.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Event {
    /// The unit enters HOLD_SAFE; levels are the age of its lease, ms.
    HoldSafe,
    /// The unit's lease gets as old as the last level, ms.
    Lease,
    /// The unit gets as near to the fence as the last level, mm.
    Fence,
}

/// Numbers that are no levels of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LevelsError {
    /// No levels were given.
    #[error("the last of --levels says what the event is ({counts}); give at least one")]
    Empty {
        /// Quantity that a level counts.
        counts: &'static str,
    },
    /// They are not in order, or not finite.
    #[error("levels are the {counts}: numbers that {order} towards the event")]
    Order {
        /// Quantity that a level counts.
        counts: &'static str,
        /// `rise` or `fall`.
        order: &'static str,
    },
}

impl Event {
    /// Quantity of the levels.
    pub fn counts(self) -> &'static str {
        match self {
            Event::HoldSafe | Event::Lease => "age of the lease, ms",
            Event::Fence => "distance to the fence, mm",
        }
    }

    /// Level of `twin`.
    pub fn level(self, twin: &Twin) -> f64 {
        match self {
            Event::HoldSafe => match twin.unit().map(|(unit, _)| unit.mode()) {
                Some(Mode::HoldSafe) => f64::INFINITY,
                Some(Mode::Ready | Mode::PrepareToAct | Mode::Degraded) => lease_age(twin),
                // In IDLE no lease limits the unit.
                Some(Mode::Idle) | None => 0.0,
            },
            Event::Lease => lease_age(twin),
            Event::Fence => twin.sim().map_or(f64::NEG_INFINITY, |sim| {
                let (world, plant) = sim.truth();
                let place = plant.state(world).position;
                -1_000.0 * f64::from(world.scene().margin([place.x, place.y]))
            }),
        }
    }

    /// The levels of the stages, rising, the last of which is the event itself; from the user's numbers.
    ///
    /// # Errors
    ///
    /// Fault of the numbers.
    pub fn ladder(self, given: &[f64]) -> Result<Vec<f64>, LevelsError> {
        let (levels, order): (Vec<f64>, _) = match self {
            Event::HoldSafe => (given.iter().copied().chain([f64::INFINITY]).collect(), "rise"),
            Event::Lease => (given.to_vec(), "rise"),
            Event::Fence => (given.iter().map(|mm| -mm).collect(), "fall"),
        };
        if levels.is_empty() {
            return Err(LevelsError::Empty { counts: self.counts() });
        }
        if !given.iter().all(|level| level.is_finite()) || !levels.is_sorted_by(|a, b| a < b) {
            return Err(LevelsError::Order { counts: self.counts(), order });
        }
        Ok(levels)
    }
}

/// Milliseconds; 0 before the first grant.
fn lease_age(twin: &Twin) -> f64 {
    twin.unit().and_then(|(unit, now)| unit.lease_age(now)).map_or(0.0, |age| age.as_ms())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_lead_to_the_event_from_below() {
        assert_eq!(Event::HoldSafe.ladder(&[150.0, 250.0]), Ok(vec![150.0, 250.0, f64::INFINITY]));
        assert_eq!(Event::HoldSafe.ladder(&[]), Ok(vec![f64::INFINITY]));
        assert_eq!(Event::Fence.ladder(&[2_000.0, 900.0]), Ok(vec![-2_000.0, -900.0]));
        for (event, given) in [
            (Event::Lease, &[][..]),
            (Event::Lease, &[250.0, 150.0]),
            (Event::HoldSafe, &[150.0, 150.0]),
            (Event::HoldSafe, &[f64::NAN]),
            (Event::HoldSafe, &[f64::INFINITY]),
            (Event::Fence, &[900.0, 2_000.0]),
        ] {
            assert!(event.ladder(given).is_err(), "{event:?} {given:?}");
        }
    }
}
