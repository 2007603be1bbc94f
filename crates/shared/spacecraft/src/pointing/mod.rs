//! Pointing: which attitude to have, and what torques and dipoles bring the body there.
//!
//! Feedback is of the quaternion (Wie, Weiss and Arapostathis, *Quaternion feedback regulator for spacecraft eigenaxis
//! rotations*, Journal of Guidance, Control, and Dynamics 12, 1989) with the reference's rates and acceleration fed
//! forward. State is taken as known: estimation is left to others. Which attitude is safe is left to others, too.

mod reference;

pub use reference::{Reference, TurnLimits, approach};

use serde::{Deserialize, Serialize};

use crate::attitude::quaternion::{Quaternion, axis_part, inverse, of_axes, product, rotate_back, short};
use crate::attitude::{Body, State};
use crate::vector::{Vector, add, cross, dot, limited, norm, scale, sub, times, unit};

/// Controller of the wheels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Controller {
    /// Natural frequency of small errors, rad/s.
    pub frequency_rad_s: f64,
    /// Damping as a share of the critical.
    pub damping: f64,
}

impl Default for Controller {
    /// Settles in about 25 s; assumed.
    fn default() -> Self {
        Controller { frequency_rad_s: 0.25, damping: 0.9 }
    }
}

impl Controller {
    /// Torques on the body by the wheels, body axes, N m. A torque beyond the wheels' is scaled down, its direction
    /// kept.
    pub fn torques(&self, body: &Body, state: &State, wanted: &Reference) -> Vector {
        let Controller { frequency_rad_s: frequency, damping } = *self;
        // Rotation from the body's axes to the reference's. It is the identity where there is no error.
        let off = short(product(inverse(wanted.attitude), state.attitude));
        let rates = rotate_back(off, wanted.rates_rad_s);
        let error = sub(state.rates_rad_s, rates);
        let back = scale(axis_part(off), -2.0 * frequency * frequency);
        let braking = scale(error, -2.0 * damping * frequency);
        // The reference's acceleration, seen in axes that turn with the body.
        let ahead = sub(rotate_back(off, wanted.acceleration_rad_s2), cross(state.rates_rad_s, rates));
        let locked = times(body.inertia_kg_m2, state.rates_rad_s);
        let gyroscopic = cross(state.rates_rad_s, add(locked, state.wheels_n_m_s));
        let torques = add(times(body.inertia_kg_m2, add(add(back, braking), ahead)), gyroscopic);
        limited(torques, body.wheels.map(|wheel| wheel.max_torque_n_m))
    }
}

/// Dipole that takes momentum out of the wheels while they hold the attitude, body axes, A m²: the torque is `-gain`
/// times the part of their momentum that is normal to the field (cross-product law: Camillo and Markley,
/// *Orbit-averaged behavior of magnetic control laws for momentum unloading*, Journal of Guidance and Control 3, 1980).
/// Field in body axes, tesla; `gain` in 1/s.
pub fn desaturation(body: &Body, wheels_n_m_s: Vector, field_t: Vector, gain: f64) -> Vector {
    let square = dot(field_t, field_t);
    if square.is_nan() || square <= 0.0 {
        return [0.0; 3];
    }
    limited(scale(cross(wheels_n_m_s, field_t), gain / square), body.torquers_a_m2)
}

/// The attitude whose +z axis points from `position` to `target` and whose +x axis lies along `along` as far as
/// possible; all in TEME. Where a direction is missing, or both are the same, the frame's own axes take its place.
pub fn look_at(position_m: Vector, target_m: Vector, along: Vector) -> Quaternion {
    facing(sub(target_m, position_m), along)
}

/// The attitude in which the solar array, on the -z side, faces the sun, payload shut and looking away. `sun` and
/// `along`, towards which +x is turned, in TEME.
pub fn sun_pointing(sun: Vector, along: Vector) -> Quaternion {
    facing(scale(sun, -1.0), along)
}

/// +z along `direction`, +x towards `along`.
fn facing(direction: Vector, along: Vector) -> Quaternion {
    let z = unit(direction).unwrap_or([0.0, 0.0, 1.0]);
    let across = |along: Vector| {
        let along = unit(along)?;
        let flat = sub(along, scale(z, dot(along, z)));
        // A direction nearer to z than this does not determine x.
        unit(flat).filter(|_| norm(flat) > 1e-9)
    };
    let x = across(along).or_else(|| across([1.0, 0.0, 0.0])).or_else(|| across([0.0, 1.0, 0.0]));
    let x = x.expect("invariant: one of two axes is not along a third direction");
    of_axes(x, cross(z, x), z)
}

#[cfg(test)]
mod tests;
