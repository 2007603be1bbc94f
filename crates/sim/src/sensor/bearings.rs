//! Readings of attitude sensors: star tracker, sun sensors, horizon sensor, magnetometer.
//!
//! Each fails as the modality in whose place it stands. A false place of localisation turns the star tracker with it:
//! the place is computed from its attitude. A view that is covered by half or more gives no reading.

use ground_truth::Sensor;
use spacecraft::attitude::quaternion::{from_axis_angle, normalized, product, rotate_back};
use spacecraft::region::Sky;
use spacecraft::vector::{norm, unit};
use wire::bearing::{Bearings, Direction};
use wire::id::FrameId;
use wire::motion::Attitude;
use wire::sensor::ProductMode;
use wire::time::{Instant, Span};

use crate::fault::{Effect, Faults, imaging};
use crate::noise::{Noise, Stream};
use crate::past::Past;

/// Deviations on each axis, rad: a star tracker of 10 seconds of arc, sun sensors of 0.1°, a horizon sensor of 0.1°, a
/// magnetometer whose field model is right to 1°.
const DEVIATIONS: [f64; 4] = [5e-5, 2e-3, 2e-3, 1.7e-2];
/// Covered share from which on a sensor sees nothing, permille.
const BLIND: u16 = 500;

/// The sensors with their last readings.
#[derive(Clone, Debug)]
pub(crate) struct Bearers {
    noise: Noise,
    stars: Past<Attitude>,
    horizon: Past<Direction>,
    last: Option<Bearings>,
    /// Angle of the line of sight for a millimetre of the map, rad.
    per_mm: f64,
}

impl Bearers {
    /// `scale_m` metres on the ground for each metre of the map, seen from `height_m`.
    pub(crate) fn new(seed: u64, faults: &Faults, (scale_m, height_m): (f64, f64)) -> Self {
        Bearers {
            noise: Noise::new(seed, Stream::Bearings),
            stars: Past::new(faults.deepest_skew(Sensor::Rgb)),
            horizon: Past::new(faults.deepest_skew(Sensor::Thermal)),
            last: None,
            per_mm: scale_m / 1000.0 / height_m,
        }
    }

    pub(crate) fn reseed(&mut self, seed: u64) {
        self.noise.reseed(seed);
    }

    /// The readings of one frame, of a body in `attitude` under this sky.
    pub(crate) fn read(
        &mut self,
        (frame, stamp): (FrameId, Instant),
        (attitude, sky): ([f64; 4], &Sky),
        faults: &Faults,
        run: Span,
    ) -> Bearings {
        let effects = imaging(faults, run);
        let [stars, sun, horizon, field] = &effects;
        self.noise.seek(frame.0);
        let turned = self.turn(DEVIATIONS[0] * f64::from(stars.noise));
        let false_place = faults.effect_at(run, Sensor::Localisation).displaced_mm.map(|mm| mm as f64 * self.per_mm);
        // East on the map is a turn about the body's y axis, north one about x, for a payload that looks down with x to
        // the east.
        let shifted =
            from_axis_angle([-false_place[1], false_place[0], 0.0], norm([false_place[0], false_place[1], 0.0]));
        let seen = normalized(product(product(attitude, shifted), turned));
        let down = |reference: [f64; 3]| rotate_back(attitude, reference);
        let unlit = Direction::default();
        let now = Bearings {
            frame,
            stamp,
            mode: ProductMode::Live,
            stars: Some(self.stars.pass(Attitude::new(seen), stars.skew)),
            sun: Some(sky.sun.map_or(unlit, |reference| self.measure(down(reference), 1, sun))),
            horizon: {
                let direction = self.measure(down(sky.nadir), 2, horizon);
                Some(self.horizon.pass(direction, horizon.skew))
            },
            field: Some(self.measure(down(unit(sky.field_t).unwrap_or([0.0, 0.0, 1.0])), 3, field)),
        };
        let last = self.last.unwrap_or(now);
        let bearings = Bearings {
            stars: if stars.freeze { last.stars } else { now.stars },
            sun: if sun.freeze { last.sun } else { now.sun },
            horizon: if horizon.freeze { last.horizon } else { now.horizon },
            field: if field.freeze { last.field } else { now.field },
            ..now
        };
        self.last = Some(bearings);
        let is_visible = |effect: &Effect| !effect.dropout && effect.occluded < BLIND;
        Bearings {
            stars: bearings.stars.filter(|_| is_visible(stars)),
            sun: bearings.sun.filter(|_| is_visible(sun)),
            horizon: bearings.horizon.filter(|_| is_visible(horizon)),
            field: bearings.field.filter(|_| is_visible(field)),
            ..bearings
        }
    }

    fn drawn(&mut self, deviation: f64) -> [f64; 3] {
        [(); 3].map(|()| f64::from(self.noise.normal()) * deviation)
    }

    fn turn(&mut self, deviation: f64) -> [f64; 4] {
        let way = self.drawn(deviation);
        from_axis_angle(way, norm(way))
    }

    fn measure(&mut self, direction: [f64; 3], sensor: usize, effect: &Effect) -> Direction {
        let noise = self.drawn(DEVIATIONS[sensor] * f64::from(effect.noise));
        let measured = spacecraft::vector::add(direction, noise);
        Direction::new(unit(measured).unwrap_or(direction))
    }
}
