//! Dynamics: Euler's equation for a body with wheels, in steps of the classical Runge-Kutta method.
//!
//! With momentum `H = I w + h`, where `I` has the wheels locked and `h` is theirs against the body, `dH/dt + w × H` is
//! the torque from outside, and a wheel's motor changes `h` and its share of `I w` together (Markley and Crassidis,
//! *Fundamentals of Spacecraft Attitude Determination and Control*, 2014, 3.3; the same equations as Basilisk's
//! `reactionWheelStateEffector` with balanced wheels). From outside come the gravity gradient (ibid., 3.3.6.1) and the
//! torquers. Drag, sunlight and the body's own magnetism are left out: at 500 km they are below a micronewton-metre on
//! a 6U cubesat. Friction and imbalance of the wheels are left out.

use super::quaternion::{Quaternion, normalized, product, rotate, rotate_back};
use super::{Body, State};
use crate::earth::GRAVITY_M3_S2;
use crate::vector::{Vector, add, cross, norm, scale, sub, times};

/// Longest step of the integration, seconds. A longer one is divided.
pub const MOST_STEP_S: f64 = 0.1;

/// Most parts of a step; their length then exceeds [`MOST_STEP_S`].
const MOST_PARTS: f64 = 1000.0;

/// Surroundings that act on the body, constant over a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Environment {
    /// Magnetic field, TEME, tesla.
    pub field_t: Vector,
    /// Position from the Earth's centre, TEME, metres; zero: no gravity gradient.
    pub position_m: Vector,
}

/// Turns the body for `dt` seconds under these commands, held over the step: torques on the body by the wheels, body
/// axes, N m, and magnetic dipole of the torquers, body axes, A m². Both are cut to what wheels and torquers can do.
pub fn step(
    state: &mut State,
    body: &Body,
    torques_n_m: Vector,
    dipole_a_m2: Vector,
    environment: &Environment,
    dt: f64,
) {
    if dt.is_nan() || dt <= 0.0 {
        return;
    }
    let parts = (dt / MOST_STEP_S).ceil().clamp(1.0, MOST_PARTS);
    let dipole = clamped(dipole_a_m2, body.torquers_a_m2);
    for _ in 0..parts as u32 {
        let torques = able(state, body, torques_n_m, dt / parts);
        runge_kutta(state, dt / parts, |at| change(at, body, torques, dipole, environment));
        state.attitude = normalized(state.attitude);
    }
}

/// Angular momentum of body and wheels, TEME, N m s.
pub fn momentum(state: &State, body: &Body) -> Vector {
    rotate(state.attitude, add(times(body.inertia_kg_m2, state.rates_rad_s), state.wheels_n_m_s))
}

/// Each component clamped to its limit; zero in place of NaN.
fn clamped(requested: Vector, limits: Vector) -> Vector {
    let mut able = [0.0; 3];
    for ((able, asked), limit) in able.iter_mut().zip(requested).zip(limits) {
        *able = if asked.is_nan() { 0.0 } else { asked.max(-limit).min(limit) };
    }
    able
}

/// Torque that each wheel can put on the body for `dt` seconds: within its torque, and not beyond its momentum.
fn able(state: &State, body: &Body, requested: Vector, dt: f64) -> Vector {
    let most = body.wheels.map(|wheel| wheel.max_torque_n_m);
    let mut able = clamped(requested, most);
    for ((torque, wheel), momentum) in able.iter_mut().zip(&body.wheels).zip(state.wheels_n_m_s) {
        // The wheel takes up the opposite of what it puts on the body.
        let (slower, faster) = (momentum - wheel.max_momentum_n_m_s, momentum + wheel.max_momentum_n_m_s);
        *torque = torque.max(slower / dt).min(faster / dt).clamp(-wheel.max_torque_n_m, wheel.max_torque_n_m);
    }
    able
}

/// Derivatives of the attitude, of the rates and of the wheels' momentum.
type Change = (Quaternion, Vector, Vector);

fn change(state: &State, body: &Body, torques: Vector, dipole: Vector, environment: &Environment) -> Change {
    let State { attitude, rates_rad_s: rates, wheels_n_m_s: wheels } = *state;
    let [x, y, z] = scale(rates, 0.5);
    let turning = product(attitude, [0.0, x, y, z]);
    let locked = times(body.inertia_kg_m2, rates);
    let magnetic = cross(dipole, rotate_back(attitude, environment.field_t));
    let outside = add(magnetic, gravity_gradient(attitude, body.inertia_kg_m2, environment.position_m));
    let [t_x, t_y, t_z] = sub(add(outside, torques), cross(rates, add(locked, wheels)));
    let [i_x, i_y, i_z] = body.inertia_kg_m2;
    let [j_x, j_y, j_z] = body.wheels.map(|wheel| wheel.inertia_kg_m2);
    let faster = [t_x / (i_x - j_x), t_y / (i_y - j_y), t_z / (i_z - j_z)];
    (turning, faster, sub(scale(torques, -1.0), times([j_x, j_y, j_z], faster)))
}

/// Torque by which gravity turns the axis of least inertia towards the Earth, body axes, N m.
fn gravity_gradient(attitude: Quaternion, inertia: Vector, position_m: Vector) -> Vector {
    let distance = norm(position_m);
    if distance.is_nan() || distance < 1.0 {
        return [0.0; 3];
    }
    let down = scale(rotate_back(attitude, position_m), 1.0 / distance);
    scale(cross(down, times(inertia, down)), 3.0 * GRAVITY_M3_S2 / (distance * distance * distance))
}

/// One step of the classical fourth-order method.
fn runge_kutta(state: &mut State, dt: f64, change: impl Fn(&State) -> Change) {
    let start = *state;
    let a = change(&start);
    let b = change(&moved(&start, &a, 0.5 * dt));
    let c = change(&moved(&start, &b, 0.5 * dt));
    let d = change(&moved(&start, &c, dt));
    for (change, weight) in [(a, 1.0), (b, 2.0), (c, 2.0), (d, 1.0)] {
        *state = moved(state, &change, dt * weight / 6.0);
    }
}

fn moved(state: &State, (turning, faster, wheels): &Change, dt: f64) -> State {
    let mut attitude = state.attitude;
    for (part, rate) in attitude.iter_mut().zip(turning) {
        *part += rate * dt;
    }
    State {
        attitude,
        rates_rad_s: add(state.rates_rad_s, scale(*faster, dt)),
        wheels_n_m_s: add(state.wheels_n_m_s, scale(*wheels, dt)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attitude::quaternion::NONE;
    use crate::vector::dot;

    const NOTHING: Environment = Environment { field_t: [0.0; 3], position_m: [0.0; 3] };

    fn tumbling() -> State {
        State { attitude: NONE, rates_rad_s: [0.05, -0.04, 0.03], wheels_n_m_s: [0.004, -0.002, 0.006] }
    }

    #[test]
    fn momentum_stays_without_torque_from_outside() {
        let (mut state, body) = (tumbling(), Body::default());
        let before = momentum(&state, &body);
        for i in 0..100_000 {
            let time = f64::from(i) * 0.01;
            let requested =
                [0.002 * libm::sin(0.3 * time), 0.001 * libm::cos(0.5 * time), -0.001 * libm::sin(0.2 * time)];
            step(&mut state, &body, requested, [0.0; 3], &NOTHING, 0.01);
        }
        let lost = norm(sub(momentum(&state, &body), before)) / norm(before);
        assert!(lost < 1e-9, "{lost}");
    }

    #[test]
    fn energy_stays_without_torque() {
        let (mut state, body) = (State { wheels_n_m_s: [0.0; 3], ..tumbling() }, Body::default());
        let wheels = body.wheels.map(|wheel| wheel.inertia_kg_m2);
        // An undriven wheel keeps its rate against the stars: the inertia that turns is the body's without the wheel's.
        let energy = |s: &State| dot(s.rates_rad_s, times(sub(body.inertia_kg_m2, wheels), s.rates_rad_s));
        let before = energy(&state);
        for _ in 0..10_000 {
            step(&mut state, &body, [0.0; 3], [0.0; 3], &NOTHING, 0.1);
        }
        // The exchange with the wheels is less than a thousandth of the energy.
        assert!((energy(&state) / before - 1.0).abs() < 1e-3);
    }

    #[test]
    fn a_wheel_gives_its_torque_and_no_more() {
        let (mut state, body) = (State::at_rest(NONE), Body::default());
        step(&mut state, &body, [1.0, 0.0, 0.0], [0.0; 3], &NOTHING, 0.1);
        let exact = 0.004 * 0.1 / (0.06 - Body::default().wheels[0].inertia_kg_m2);
        assert!((state.rates_rad_s[0] - exact).abs() < 1e-15);
    }

    #[test]
    fn a_wheel_stops_at_its_momentum() {
        let (mut state, body) = (State::at_rest(NONE), Body::default());
        for _ in 0..1000 {
            step(&mut state, &body, [0.0, -0.004, 0.0], [0.0; 3], &NOTHING, 0.01);
        }
        assert!((state.wheels_n_m_s[1] - 0.015).abs() < 1e-5, "{:?}", state.wheels_n_m_s);
        assert!((state.rates_rad_s[1] + 0.015 / 0.10).abs() < 1e-3);
    }

    /// A wheel at its greatest torque turns the body at rest to 0.17 rad/s about its axis; the seconds are counted.
    #[test]
    fn a_wheel_that_anybody_commands_makes_a_tumble_about_the_axis_of_least_inertia() {
        let tumbles = |axis: usize| {
            let (mut state, mut torques) = (State::at_rest(NONE), [0.0; 3]);
            torques[axis] = 0.004;
            (1..1_000).find(|_| {
                step(&mut state, &Body::default(), torques, [0.0; 3], &NOTHING, 0.01);
                state.rates_rad_s[axis] >= 0.17
            })
        };
        assert_eq!(tumbles(0), Some(255), "hundredths of a second");
        assert_eq!([tumbles(1), tumbles(2)], [None; 2], "the wheel's momentum is used up before");
    }

    #[test]
    fn a_dipole_turns_towards_the_field() {
        let mut state = State::at_rest(NONE);
        let environment = Environment { field_t: [0.0, 4e-5, 0.0], position_m: [0.0; 3] };
        step(&mut state, &Body::default(), [0.0; 3], [9.0, 0.0, 0.0], &environment, 0.1);
        // Cut to 0.3 A m²: 12 µN m about z.
        assert!((state.rates_rad_s[2] - 0.3 * 4e-5 * 0.1 / 0.13).abs() < 1e-8);
    }

    #[test]
    fn gravity_turns_the_axis_of_least_inertia_down() {
        let mut state = State::at_rest(NONE);
        // The x axis, of least inertia, points 45° off the vertical.
        let environment = Environment { field_t: [0.0; 3], position_m: scale([1.0, 1.0, 0.0], 5e6) };
        step(&mut state, &Body::default(), [0.0; 3], [0.0; 3], &environment, 1.0);
        assert!(state.rates_rad_s[2] > 0.0, "{:?}", state.rates_rad_s);
    }

    #[test]
    fn commands_of_no_number_do_nothing() {
        let mut state = tumbling();
        step(&mut state, &Body::default(), [f64::NAN; 3], [f64::NAN; 3], &NOTHING, 0.1);
        assert!(state.rates_rad_s.iter().all(|rate| rate.is_finite()));
        let before = state;
        step(&mut state, &Body::default(), [0.001; 3], [0.0; 3], &NOTHING, f64::NAN);
        assert_eq!(state, before);
    }
}
