//! Attitude: a rigid body with three wheels and three magnetic torquers, as it turns.
//!
//! [`quaternion`] has the arithmetic, [`Body`] the numbers, [`step`] the motion. What torques to ask for is
//! [`crate::pointing`]'s.

mod dynamics;
pub mod quaternion;

pub use dynamics::{Environment, MOST_STEP_S, momentum, step};

use serde::{Deserialize, Serialize};

use crate::vector::Vector;
use quaternion::Quaternion;

/// Reaction wheel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wheel {
    /// Moment of inertia about its axis, kg m².
    pub inertia_kg_m2: f64,
    /// Greatest torque, N m.
    pub max_torque_n_m: f64,
    /// Greatest momentum, N m s.
    pub max_momentum_n_m_s: f64,
}

impl Wheel {
    /// Blue Canyon Technologies RWP015: 4 mN m, 15 mN m s, and the inertia that has this momentum at 6,000 rpm (data
    /// sheet *Reaction Wheels*, 2019, as in `BCT_RWP015` of `simIncludeRW.py`, Basilisk 2.12.1).
    pub const RWP015: Wheel =
        Wheel { inertia_kg_m2: 0.015 / 628.318_530_717_958_6, max_torque_n_m: 0.004, max_momentum_n_m_s: 0.015 };
}

/// Numbers of the body. Its axes are the principal ones, and the wheels' and torquers' axes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Body {
    /// Principal moments of inertia, wheels at rest in the body included, kg m².
    pub inertia_kg_m2: Vector,
    /// Wheels along x, y and z.
    pub wheels: [Wheel; 3],
    /// Greatest magnetic dipole of the torquer along each axis, A m².
    pub torquers_a_m2: Vector,
}

impl Default for Body {
    /// A 6U cubesat of 10 kg with deployed panels: moments and torquers are assumed, the wheels are [`Wheel::RWP015`].
    fn default() -> Self {
        Body { inertia_kg_m2: [0.06, 0.10, 0.13], wheels: [Wheel::RWP015; 3], torquers_a_m2: [0.3; 3] }
    }
}

impl Body {
    /// Whether the numbers are those of a body: positive, the moments a triangle's sides and larger than the wheels'.
    pub fn is_possible(&self) -> bool {
        let [x, y, z] = self.inertia_kg_m2;
        let wheels = self.wheels.iter().zip(self.inertia_kg_m2).all(|(wheel, whole)| {
            let numbers = [wheel.inertia_kg_m2, wheel.max_torque_n_m, wheel.max_momentum_n_m_s];
            numbers.iter().all(|number| number.is_finite() && *number > 0.0) && wheel.inertia_kg_m2 < whole
        });
        let torquers = self.torquers_a_m2.iter().all(|dipole| dipole.is_finite() && *dipole >= 0.0);
        let finite = self.inertia_kg_m2.iter().all(|moment| moment.is_finite());
        finite && wheels && torquers && x < y + z && y < z + x && z < x + y
    }
}

/// Attitude and motion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct State {
    /// Body to TEME, scalar first.
    pub attitude: Quaternion,
    /// Rates about the body's axes against TEME, rad/s.
    pub rates_rad_s: Vector,
    /// Momentum of the wheels against the body, body axes, N m s.
    pub wheels_n_m_s: Vector,
}

impl State {
    /// At rest in TEME, wheels at rest.
    pub fn at_rest(attitude: Quaternion) -> Self {
        State { attitude, rates_rad_s: [0.0; 3], wheels_n_m_s: [0.0; 3] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_body_is_possible() {
        assert!(Body::default().is_possible());
    }

    #[test]
    fn moments_of_no_body_are_not() {
        for inertia_kg_m2 in [[0.06, 0.10, 0.17], [-0.1, 0.1, 0.1], [f64::NAN, 0.1, 0.1], [1e-5, 1e-5, 1e-5]] {
            assert!(!Body { inertia_kg_m2, ..Body::default() }.is_possible(), "{inertia_kg_m2:?}");
        }
    }
}
