//! Power: a battery, the panels that charge it and the loads that empty it.
//!
//! Temperature, ageing and the charge regulator's losses are left out. What to switch off when the charge is low is
//! left to others.

use serde::{Deserialize, Serialize};

use crate::attitude::quaternion::{Quaternion, rotate};
use crate::vector::{Vector, dot};

/// Numbers of the power supply.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Power {
    /// Capacity of the battery, W h.
    pub battery_w_h: f64,
    /// Power of the panels in sunlight at normal incidence, W.
    pub panel_w: f64,
    /// Power of all loads, W.
    pub load_w: f64,
}

impl Default for Power {
    /// A 6U cubesat with deployed panels; assumed.
    fn default() -> Self {
        Power { battery_w_h: 75.0, panel_w: 40.0, load_w: 15.0 }
    }
}

impl Power {
    /// Charge of a full battery, joules.
    pub fn full_j(&self) -> f64 {
        self.battery_w_h * 3600.0
    }

    /// Charge after `dt` seconds, joules: between empty and full. `lit` is what [`lit`] gives.
    pub fn step(&self, charge_j: f64, lit: f64, dt: f64) -> f64 {
        if dt.is_nan() || dt <= 0.0 || lit.is_nan() {
            return charge_j;
        }
        let net_w = self.panel_w * lit.clamp(0.0, 1.0) - self.load_w;
        (charge_j + net_w * dt).min(self.full_j()).max(0.0)
    }
}

/// Share of normal incidence on the panels, on the body's -z side: the cosine of the angle to the sun, 0 from behind or
/// in eclipse. `sun` has unit length, TEME.
pub fn lit(attitude: Quaternion, sun: Vector, eclipsed: bool) -> f64 {
    if eclipsed { 0.0 } else { dot(rotate(attitude, [0.0, 0.0, -1.0]), sun).clamp(0.0, 1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attitude::quaternion::{NONE, from_axis_angle};

    #[test]
    fn an_hour_of_load_takes_its_watt_hours() {
        let power = Power::default();
        let left = (0..3600).fold(power.full_j(), |charge, _| power.step(charge, 0.0, 1.0));
        assert!((power.full_j() - left - 15.0 * 3600.0).abs() < 1e-6);
    }

    #[test]
    fn a_battery_stays_between_empty_and_full() {
        let power = Power::default();
        assert_eq!(power.step(power.full_j(), 1.0, 1e6), power.full_j());
        assert_eq!(power.step(10.0, 0.0, 1e6), 0.0);
        assert_eq!(power.step(10.0, f64::NAN, 1.0), 10.0);
    }

    #[test]
    fn panels_are_lit_by_the_cosine() {
        let sun = [0.0, 0.0, -1.0];
        assert_eq!(lit(NONE, sun, false), 1.0);
        assert_eq!(lit(NONE, sun, true), 0.0);
        assert!((lit(from_axis_angle([1.0, 0.0, 0.0], 1.0), sun, false) - libm::cos(1.0)).abs() < 1e-15);
        assert_eq!(lit(from_axis_angle([1.0, 0.0, 0.0], 3.0), sun, false), 0.0);
    }
}
