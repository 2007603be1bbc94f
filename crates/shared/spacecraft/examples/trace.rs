//! Trace: the crate's values for one orbit, its passes, the sun, the magnetic field and four slews, as JSON for
//! `tools/referee/spacecraft/*.py`.
//!
//! `cargo run --release -p spacecraft --example trace -- orbit|sun|field|slew`

use spacecraft::attitude::quaternion::{NONE, angle, from_axis_angle};
use spacecraft::attitude::{Body, Environment, State, step};
use spacecraft::date::Date;
use spacecraft::earth::{
    GeodeticPlace, Tangent, eclipsed, look, magnetic_field, passes, seen_from_ground, sun_direction, to_earth_fixed,
    to_teme,
};
use spacecraft::orbit::{Elements, Orbit};
use spacecraft::pointing::{Controller, Reference, TurnLimits};

use serde_json::{Value, json};

const LINE_1: &str = "1 99999U 25001A   25172.50000000  .00002000  00000-0  10000-3 0  9991";
const LINE_2: &str = "2 99999  97.5000 250.0000 0010000  90.0000 270.0000 15.18000000    10";

fn main() {
    let requested = std::env::args().nth(1).unwrap_or_default();
    let value = match requested.as_str() {
        "orbit" => orbit(),
        "sun" => sun(),
        "field" => field(),
        "slew" => slews(),
        _ => json!({ "expected": ["orbit", "sun", "field", "slew"] }),
    };
    println!("{value}");
}

fn orbit() -> Value {
    let orbit = Orbit::new(&Elements::new(LINE_1, LINE_2)).expect("invariant: the elements above are an orbit");
    let station = Tangent::new(GeodeticPlace::of_degrees(52.5, 13.4, 40.0));
    let states: Vec<Value> = (0..=1440)
        .map(|minute| {
            let seconds = f64::from(minute) * 60.0 + 3.7;
            let (state, date) = (orbit.state_at(seconds), orbit.epoch().plus_seconds(seconds));
            let seen = seen_from_ground(&state, date);
            let look = look(&station, &state, date);
            json!({ "s": seconds, "r": state.position_m, "v": state.velocity_m_s, "fixed": seen.position_m,
                    "elevation": look.elevation_rad, "range": look.range_m, "range_rate": look.range_rate_m_s,
                    "dark": eclipsed(state.position_m, sun_direction(date)) })
        })
        .collect();
    let found = passes(&station, &orbit, 0.0, 86_400.0, 5.0_f64.to_radians());
    let found: Vec<Value> = found.iter().map(|w| json!([w.rise, w.set, w.highest_elevation])).collect();
    json!({ "line_1": LINE_1, "line_2": LINE_2, "latitude": 52.5, "longitude": 13.4, "height": 40.0,
            "jd": orbit.epoch().julian(), "states": states, "passes": found })
}

fn sun() -> Value {
    let first = Date::of_day(2020, 1, 1);
    let directions = (0..3650).map(|day| {
        let date = first.plus_seconds(f64::from(day) * 86_400.0 + 4321.0);
        json!({ "jd": date.julian(), "sun": sun_direction(date) })
    });
    directions.collect()
}

/// At 500 km height, on 2025-06-21.
fn field() -> Value {
    let date = Date::of_day(2025, 6, 21);
    let mut fields = Vec::new();
    for latitude in (-85..=85).step_by(10) {
        for longitude in (0..360).step_by(15) {
            let (sin_lat, cos_lat) = libm::sincos(f64::from(latitude).to_radians());
            let (sin_lon, cos_lon) = libm::sincos(f64::from(longitude).to_radians());
            let place = [cos_lat * cos_lon, cos_lat * sin_lon, sin_lat].map(|part| part * 6_871_200.0);
            let field = to_earth_fixed(magnetic_field(to_teme(place, date), date), date);
            fields.push(json!({ "latitude": latitude, "longitude": longitude, "field": field }));
        }
    }
    json!(fields)
}

/// Through 77° at 10 Hz from this state, in these surroundings with this dipole: by feedback alone, or led within
/// limits.
fn slew(mut state: State, limits: Option<TurnLimits>, environment: &Environment, dipole: [f64; 3]) -> Value {
    let (body, controller) = (Body::default(), Controller::default());
    let goal = Reference::at_rest(from_axis_angle([1.0, -0.5, 2.0], 77.0_f64.to_radians()));
    let (start, mut reference) = (state, Reference::at_rest(NONE));
    let mut steps = Vec::new();
    for i in 0..1200 {
        let next = limits.map_or(goal, |limits| reference.step_towards(&goal, &limits, 0.1));
        let wanted = if limits.is_some() { reference.leading_to(&next) } else { goal };
        let torques = controller.torques(&body, &state, &wanted);
        reference = next;
        step(&mut state, &body, torques, dipole, environment, 0.1);
        steps.push(
            json!({ "t": f64::from(i + 1) * 0.1, "torques": torques, "q": state.attitude, "w": state.rates_rad_s,
                           "h": state.wheels_n_m_s, "left": angle(state.attitude, goal.attitude) }),
        );
    }
    let wheel = body.wheels[0];
    json!({ "inertia": body.inertia_kg_m2, "wheel": wheel.inertia_kg_m2, "max_torque": wheel.max_torque_n_m,
            "max_momentum": wheel.max_momentum_n_m_s, "w": start.rates_rad_s, "h": start.wheels_n_m_s,
            "field": environment.field_t, "position": environment.position_m, "dipole": dipole, "steps": steps })
}

/// Turns from rest by feedback alone; from rest within limits; out of a tumble with loaded wheels, where gyroscopic
/// torques count; the same with gravity gradient and torquers.
fn slews() -> Value {
    let (rest, empty_environment) = (State::at_rest(NONE), Environment::default());
    let limits = Some(TurnLimits { rate_rad_s: 0.03, acceleration_rad_s2: 0.005 });
    let loaded = State { rates_rad_s: [0.03, -0.02, 0.025], wheels_n_m_s: [0.003, -0.004, 0.002], ..rest };
    let environment = Environment { field_t: [1.1e-5, -2.3e-5, 3.1e-5], position_m: [4.2e6, 3.9e6, -3.8e6] };
    json!({ "direct": slew(rest, None, &empty_environment, [0.0; 3]), "led": slew(rest, limits, &empty_environment, [0.0; 3]),
            "loaded": slew(loaded, None, &empty_environment, [0.0; 3]), "outside": slew(loaded, None, &environment, [0.2, -0.1, 0.15]) })
}
