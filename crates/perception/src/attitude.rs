//! Attitude sensors against each other, in place of images: sightings of catalogued places in view of a spacecraft's
//! payload.
//!
//! The star tracker gives the attitude. From time, orbit and attitude follow the directions in which sun, horizon and
//! magnetic field have to be seen; a sensor that sees its object there supports it, one that sees it far from there
//! contradicts it. So a place is sighted where independent sensors agree on the line of sight. Estimation over time is
//! the tracker's, as for objects.

use libm::acos;
use serde::{Deserialize, Serialize};
use spacecraft::attitude::quaternion::rotate_back;
use spacecraft::orbit::OrbitError;
use spacecraft::region::{Pass, Region};
use spacecraft::vector::{dot, unit};
use wire::bearing::Bearings;
use wire::sensor::{Class, Modalities, Modality, Navigation};
use wire::time::Instant;

use crate::corroborate::Sighting;
use crate::pose::Placement;

/// Angle from its computed direction within which a reading supports the attitude, rad: sun, horizon, field. Seven
/// deviations of a reading on each axis, of which that of the field is the error of its model; a dipole here and there.
const SUPPORTS: [f64; 3] = [0.015, 0.015, 0.12];
/// Angle from which on it contradicts it, as a multiple of that.
const CONTRADICTS: f64 = 2.0;
/// Score of a sighting, permille.
const SCORE: u16 = 930;
/// Deviation of a sighted place, metres of the map.
const SIGMA_M: f64 = 0.1;

/// Pass, clock and catalogue of a spacecraft.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SkyConfig {
    /// Orbit and region of the pass.
    pub pass: Pass,
    /// The receiver's time at the start of the run, microseconds of its count.
    pub started_us: u64,
    /// Places that the payload may be pointed at.
    pub catalogue: Vec<Catalogued>,
    /// Distance from the line of sight within which a place is in view, metres of the map.
    pub view_m: f64,
}

/// A catalogued place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Catalogued {
    /// Class of the place.
    pub class: Class,
    /// East and north, metres of the map.
    pub place_m: [f64; 2],
}

/// The perception stage of a spacecraft.
#[derive(Clone, Debug)]
pub struct Watch {
    region: Region,
    config: SkyConfig,
    /// Time of the run at the newest fix, seconds, and its stamp.
    clock: Option<(f64, Instant)>,
}

impl Watch {
    /// # Errors
    /// The elements describe no orbit.
    pub fn new(config: &SkyConfig) -> Result<Self, OrbitError> {
        Ok(Watch { region: Region::new(&config.pass)?, config: config.clone(), clock: None })
    }

    /// Takes the time that a receiver gives with a fix.
    pub fn note(&mut self, reading: &Navigation) {
        if let Some(fix) = reading.fix {
            let run_us = fix.time.0 as i64 - self.config.started_us as i64;
            self.clock = Some((run_us as f64 / 1e6, reading.stamp));
        }
    }

    /// The places in view by the star tracker's attitude, with the sensors that support it and those that contradict
    /// it; in the body frame of `ego`. Objections of `unheard` sensors count as support.
    pub fn judge(&self, bearings: &Bearings, ego: Option<&Placement>, unheard: Modalities) -> Vec<Sighting> {
        let (mut supported, mut vetoed) = (Modalities::default(), Modalities::default());
        let (Some(stars), Some((run_s, stamp)), Some(ego)) = (bearings.stars, self.clock, ego) else {
            return Vec::new();
        };
        let elapsed = bearings.stamp.since(stamp).0 as f64 - stamp.since(bearings.stamp).0 as f64;
        let moment = self.region.moment_at(run_s + elapsed / 1e6);
        let (sky, attitude) = (self.region.sky(&moment), stars.parts());
        supported = supported.with_modality(Modality::Rgb);
        let expected = [
            (Modality::Depth, sky.sun, bearings.sun),
            (Modality::Thermal, Some(sky.nadir), bearings.horizon),
            (Modality::Lidar, unit(sky.field_t), bearings.field),
        ];
        for ((modality, reference, reading), limit) in expected.into_iter().zip(SUPPORTS) {
            let Some(seen) = reading.and_then(|direction| direction.unit()) else { continue };
            let off = reference.map_or(f64::MAX, |reference| angle_between(rotate_back(attitude, reference), seen));
            if off <= limit || off > CONTRADICTS * limit && unheard.contains(modality) {
                supported = supported.with_modality(modality);
            } else if off > CONTRADICTS * limit {
                vetoed = vetoed.with_modality(modality);
            }
        }
        let Some((aim, _)) = self.region.aim(&moment, attitude) else { return Vec::new() };
        let complete = bearings.horizon.is_some();
        let sighting = |site: &Catalogued| {
            let [east, north] = [site.place_m[0] - aim[0], site.place_m[1] - aim[1]];
            let place = ego.turned_back([east, north]);
            let near = east * east + north * north <= self.config.view_m * self.config.view_m;
            (near && supported.count() >= 3).then_some(Sighting {
                class: site.class,
                score: SCORE,
                place,
                sigma: SIGMA_M,
                supported,
                vetoed,
                absent: Modalities::default(),
                complete,
                bounds: None,
            })
        };
        self.config.catalogue.iter().filter_map(sighting).collect()
    }
}

/// Angle between two unit vectors, rad.
fn angle_between(a: [f64; 3], b: [f64; 3]) -> f64 {
    acos(dot(a, b).clamp(-1.0, 1.0))
}

#[cfg(test)]
mod tests {
    use spacecraft::attitude::quaternion::{from_axis_angle, product};
    use spacecraft::orbit::Elements;
    use wire::bearing::Direction;
    use wire::id::FrameId;
    use wire::motion::Attitude;
    use wire::sensor::{Fix, Pose, ProductMode, ReceiverTime};
    use wire::time::Span;

    use super::*;
    use crate::pose::Ego;

    const STARTED_US: u64 = 1_000_000_000;
    const NOW: Instant = Instant(2_000_000);

    fn watch() -> Watch {
        let elements = Elements::new(
            "1 99999U 25001A   25172.50000000  .00002000  00000-0  10000-3 0  9991",
            "2 99999  97.5000 250.0000 0010000  90.0000 270.0000 15.18000000    10",
        );
        let pass = Pass { elements, start_s: 1600.0, overhead_s: 5.0, scale_m: 1000.0 };
        let far = Catalogued { class: Class::Vehicle, place_m: [90.0, 0.0] };
        let catalogue = vec![Catalogued { class: Class::Vehicle, place_m: [8.0, -3.0] }, far];
        Watch::new(&SkyConfig { pass, started_us: STARTED_US, catalogue, view_m: 30.0 }).unwrap()
    }

    fn fix() -> Navigation {
        let pose = Pose { x_mm: 0, y_mm: 0, yaw_mrad: 0 };
        let time = ReceiverTime(STARTED_US + NOW.0);
        Navigation { stamp: NOW, fix: Some(Fix { pose, sigma_mm: 40, time }), odometry: None, spatial: None }
    }

    /// Readings of a body that looks at the map's centre, with the star tracker turned off it by this much, rad.
    fn seen(watch: &Watch, off: f64) -> Bearings {
        let moment = watch.region.moment_at(2.0);
        let attitude = watch.region.looking_at(&moment, [0.0, 0.0], 0.0);
        let sky = watch.region.sky(&moment);
        let down = |reference: [f64; 3]| Some(Direction::new(rotate_back(attitude, reference)));
        Bearings {
            frame: FrameId(1),
            stamp: NOW,
            mode: ProductMode::Live,
            stars: Some(Attitude::new(product(attitude, from_axis_angle([1.0, 0.0, 0.0], off)))),
            sun: down(sky.sun.unwrap()),
            horizon: down(sky.nadir),
            field: down(unit(sky.field_t).unwrap()),
        }
    }

    fn judged(watch: &mut Watch, bearings: &Bearings) -> Vec<Sighting> {
        let mut ego = Ego::default();
        ego.note(&fix());
        watch.note(&fix());
        watch.judge(bearings, ego.pose_at(NOW, Span::ms(300)).as_ref(), Modalities::default())
    }

    #[test]
    fn place_in_view_is_sighted_where_all_sensors_agree() {
        let mut watch = watch();
        let bearings = seen(&watch, 0.0);
        let [sighting] = judged(&mut watch, &bearings)[..] else { panic!("one place in view") };
        assert!((sighting.place[0] - 8.0).abs() < 0.01 && (sighting.place[1] + 3.0).abs() < 0.01, "{sighting:?}");
        assert_eq!((sighting.supported.count(), sighting.vetoed.count(), sighting.complete), (4, 0, true));
    }

    #[test]
    fn star_tracker_that_is_led_astray_is_contradicted() {
        let mut watch = watch();
        let bearings = seen(&watch, 0.035);
        // The place is in view still; sun and horizon no longer support it.
        assert_eq!(judged(&mut watch, &bearings), []);
        let bearings = seen(&watch, 0.014);
        assert!(judged(&mut watch, &bearings)[0].is_uncontradicted(), "within the limits of sun and horizon sensors");
    }

    #[test]
    fn one_sensor_that_is_led_astray_speaks_against_the_place() {
        let mut watch = watch();
        let honest = seen(&watch, 0.0);
        let other = Some(Direction::new([1.0, 0.0, 0.0]));
        let (sun, horizon, field) = (Modality::Depth, Modality::Thermal, Modality::Lidar);
        for (against, bearings) in [
            (sun, Bearings { sun: other, ..honest }),
            (horizon, Bearings { horizon: other, ..honest }),
            (field, Bearings { field: other, ..honest }),
        ] {
            let [sighting] = judged(&mut watch, &bearings)[..] else { panic!("{against:?}: one place in view") };
            assert!(!sighting.is_uncontradicted() && sighting.vetoed.contains(against), "{against:?}: {sighting:?}");
        }
    }

    #[test]
    fn blind_star_tracker_sights_no_place() {
        let mut watch = watch();
        let bearings = Bearings { stars: None, ..seen(&watch, 0.0) };
        assert!(judged(&mut watch, &bearings).is_empty());
    }

    #[test]
    fn hidden_sun_neither_supports_nor_contradicts() {
        let mut watch = watch();
        let bearings = Bearings { sun: Some(Direction::default()), ..seen(&watch, 0.0) };
        let [sighting] = judged(&mut watch, &bearings)[..] else { panic!("one place in view") };
        assert_eq!((sighting.supported.count(), sighting.vetoed.count()), (3, 0));
    }
}
