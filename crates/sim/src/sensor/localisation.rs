//! Localisation and wheel odometry: two readings of the plant's motion with their own noise.
//!
//! A frozen source repeats its last reading, but its receiver's time goes on: a place that stands still beside a time
//! that does not is the harder lie. A dropped source gives no reading. Localisation states the deviation that it has
//! without a fault, as a deceived receiver would. The receiver's time is true time, from which this host's clock
//! drifts.

use ground_truth::Sensor;
use wire::sensor::{Fix, Odometry, Pose, ReceiverTime};
use wire::time::Span;

use crate::fault::{Effect, Faults};
use crate::noise::{Noise, Stream};
use crate::plant::State;

/// Deviation of position on each axis as the models ship, millimetres.
pub const SIGMA_MM: u16 = 40;
/// Deviation of heading, milliradians.
const SIGMA_MRAD: f32 = 4.0;
/// The receiver's time at the start of a run, microseconds of its count.
pub const EPOCH_US: u64 = 1_400_000_000_000_000;
/// Deviation of the receiver's time against the stamp of the reading, microseconds.
const SIGMA_US: f32 = 300.0;
/// Deviation of speed, mm/s.
const SIGMA_MM_S: f32 = 15.0;
/// Deviation of the rate of turn, mrad/s.
const SIGMA_MRAD_S: f32 = 3.0;

/// Both sources with their last readings.
#[derive(Clone, Debug)]
pub(crate) struct Navigators {
    localisation: Noise,
    odometry: Noise,
    last_fix: Option<Fix>,
    last_odometry: Option<Odometry>,
    clock_ppm: i32,
    /// Deviation of the newest reading's time, microseconds.
    late_us: i64,
}

impl Navigators {
    /// `clock_ppm`: how much faster than true time this host's clock runs.
    pub(crate) fn new(seed: u64, clock_ppm: i32) -> Self {
        Navigators {
            clock_ppm,
            late_us: 0,
            localisation: Noise::new(seed, Stream::Localisation),
            odometry: Noise::new(seed, Stream::Odometry),
            last_fix: None,
            last_odometry: None,
        }
    }

    pub(crate) fn reseed(&mut self, seed: u64) {
        self.localisation.reseed(seed);
        self.odometry.reseed(seed);
    }

    /// Reading `n` of both, under the faults in force `run` after the start.
    pub(crate) fn read(
        &mut self,
        n: u64,
        state: &State,
        faults: &Faults,
        run: Span,
    ) -> (Option<Fix>, Option<Odometry>) {
        let (fix, odometry) = (faults.effect_at(run, Sensor::Localisation), faults.effect_at(run, Sensor::Odometry));
        if fix.refreshes() {
            self.localisation.seek(n);
            // Without the noise of faults: a deceived receiver states its usual deviation.
            let stated_mm = libm::roundf(f32::from(SIGMA_MM) * faults.own_noise()) as u16;
            self.last_fix = Some(locate(state, &mut self.localisation, &fix, stated_mm));
            let late = self.localisation.normal() * SIGMA_US;
            self.late_us = late as i64;
        }
        let time = self.time(run, &fix);
        // A freeze stops the place, not the receiver's time.
        let last_fix = self.last_fix.map(|fix| Fix { time, ..fix });
        if odometry.refreshes() {
            self.odometry.seek(n);
            self.last_odometry = Some(measure(state, &mut self.odometry, &odometry));
        }
        (last_fix.filter(|_| !fix.dropout), self.last_odometry.filter(|_| !odometry.dropout))
    }

    /// The receiver's time, `run` after the start by this host's clock.
    fn time(&self, run: Span, effect: &Effect) -> ReceiverTime {
        let (run, ppm) = (run.0 as i128, i128::from(self.clock_ppm));
        let elapsed = (run * 1_000_000 / (1_000_000 + ppm)) as i64;
        let displaced = elapsed.saturating_add(self.late_us).saturating_add(effect.displaced_us);
        ReceiverTime(EPOCH_US.saturating_add_signed(displaced))
    }
}

fn locate(state: &State, noise: &mut Noise, effect: &Effect, sigma_mm: u16) -> Fix {
    let gain = effect.noise;
    let mut axis = |metres: f32, displaced: i64| {
        let millimetres = metres * 1000.0 + noise.normal() * f32::from(SIGMA_MM) * gain;
        (millimetres as i64).saturating_add(displaced).clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
    };
    let x_mm = axis(state.position.x, effect.displaced_mm[0]);
    let y_mm = axis(state.position.y, effect.displaced_mm[1]);
    let yaw_mrad = wrap_mrad(state.yaw() * 1000.0 + noise.normal() * SIGMA_MRAD * gain);
    Fix { pose: Pose { x_mm, y_mm, yaw_mrad }, sigma_mm, time: ReceiverTime::default() }
}

fn measure(state: &State, noise: &mut Noise, effect: &Effect) -> Odometry {
    let gain = effect.noise;
    let speed = (state.speed() * 1000.0 + noise.normal() * SIGMA_MM_S * gain) as i32;
    let reported = effect.scaled(speed).saturating_add(effect.fast_mm_s);
    Odometry {
        speed_mm_s: reported.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32,
        yaw_rate_mrad_s: (state.yaw_rate * 1000.0 + noise.normal() * SIGMA_MRAD_S * gain) as i16,
    }
}

/// An angle in milliradians, brought into (−π, π].
pub(crate) fn wrap_mrad(mrad: f32) -> i16 {
    const TURN: f32 = core::f32::consts::TAU * 1000.0;
    let turns = libm::roundf(mrad / TURN);
    (mrad - turns * TURN) as i16
}
