//! Surface: places on the WGS 84 ellipsoid and the level frame at one.

use serde::{Deserialize, Serialize};

use super::{RADIUS_M, turn};
use crate::date::Date;
use crate::vector::{Matrix, Vector, add, apply, product, sub, transposed};

/// Square of the first eccentricity of the ellipsoid (WGS 84: flattening 1/298.257223563).
const ECCENTRICITY_2: f64 = 6.694_379_990_141_317e-3;

/// Place by geodetic coordinates (WGS 84).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GeodeticPlace {
    /// Latitude, north positive, radians.
    pub latitude_rad: f64,
    /// Longitude, east positive, radians.
    pub longitude_rad: f64,
    /// Height above the ellipsoid, metres.
    pub height_m: f64,
}

impl GeodeticPlace {
    /// Place from degrees and metres.
    pub fn of_degrees(latitude: f64, longitude: f64, height_m: f64) -> Self {
        GeodeticPlace { latitude_rad: latitude.to_radians(), longitude_rad: longitude.to_radians(), height_m }
    }

    /// Position in the Earth-fixed frame, metres.
    pub fn position_m(&self) -> Vector {
        let (sin_lat, cos_lat) = libm::sincos(self.latitude_rad);
        let (sin_lon, cos_lon) = libm::sincos(self.longitude_rad);
        let radius = RADIUS_M / (1.0 - ECCENTRICITY_2 * sin_lat * sin_lat).sqrt();
        let flat = (radius + self.height_m) * cos_lat;
        [flat * cos_lon, flat * sin_lon, (radius * (1.0 - ECCENTRICITY_2) + self.height_m) * sin_lat]
    }
}

/// Place of an Earth-fixed position that is not within 100 km of the Earth's centre; exact to a millimetre up to
/// geostationary height (fixed-point iteration on the normal's foot: Astronomical Almanac, section K).
pub fn place_of(position_m: Vector) -> GeodeticPlace {
    let [x, y, z] = position_m;
    let flat = (x * x + y * y).sqrt();
    let mut lift = 0.0;
    // The normal of the ellipsoid meets the axis `lift` below the centre.
    for _ in 0..8 {
        let (up, radius) = (z + lift, RADIUS_M);
        let sin = up / (flat * flat + up * up).sqrt();
        lift = radius * ECCENTRICITY_2 * sin / (1.0 - ECCENTRICITY_2 * sin * sin).sqrt();
    }
    let up = z + lift;
    let latitude_rad = libm::atan2(up, flat);
    let sin = libm::sin(latitude_rad);
    let radius = RADIUS_M / (1.0 - ECCENTRICITY_2 * sin * sin).sqrt();
    GeodeticPlace { latitude_rad, longitude_rad: libm::atan2(y, x), height_m: (flat * flat + up * up).sqrt() - radius }
}

/// Level frame at a place: x east, y north, z up along the ellipsoid's normal, origin in the place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tangent {
    place: GeodeticPlace,
    origin_m: Vector,
    level: Matrix,
}

impl Tangent {
    /// At a place.
    pub fn new(place: GeodeticPlace) -> Self {
        let (sin_lat, cos_lat) = libm::sincos(place.latitude_rad);
        let (sin_lon, cos_lon) = libm::sincos(place.longitude_rad);
        let east = [-sin_lon, cos_lon, 0.0];
        let north = [-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat];
        let up = [cos_lat * cos_lon, cos_lat * sin_lon, sin_lat];
        Tangent { place, origin_m: place.position_m(), level: [east, north, up] }
    }

    /// The place.
    pub fn place(&self) -> GeodeticPlace {
        self.place
    }

    /// Origin in the Earth-fixed frame, metres.
    pub fn origin_m(&self) -> Vector {
        self.origin_m
    }

    /// East, north and up of an Earth-fixed position, metres.
    pub fn to_local(&self, earth_fixed_m: Vector) -> Vector {
        apply(&self.level, sub(earth_fixed_m, self.origin_m))
    }

    /// Earth-fixed position of an east, north and up, metres.
    pub fn to_earth_fixed(&self, local_m: Vector) -> Vector {
        add(apply(&transposed(&self.level), local_m), self.origin_m)
    }

    /// East, north and up of an Earth-fixed direction or velocity.
    pub fn turned(&self, earth_fixed: Vector) -> Vector {
        apply(&self.level, earth_fixed)
    }

    /// The rotation from TEME to this frame.
    pub fn from_teme(&self, date: Date) -> Matrix {
        product(&self.level, &turn(date))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::norm;

    #[test]
    fn a_position_has_the_place_it_is_of() {
        for latitude in [-90.0, -45.0, -0.1, 0.0, 30.0, 60.0, 89.9] {
            for height in [-100.0, 0.0, 5e5, 3.6e7] {
                let place = GeodeticPlace::of_degrees(latitude, 123.0, height);
                let found = place_of(place.position_m());
                assert!((found.latitude_rad - place.latitude_rad).abs() < 1e-10, "{latitude} {height}");
                assert!((found.height_m - height).abs() < 1e-3, "{latitude} {height}");
                assert!(norm(sub(found.position_m(), place.position_m())) < 1e-3);
            }
        }
    }

    /// Vallado, *Fundamentals of Astrodynamics*, example 3-3.
    #[test]
    fn a_place_is_that_of_the_textbook() {
        let place = place_of([6_524_834.0, 6_862_875.0, 6_448_296.0]);
        assert!((place.latitude_rad.to_degrees() - 34.352_496).abs() < 1e-5);
        assert!((place.longitude_rad.to_degrees() - 46.446_4).abs() < 1e-4);
        assert!((place.height_m - 5_085_220.0).abs() < 10.0);
    }

    #[test]
    fn up_in_the_level_frame_adds_height() {
        let tangent = Tangent::new(GeodeticPlace::of_degrees(52.0, 13.0, 40.0));
        let place = place_of(tangent.to_earth_fixed([0.0, 0.0, 1000.0]));
        assert!((place.height_m - 1040.0).abs() < 1e-3);
        let north = place_of(tangent.to_earth_fixed([0.0, 100.0, 0.0]));
        assert!(north.latitude_rad > place.latitude_rad);
        let back = tangent.to_local(tangent.to_earth_fixed([1.0, 2.0, 3.0]));
        assert!(norm(sub(back, [1.0, 2.0, 3.0])) < 1e-8);
    }
}
