//! Sun: its direction, and the Earth's shadow.

use super::RADIUS_M;
use crate::date::Date;
use crate::vector::{Vector, dot, norm, scale, sub};

/// Direction from the Earth to the sun, TEME, unit length; good to 0.01° from 1950 to 2050 (*The Astronomical Almanac*,
/// low-precision formulas for the sun, section C). Its equinox is the mean one of the date, as TEME's is; nutation of
/// the equator (0.003°) is left out.
pub fn sun_direction(date: Date) -> Vector {
    let days = date.days_j2000();
    let longitude = 280.460 + 0.985_647_4 * days;
    let anomaly = (357.528 + 0.985_600_3 * days).rem_euclid(360.0).to_radians();
    let ecliptic = longitude + 1.915 * libm::sin(anomaly) + 0.020 * libm::sin(2.0 * anomaly);
    let (sin, cos) = libm::sincos(ecliptic.rem_euclid(360.0).to_radians());
    let (sin_tilt, cos_tilt) = libm::sincos((23.439 - 4.0e-7 * days).to_radians());
    [cos, cos_tilt * sin, sin_tilt * sin]
}

/// Whether a position, metres from the Earth's centre, lies in the Earth's shadow: a cylinder of the equatorial radius
/// away from the direction `sun` (Vallado, *Fundamentals of Astrodynamics*, 5.3). Penumbra, about 8 s of a low orbit,
/// is left out.
pub fn eclipsed(position_m: Vector, sun: Vector) -> bool {
    let along = dot(position_m, sun);
    along < 0.0 && norm(sub(position_m, scale(sun, along))) < RADIUS_M
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Meeus, *Astronomical Algorithms*, example 25.a: 1992-10-13 0h TD, right ascension 198.38083°, declination
    /// -7.78507°.
    #[test]
    fn the_sun_stands_where_the_textbook_has_it() {
        let [x, y, z] = sun_direction(Date::of_day(1992, 10, 13));
        assert!((libm::atan2(y, x).to_degrees().rem_euclid(360.0) - 198.380_83).abs() < 0.01);
        assert!((libm::asin(z).to_degrees() + 7.785_07).abs() < 0.01);
    }

    #[test]
    fn its_direction_has_unit_length() {
        for day in 0..1000 {
            let sun = sun_direction(Date::of_day(2025, 1, 1).plus_seconds(f64::from(day) * 86_400.0));
            assert!((norm(sun) - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn only_what_is_behind_the_earth_is_in_shadow() {
        let sun = [1.0, 0.0, 0.0];
        assert!(eclipsed([-7e6, 0.0, 0.0], sun));
        assert!(!eclipsed([7e6, 0.0, 0.0], sun));
        assert!(!eclipsed([-3e6, 6.4e6, 0.0], sun));
        assert!(eclipsed([-3e6, 6.3e6, 0.0], sun));
    }
}
