//! Attitudes, slews, and the torquers on the wheels.

use super::*;
use crate::attitude::quaternion::{NONE, angle, from_axis_angle, rotate};
use crate::attitude::{Environment, step};
use crate::date::Date;
use crate::earth::magnetic_field;
use crate::orbit::Orbit;
use crate::orbit::tests::elements;

#[test]
fn look_has_z_on_the_target() {
    let (position, target, along) = ([7e6, 1e6, -2e6], [6e6, 1.2e6, -1e6], [0.1, 0.9, 0.3]);
    let q = look_at(position, target, along);
    let z = unit(sub(target, position)).unwrap();
    assert!(norm(sub(rotate(q, [0.0, 0.0, 1.0]), z)) < 1e-14);
    assert!(dot(rotate(q, [0.0, 1.0, 0.0]), along).abs() < 1e-14);
    assert!(dot(rotate(q, [1.0, 0.0, 0.0]), along) > 0.0);
}

#[test]
fn a_look_along_itself_is_an_attitude() {
    for (direction, along) in
        [([1.0, 0.0, 0.0], [1.0, 0.0, 0.0]), ([0.0; 3], [0.0; 3]), ([f64::NAN; 3], [0.0, 1.0, 0.0])]
    {
        let q = look_at([0.0; 3], direction, along);
        assert!((q.iter().map(|part| part * part).sum::<f64>() - 1.0).abs() < 1e-14);
    }
}

#[test]
fn the_array_faces_the_sun() {
    let sun = unit([0.5, -0.7, 0.2]).unwrap();
    let q = sun_pointing(sun, [0.0, 0.0, 1.0]);
    assert!(norm(sub(rotate(q, [0.0, 0.0, -1.0]), sun)) < 1e-14);
}

#[test]
fn a_slew_settles_on_the_wanted_attitude() {
    let (body, controller) = (Body::default(), Controller::default());
    let wanted = from_axis_angle([1.0, -0.5, 2.0], 77.0_f64.to_radians());
    let (mut state, mut reference) = (State::at_rest(NONE), Reference::at_rest(NONE));
    let (mut most_off, mut fastest) = (0.0_f64, 0.0_f64);
    let (goal, limits) = (Reference::at_rest(wanted), TurnLimits { rate_rad_s: 0.03, acceleration_rad_s2: 0.005 });
    for _ in 0..10_000 {
        let next = reference.step_towards(&goal, &limits, 0.01);
        let torques = controller.torques(&body, &state, &reference.leading_to(&next));
        most_off = most_off.max(angle(state.attitude, reference.attitude));
        fastest = fastest.max(norm(state.rates_rad_s));
        reference = next;
        step(&mut state, &body, torques, [0.0; 3], &Environment::default(), 0.01);
    }
    assert!(most_off < 2e-5 && fastest < 0.0301, "{most_off} rad, {fastest} rad/s");
    assert!(angle(state.attitude, wanted) < 1e-6, "{}", angle(state.attitude, wanted));
    assert!(norm(state.rates_rad_s) < 1e-6);
}

#[test]
fn a_reference_that_accelerates_is_followed() {
    let (body, controller) = (Body::default(), Controller::default());
    let mut state = State { wheels_n_m_s: [0.003, -0.002, 0.001], ..State::at_rest(NONE) };
    let axis = unit([1.0, 1.0, -0.3]).unwrap();
    let mut most = 0.0_f64;
    for i in 0..6000 {
        let time = f64::from(i) * 0.01;
        let (rate, faster) = (0.03 * libm::sin(0.1 * time), 0.003 * libm::cos(0.1 * time));
        let turned = from_axis_angle(axis, 0.3 * (1.0 - libm::cos(0.1 * time)));
        let (rates_rad_s, acceleration_rad_s2) = (scale(axis, rate), scale(axis, faster));
        let wanted = Reference { attitude: turned, rates_rad_s, acceleration_rad_s2 };
        most = most.max(angle(state.attitude, turned));
        let torques = controller.torques(&body, &state, &wanted);
        step(&mut state, &body, torques, [0.0; 3], &Environment::default(), 0.01);
    }
    assert!(most < 1e-4, "{most}");
}

#[test]
fn a_dipole_takes_momentum_normal_to_the_field() {
    let (body, wheels, field) = (Body::default(), [0.004, 0.001, -0.002], [1e-5, 3e-5, -2e-5]);
    let torque = cross(desaturation(&body, wheels, field, 1e-3), field);
    let normal = sub(wheels, scale(field, dot(wheels, field) / dot(field, field)));
    assert!(norm(add(torque, scale(normal, 1e-3))) < 1e-15);
    assert_eq!(desaturation(&body, wheels, [0.0; 3], 1e-3), [0.0; 3]);
}

#[test]
fn torquers_empty_the_wheels_in_an_orbit() {
    let (body, controller) = (Body::default(), Controller::default());
    let orbit = Orbit::new(&elements()).unwrap();
    let mut state = State { wheels_n_m_s: [0.008, -0.006, 0.007], ..State::at_rest(NONE) };
    for i in 0..57_000 {
        let seconds = f64::from(i) * 0.1;
        let position_m = orbit.state_at(seconds).position_m;
        let environment =
            Environment { field_t: magnetic_field(position_m, orbit.epoch().plus_seconds(seconds)), position_m };
        let field = rotate_back(state.attitude, environment.field_t);
        let dipole = desaturation(&body, state.wheels_n_m_s, field, 2e-3);
        let torques = controller.torques(&body, &state, &Reference::at_rest(NONE));
        step(&mut state, &body, torques, dipole, &environment, 0.1);
    }
    assert!(norm(state.wheels_n_m_s) < 0.002, "{:?}", state.wheels_n_m_s);
    assert!(angle(state.attitude, NONE) < 0.01);
}

#[test]
fn a_field_that_is_missing_asks_for_no_dipole() {
    assert_eq!(desaturation(&Body::default(), [0.01; 3], [0.0; 3], 1e-3), [0.0; 3]);
    assert_eq!(magnetic_field([0.0; 3], Date::of_day(2025, 1, 1)), [0.0; 3]);
}
