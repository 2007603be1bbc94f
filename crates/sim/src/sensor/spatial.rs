//! Readings of a body that leaves the ground: height by satellite receiver and by air pressure, distance to the surface
//! below, velocity by inertial and optical-flow sensors, charge of the battery; and for the display alone, as they are,
//! attitude and sunlight.
//!
//! A frozen source repeats its last reading, a dropped one gives none. The height of a fix fails with the fix, the
//! velocity with odometry; the height by pressure has its own faults.

use ground_truth::Sensor;
use wire::motion::{Attitude, Spatial};
use wire::time::Span;

use crate::fault::Faults;
use crate::noise::{Noise, Stream};
use crate::plant::{Flight, State};

/// Deviation of a fix's height, metres: one and a half times that of its place, the usual ratio of a receiver's
/// dilutions.
const FIX_UP_M: f32 = 0.06;
/// Deviation of the height by pressure, metres: a BMP388's 8 cm at full rate.
const PRESSURE_M: f32 = 0.08;
/// Deviation of the range finder, metres.
const RANGE_M: f32 = 0.02;
/// Height from which on there is no air pressure to speak of, metres.
const AIR_M: f64 = 50_000.0;
/// Deviation of velocity, m/s.
const VELOCITY_M_S: f32 = 0.02;

/// The sources with their last readings.
#[derive(Clone, Debug)]
pub(crate) struct Altimeters {
    noise: Noise,
    last: Spatial,
}

impl Altimeters {
    pub(crate) fn new(seed: u64) -> Self {
        Altimeters { noise: Noise::new(seed, Stream::Spatial), last: Spatial::default() }
    }

    pub(crate) fn reseed(&mut self, seed: u64) {
        self.noise.reseed(seed);
    }

    /// Reading `n`, under the faults in force `run` after the start.
    pub(crate) fn read(
        &mut self,
        n: u64,
        (state, flight, sunlit): (&State, &Flight, Option<bool>),
        faults: &Faults,
        run: Span,
    ) -> Spatial {
        let effect = |sensor: Sensor| faults.effect_at(run, sensor);
        let (fix, odometry, height) = (effect(Sensor::Localisation), effect(Sensor::Odometry), effect(Sensor::Height));
        self.noise.seek(n);
        let mut drawn = |deviation: f32, gain: f32| self.noise.normal() * deviation * gain;
        let level = state.rotation.inverse() * state.velocity;
        let up = flight.place[2];
        let fix_up = up + f64::from(drawn(FIX_UP_M, fix.noise));
        let pressure_up = up as f32 + drawn(PRESSURE_M, height.noise);
        let range = drawn(RANGE_M, 1.0);
        let left_up = [level.y, level.z].map(|v| odometry.scaled(mm(v + drawn(VELOCITY_M_S, odometry.noise))));
        let left_up = left_up.map(|mm_s| mm_s.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32);
        let q = flight.attitude;
        let displaced = height.displaced_mm[0].clamp(-1_000_000_000, 1_000_000_000) as i32;
        let now = Spatial {
            fix_up_mm: Some((fix_up * 1000.0) as i64),
            // Where there is air.
            pressure_up_mm: (up < AIR_M).then(|| mm(pressure_up).saturating_add(displaced)),
            range_mm: flight.below.map(|below| mm(below + range).max(0) as u32),
            left_up_mm_s: Some(left_up),
            charge: Some((flight.charge * 1000.0) as u16),
            attitude: Some(Attitude::new([q.w, q.x, q.y, q.z].map(f64::from))),
            sunlit,
        };
        let last = self.last;
        let keep = |frozen: bool| frozen && last != Spatial::default();
        let shown = Spatial {
            fix_up_mm: if keep(fix.freeze) { last.fix_up_mm } else { now.fix_up_mm },
            pressure_up_mm: if keep(height.freeze) { last.pressure_up_mm } else { now.pressure_up_mm },
            left_up_mm_s: if keep(odometry.freeze) { last.left_up_mm_s } else { now.left_up_mm_s },
            ..now
        };
        self.last = shown;
        Spatial {
            fix_up_mm: shown.fix_up_mm.filter(|_| !fix.dropout),
            pressure_up_mm: shown.pressure_up_mm.filter(|_| !height.dropout),
            left_up_mm_s: shown.left_up_mm_s.filter(|_| !odometry.dropout),
            ..shown
        }
    }
}

/// Metres (or metres a second) as whole thousandths.
fn mm(metres: f32) -> i32 {
    libm::roundf(metres * 1000.0) as i32
}
