//! A region on the ground that a satellite passes over, as a flat map: where its payload looks, and what its attitude sensors see.
//!
//! The map is the tangent plane at the point below the satellite when it is overhead, east and north, in units of [`Pass::scale_m`]. Within 50
//! km of the point the plane is at most 0.2 km above the ground. Flight software and simulation use the same formulae; their inputs differ.

use serde::{Deserialize, Serialize};

use crate::attitude::quaternion::{Quaternion, rotate};
use crate::date::{Date, julian_date};
use crate::earth::{Tangent, eclipsed, magnetic_field, place_of, sun_direction, to_earth_fixed};
use crate::orbit::{Elements, Orbit, OrbitError};
use crate::pointing::look_at;
use crate::vector::{Matrix, Vector, add, apply, scale, transposed, unit};

/// Sine of the least angle below the horizontal at which a line of sight still ends on the map.
const LEAST_SINK: f64 = 0.05;

/// A pass over a region.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pass {
    /// The orbit.
    pub elements: Elements,
    /// Start of the run after the elements' epoch, seconds.
    pub start_s: f64,
    /// Time after that at which the satellite is overhead, seconds.
    pub overhead_s: f64,
    /// Metres on the ground for each unit of the map.
    pub scale_m: f64,
}

/// The region with its orbit.
#[derive(Clone, Debug)]
pub struct Region {
    orbit: Orbit,
    start_s: f64,
    tangent: Tangent,
    scale_m: f64,
}

/// Place of the satellite at one moment.
#[derive(Clone, Copy, Debug)]
pub struct Moment {
    date: Date,
    /// Position in TEME, metres.
    pub position_m: Vector,
    /// Position above the region, east, north and up, metres.
    pub local_m: Vector,
    from_teme: Matrix,
}

/// References of the attitude sensors, unit vectors in TEME.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sky {
    /// Direction of the sun; none in the Earth's shadow.
    pub sun: Option<Vector>,
    /// Direction of the Earth's centre.
    pub nadir: Vector,
    /// Magnetic field, tesla.
    pub field_t: Vector,
}

impl Region {
    /// # Errors
    /// The elements describe no orbit.
    pub fn new(pass: &Pass) -> Result<Region, OrbitError> {
        let orbit = Orbit::new(&pass.elements)?;
        let overhead = pass.start_s + pass.overhead_s;
        let below = to_earth_fixed(orbit.state_at(overhead).position_m, julian_date(orbit.epoch(), overhead));
        let tangent = Tangent::new(crate::earth::GeodeticPlace { height_m: 0.0, ..place_of(below) });
        Ok(Region { orbit, start_s: pass.start_s, tangent, scale_m: pass.scale_m })
    }

    /// The satellite a given number of seconds after the start of the run.
    pub fn moment_at(&self, run_s: f64) -> Moment {
        let seconds = self.start_s + run_s;
        let date = julian_date(self.orbit.epoch(), seconds);
        let position_m = self.orbit.state_at(seconds).position_m;
        let local_m = self.tangent.to_local(to_earth_fixed(position_m, date));
        Moment { date, position_m, local_m, from_teme: self.tangent.from_teme(date) }
    }

    /// What the attitude sensors see then.
    pub fn sky(&self, moment: &Moment) -> Sky {
        let sun = sun_direction(moment.date);
        let nadir = unit(scale(moment.position_m, -1.0)).unwrap_or([0.0, 0.0, -1.0]);
        let field_t = magnetic_field(moment.position_m, moment.date);
        Sky { sun: (!eclipsed(moment.position_m, sun)).then_some(sun), nadir, field_t }
    }

    /// Place on the map at which the payload looks in this attitude (body to TEME), and the heading of the body's x axis there, radians
    /// counter-clockwise from east; none where it looks past the region.
    pub fn aim(&self, moment: &Moment, attitude: Quaternion) -> Option<([f64; 2], f64)> {
        let local = |axis: Vector| apply(&moment.from_teme, rotate(attitude, axis));
        let (sight, ahead) = (local([0.0, 0.0, 1.0]), local([1.0, 0.0, 0.0]));
        if sight[2] > -LEAST_SINK {
            return None;
        }
        let point = add(moment.local_m, scale(sight, -moment.local_m[2] / sight[2]));
        Some(([point[0] / self.scale_m, point[1] / self.scale_m], libm::atan2(ahead[1], ahead[0])))
    }

    /// The attitude that looks at this place of the map with the body's x axis towards `heading`.
    pub fn looking_at(&self, moment: &Moment, [east, north]: [f64; 2], heading: f64) -> Quaternion {
        let back = transposed(&moment.from_teme);
        let target = [east * self.scale_m, north * self.scale_m, 0.0];
        let sight = crate::vector::sub(target, moment.local_m);
        let (sin, cos) = libm::sincos(heading);
        look_at([0.0; 3], apply(&back, sight), apply(&back, [cos, sin, 0.0]))
    }

    /// Rotation from TEME to east, north and up.
    pub fn to_local(&self, moment: &Moment, teme: Vector) -> Vector {
        apply(&moment.from_teme, teme)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn region() -> Region {
        let elements = Elements::new(
            "1 99999U 25001A   25172.50000000  .00002000  00000-0  10000-3 0  9991",
            "2 99999  97.5000 250.0000 0010000  90.0000 270.0000 15.18000000    10",
        );
        Region::new(&Pass { elements, start_s: 600.0, overhead_s: 5.0, scale_m: 1000.0 }).unwrap()
    }

    #[test]
    fn satellite_is_overhead_when_the_pass_says() {
        let local = region().moment_at(5.0).local_m;
        assert!(local[0].abs() < 1.0 && local[1].abs() < 1.0, "{local:?}");
        assert!((300_000.0..800_000.0).contains(&local[2]), "{local:?}");
    }

    #[test]
    fn an_attitude_looks_where_it_is_made_to_look() {
        let region = region();
        for (run_s, place, heading) in [(0.0, [0.0, 0.0], 0.0), (8.0, [-15.0, -5.0], 1.2), (20.0, [40.0, 38.0], -2.9)] {
            let moment = region.moment_at(run_s);
            let (position, ahead) = region.aim(&moment, region.looking_at(&moment, place, heading)).unwrap();
            assert!((position[0] - place[0]).abs() < 1e-6 && (position[1] - place[1]).abs() < 1e-6, "{position:?}");
            // The x axis leans with the line of sight, so its heading is the wanted one but for that.
            assert!((ahead - heading).abs() < 0.15, "{ahead} {heading}");
        }
    }

    #[test]
    fn a_payload_that_looks_up_aims_at_no_place() {
        let region = region();
        let moment = region.moment_at(0.0);
        let attitude = look_at([0.0; 3], moment.position_m, [0.0, 0.0, 1.0]);
        assert_eq!(region.aim(&moment, attitude), None);
    }
}
