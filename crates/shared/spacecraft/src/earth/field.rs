//! Magnetic field: a dipole, tilted as the Earth's is.
//!
//! Its three numbers are the first degree of IGRF-14 at 2025.0 with their yearly change (IAGA Division V, *IGRF-14*,
//! 2024, doi:10.5281/zenodo.14012302). Higher degrees are left out: at 500 km they are a quarter of the field in the
//! mean, 9° of its direction, and over the South Atlantic up to three quarters and 35° (`tools/referee/spacecraft/field.py`).

use super::{to_earth_fixed, to_teme};
use crate::date::Date;
use crate::vector::{Vector, add, dot, norm, scale, sub};

/// Coefficients g11, h11 and g10 at 2025.0, nT: the dipole along the Earth-fixed axes.
const DIPOLE_NT: Vector = [-1410.3, 4545.5, -29_350.0];

/// Their change, nT a year.
const CHANGE_NT: Vector = [10.0, -21.5, 12.6];

/// Reference radius of the model, metres.
const REFERENCE_M: f64 = 6_371_200.0;

/// Julian date of 2025.0, days.
const EPOCH: f64 = 2_460_676.5;

/// Magnetic field at a position from the Earth's centre, metres; both in TEME, the field in tesla. Zero at the centre.
pub fn magnetic_field(position_m: Vector, date: Date) -> Vector {
    let position = to_earth_fixed(position_m, date);
    let distance = norm(position);
    if distance.is_nan() || distance < 1.0 {
        return [0.0; 3];
    }
    let years = (date.julian() - EPOCH) / 365.25;
    let dipole = add(DIPOLE_NT, scale(CHANGE_NT, years));
    let up = scale(position, 1.0 / distance);
    let ratio = REFERENCE_M / distance;
    let field = sub(scale(up, 3.0 * dot(dipole, up)), dipole);
    to_teme(scale(field, 1e-9 * ratio * ratio * ratio), date)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field_at(earth_fixed_m: Vector) -> Vector {
        let date = Date { midnight: EPOCH, second: 0.0 };
        to_earth_fixed(magnetic_field(to_teme(earth_fixed_m, date), date), date)
    }

    #[test]
    fn the_field_points_down_at_the_north_pole() {
        let [_, _, up] = field_at([0.0, 0.0, REFERENCE_M]);
        assert!((up + 5.87e-5).abs() < 1e-10, "{up}");
    }

    #[test]
    fn the_field_points_north_at_the_equator() {
        let [_, _, north] = field_at([REFERENCE_M, 0.0, 0.0]);
        assert!((north - 2.935e-5).abs() < 1e-10, "{north}");
    }

    #[test]
    fn the_field_falls_with_the_cube_of_distance() {
        let ratio = norm(field_at([0.0, REFERENCE_M, 0.0])) / norm(field_at([0.0, 2.0 * REFERENCE_M, 0.0]));
        assert!((ratio - 8.0).abs() < 1e-12);
    }

    #[test]
    fn the_centre_has_no_field() {
        assert_eq!(field_at([0.0; 3]), [0.0; 3]);
    }
}
