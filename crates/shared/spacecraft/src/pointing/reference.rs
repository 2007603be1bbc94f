//! Reference: the attitude, rates and acceleration that the body is to have now, on its way to those it is to have in
//! the end.

use serde::{Deserialize, Serialize};

use crate::attitude::quaternion::{Quaternion, from_axis_angle, inverse, normalized, product, rotate, rotation_vector};
use crate::vector::{Vector, add, norm, scale, sub, unit};

/// Share of the greatest acceleration with which a reference plans to stop; the rest is for a goal that moves.
const STOPS: f64 = 0.8;

/// What the body is to do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reference {
    /// Body to TEME, scalar first.
    pub attitude: Quaternion,
    /// Rates of it against TEME, about its own axes, rad/s.
    pub rates_rad_s: Vector,
    /// Change of these rates, rad/s².
    pub acceleration_rad_s2: Vector,
}

/// Limits of the turn of a reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TurnLimits {
    /// Greatest rate towards the goal, rad/s; on top of the goal's own.
    pub rate_rad_s: f64,
    /// Greatest acceleration, rad/s².
    pub acceleration_rad_s2: f64,
}

impl Default for TurnLimits {
    /// What the default body's wheels can do about any axis with half of their torque and momentum.
    fn default() -> Self {
        TurnLimits { rate_rad_s: 0.05, acceleration_rad_s2: 0.015 }
    }
}

impl Reference {
    /// An attitude that is in TEME.
    pub fn at_rest(attitude: Quaternion) -> Self {
        Reference { attitude, rates_rad_s: [0.0; 3], acceleration_rad_s2: [0.0; 3] }
    }

    /// Reference in even rotation that had the attitude `before` `dt` seconds ago. Without a positive `dt` it is at
    /// rest.
    pub fn moving(before: Quaternion, attitude: Quaternion, dt: f64) -> Self {
        let way = rotation_vector(product(inverse(before), attitude));
        let rates_rad_s = if dt > 0.0 { scale(way, 1.0 / dt) } else { [0.0; 3] };
        Reference { rates_rad_s, ..Reference::at_rest(attitude) }
    }

    /// This reference with the acceleration that leads to the next: what a controller is given for the step between
    /// them.
    pub fn leading_to(&self, next: &Reference) -> Self {
        Reference { acceleration_rad_s2: next.acceleration_rad_s2, ..*self }
    }

    /// The reference `dt` seconds later, at most 1 s, on its way to `goal` by the short way, and with it once it is
    /// there.
    pub fn step_towards(&self, goal: &Reference, limits: &TurnLimits, dt: f64) -> Self {
        if dt.is_nan() || dt <= 0.0 {
            return *self;
        }
        let TurnLimits { rate_rad_s: most, acceleration_rad_s2: faster } = *limits;
        let off = product(inverse(self.attitude), goal.attitude);
        let way = rotation_vector(off);
        let left = norm(way);
        // Largest rate from which the rest of the way is long enough to stop.
        let closing = (2.0 * STOPS * faster * left).sqrt().min(most).min(0.5 * left / dt);
        let own_rates = rotate(off, goal.rates_rad_s);
        let wanted = unit(way).map_or(own_rates, |along| add(own_rates, scale(along, closing)));
        let change = sub(wanted, self.rates_rad_s);
        // `MIN_POSITIVE` instead of zero: without a change the factor is then 1.
        let change = scale(change, (faster * dt / norm(change).max(f64::MIN_POSITIVE)).min(1.0));
        let turned = scale(add(self.rates_rad_s, scale(change, 0.5)), dt);
        Reference {
            attitude: normalized(product(self.attitude, from_axis_angle(turned, norm(turned)))),
            rates_rad_s: add(self.rates_rad_s, change),
            acceleration_rad_s2: scale(change, 1.0 / dt),
        }
    }
}

/// Attitude after a turn of `dt` seconds from `current` towards `wanted`, by the short way and at no more than
/// `max_rate`, rad/s. The turn has no acceleration; that of [`Reference::step_towards`] has.
pub fn approach(current: Quaternion, wanted: Quaternion, max_rate: f64, dt: f64) -> Quaternion {
    let way = rotation_vector(product(inverse(current), wanted));
    let (angle, most) = (norm(way), (max_rate * dt).max(0.0));
    if angle <= most { wanted } else { normalized(product(current, from_axis_angle(way, most))) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attitude::quaternion::{NONE, angle};

    #[test]
    fn an_approach_ends_at_the_wanted_attitude() {
        let wanted = from_axis_angle([1.0, 2.0, -1.0], 1.2);
        let mut q = NONE;
        for i in 1..=12 {
            let next = approach(q, wanted, 0.1, 1.0);
            assert!(angle(q, next) <= 0.1 + 1e-12, "{i}");
            q = next;
        }
        assert!(angle(q, wanted) < 1e-12);
    }

    #[test]
    fn a_reference_keeps_to_its_limits() {
        let (goal, limits) = (Reference::at_rest(from_axis_angle([1.0, -0.5, 2.0], 1.34)), TurnLimits::default());
        let mut reference = Reference::at_rest(NONE);
        for _ in 0..6000 {
            let next = reference.step_towards(&goal, &limits, 0.01);
            assert!(norm(next.rates_rad_s) <= 0.05 + 1e-12 && norm(next.acceleration_rad_s2) <= 0.015 + 1e-12);
            let turned = angle(reference.attitude, next.attitude);
            assert!((turned - norm(add(reference.rates_rad_s, next.rates_rad_s)) * 0.005).abs() < 1e-9);
            reference = next;
        }
        assert!(angle(reference.attitude, goal.attitude) < 1e-9);
        assert!(norm(reference.rates_rad_s) < 1e-9);
    }

    #[test]
    fn a_reference_goes_with_a_goal_that_turns() {
        let limits = TurnLimits::default();
        let mut reference = Reference::at_rest(from_axis_angle([0.0, 1.0, 0.0], 2.0));
        let rates_rad_s = [0.01, 0.0, 0.005];
        let mut goal = Reference { rates_rad_s, ..Reference::at_rest(NONE) };
        for _ in 0..10_000 {
            goal.attitude = product(goal.attitude, from_axis_angle(rates_rad_s, norm(rates_rad_s) * 0.01));
            reference = reference.step_towards(&goal, &limits, 0.01);
        }
        let off = angle(reference.attitude, goal.attitude);
        assert!(off < 5e-4, "{off}");
        assert!(norm(sub(reference.rates_rad_s, rates_rad_s)) < 1e-4);
    }

    #[test]
    fn no_time_moves_no_reference() {
        let (reference, goal) = (Reference::at_rest(NONE), Reference::at_rest(from_axis_angle([1.0, 0.0, 0.0], 1.0)));
        assert_eq!(reference.step_towards(&goal, &TurnLimits::default(), f64::NAN), reference);
        assert_eq!(reference.step_towards(&reference, &TurnLimits::default(), 0.1), reference);
    }
}
