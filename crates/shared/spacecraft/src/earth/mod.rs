//! Earth: its turn, its surface, the sun above it and the magnetic field around it.
//!
//! The Earth-fixed frame turns by Greenwich mean sidereal time alone. Polar motion (10 m on the ground) and the
//! difference of UT1 and UTC (below 400 m) are left out: an element set is off by more.

mod field;
mod passes;
mod sun;
mod surface;

pub use field::magnetic_field;
pub use passes::{Look, MOST_PASSES, Window, look, passes};
pub use sun::{eclipsed, sun_direction};
pub use surface::{GeodeticPlace, Tangent, place_of};

pub use crate::date::{Date, gmst, julian_date};
use crate::orbit::OrbitState;
use crate::vector::{Matrix, Vector, apply, cross, sub, transposed};

/// Equatorial radius, metres (WGS 84, NIMA TR8350.2).
pub const RADIUS_M: f64 = 6_378_137.0;

/// Gravitational parameter, m³/s² (WGS 84).
pub const GRAVITY_M3_S2: f64 = 3.986_004_418e14;

/// Turn of the Earth against the stars, rad/s (IERS Conventions 2010, table 1.2).
pub const TURN_RAD_S: f64 = 7.292_115e-5;

/// The rotation from TEME to the Earth-fixed frame.
pub fn turn(date: Date) -> Matrix {
    let (sin, cos) = libm::sincos(gmst(date));
    [[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]]
}

/// A vector of TEME in the Earth-fixed frame.
pub fn to_earth_fixed(teme: Vector, date: Date) -> Vector {
    apply(&turn(date), teme)
}

/// A vector of the Earth-fixed frame in TEME.
pub fn to_teme(earth_fixed: Vector, date: Date) -> Vector {
    apply(&transposed(&turn(date)), earth_fixed)
}

/// Position in the Earth-fixed frame, metres, and velocity against the ground that turns with it, m/s.
pub fn seen_from_ground(state: &OrbitState, date: Date) -> OrbitState {
    let turned = turn(date);
    let position_m = apply(&turned, state.position_m);
    let carried = cross([0.0, 0.0, TURN_RAD_S], position_m);
    OrbitState { position_m, velocity_m_s: sub(apply(&turned, state.velocity_m_s), carried) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::orbit::Orbit;
    use crate::orbit::tests::elements;
    use crate::vector::norm;

    #[test]
    fn there_and_back_is_the_same_vector() {
        let date = Date::of_day(2025, 6, 21).plus_seconds(1234.5);
        let vector = [7e6, -1e6, 3e6];
        assert!(norm(sub(to_teme(to_earth_fixed(vector, date), date), vector)) < 1e-8);
    }

    #[test]
    fn ground_velocity_is_the_change_of_ground_position() {
        let orbit = Orbit::new(&elements()).unwrap();
        let look_angles =
            |seconds: f64| seen_from_ground(&orbit.state_at(seconds), orbit.epoch().plus_seconds(seconds));
        let way = sub(look_angles(500.05).position_m, look_angles(499.95).position_m);
        assert!(norm(sub(way.map(|part| part / 0.1), look_angles(500.0).velocity_m_s)) < 1e-3);
    }
}
