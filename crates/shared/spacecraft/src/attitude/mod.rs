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

/// True if these are the moments of inertia of a body about its principal axes, kg m²: positive, each below the sum of the other two.
pub fn are_moments([x, y, z]: Vector) -> bool {
    let sides = x < y + z && y < z + x && z < x + y;
    [x, y, z].iter().all(|moment| moment.is_finite() && *moment > 0.0) && sides
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
    fn the_default_body_has_moments() {
        assert!(are_moments(Body::default().inertia_kg_m2));
    }

    #[test]
    fn moments_of_no_body_are_not() {
        for moments in [[0.06, 0.10, 0.17], [-0.1, 0.1, 0.1], [f64::NAN, 0.1, 0.1], [0.0; 3]] {
            assert!(!are_moments(moments), "{moments:?}");
        }
    }
}
