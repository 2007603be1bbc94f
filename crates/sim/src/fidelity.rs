//! Assumed errors of the models of sensors and plant, for asking which results depend on them.
//!
//! These are properties of the world, unknown to services, and no faults: they inject no event and appear in no
//! receipt. Scenarios choose the values, campaigns compare the results.

use serde::{Deserialize, Serialize};

use crate::limits::SceneError;

/// Factors on the models, 1 as they ship.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Fidelity {
    /// Factor on the noise of every sensor. In a run without rendering also on the rates at which a stage misses,
    /// confuses or invents something; not on the 0.3 K of the unrendered thermal stage, nor on the confidence of a
    /// detection. A receiver states the deviation that it then has.
    pub noise: f32,
    /// Factor on the mass of the vehicle, unknown to drive and brakes: they push as before.
    pub load: f32,
    /// Factor on the friction between wheels and ground.
    pub grip: f32,
}

/// Least and greatest factor on noise.
const NOISE: [f32; 2] = [0.1, 10.0];
/// Least and greatest factor on mass.
const LOAD: [f32; 2] = [0.5, 2.0];
/// Least and greatest factor on friction.
const GRIP: [f32; 2] = [0.05, 2.0];

impl Fidelity {
    /// The models as they ship.
    pub const SHIPPED: Fidelity = Fidelity { noise: 1.0, load: 1.0, grip: 1.0 };

    /// # Errors
    /// A factor that is no number or outside its range.
    pub fn check(&self) -> Result<(), SceneError> {
        let each = [
            ("fidelity.noise", self.noise, NOISE),
            ("fidelity.load", self.load, LOAD),
            ("fidelity.grip", self.grip, GRIP),
        ];
        let off = each.into_iter().find(|(_, got, [low, high])| !(*low..=*high).contains(got));
        off.map_or(Ok(()), |(field, got, [low, high])| Err(SceneError::OutOfRange { field, got, low, high }))
    }
}

impl Default for Fidelity {
    fn default() -> Self {
        Self::SHIPPED
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// So is one that is no number.
    #[test]
    fn factor_out_of_range_is_refused() {
        assert_eq!(Fidelity::SHIPPED.check(), Ok(()));
        for noise in [0.0, 11.0, f32::NAN, f32::INFINITY] {
            let refused = Fidelity { noise, ..Fidelity::SHIPPED }.check();
            assert!(matches!(refused, Err(SceneError::OutOfRange { field: "fidelity.noise", .. })), "{noise}");
        }
        assert!(Fidelity { load: 0.4, ..Fidelity::SHIPPED }.check().is_err());
        assert!(Fidelity { grip: 0.0, ..Fidelity::SHIPPED }.check().is_err());
    }
}
