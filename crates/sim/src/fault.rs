//! Sensor faults as scenario data: sensor, disturbance, start and duration.
//!
//! A fault changes readings before they leave sim, so services are unaware of it. [`Faults::effect_at`] folds the
//! active faults into one [`Effect`] for a sensor; `lib` writes start, end and every affected frame to the audit trail,
//! which is the actor's half of the receipt.

use std::sync::Arc;

use ground_truth::{FaultKind, MAX_CHAFF, MAX_SKEW, MAX_STRENGTH, Sensor, StepName};
use serde::{Deserialize, Serialize};
use wire::time::Span;

use crate::NAVIGATION_PERIOD;
use crate::limits::SceneError;
use crate::wander::Way;

/// Most faults of one run.
pub const MAX_FAULTS: usize = 32;

/// The greatest factor on a speed, permille, however many faults multiply it.
pub const MAX_SCALE: u16 = 10_000;

/// The greatest deviation of a place that wanders, millimetres.
pub const MAX_WANDER_MM: u32 = 100_000;

/// The greatest factor on a sensor's noise, however many faults multiply it.
const MAX_NOISE: f32 = 65_535.0;

/// Disturbance of the sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Disturbance {
    /// The sensor gives no reading.
    Dropout,
    /// The sensor repeats its last content under fresh stamps.
    Freeze,
    /// The sensor shows the content of some frames ago, under fresh stamps (colour and thermal).
    Skew {
        /// Number of frames, 1 to [`MAX_SKEW`].
        frames: u8,
    },
    /// The sensor shows many weak detections (colour only).
    Chaff {
        /// Number in each frame, 1 to [`MAX_CHAFF`].
        count: u8,
    },
    /// The scene's perturbation is added to the image (colour only).
    Perturbation {
        /// Largest change of a byte, of 255, up to [`MAX_STRENGTH`].
        strength: u8,
    },
    /// The sensor's noise is multiplied by a factor.
    Noise {
        /// Factor, at least 1.
        factor: u16,
    },
    /// The left part of its view is covered by something close and at ambient temperature.
    Occlusion {
        /// Covered share of the width, permille.
        permille: u16,
    },
    /// The position drifts at a constant rate (localisation and height). For odometry: each speed is off by the rate.
    Drift {
        /// East, mm/s; of height: up; of odometry: ahead.
        east_mm_s: i32,
        /// North, mm/s.
        north_mm_s: i32,
    },
    /// The position is displaced while the fault lasts (localisation and height). For odometry: the first reading
    /// contains the displacement as a further way.
    Jump {
        /// East, millimetres; of height: up; of odometry: ahead.
        east_mm: i32,
        /// North, millimetres.
        north_mm: i32,
    },
    /// The receiver's time is displaced while the fault lasts (localisation only).
    TimeStep {
        /// Displacement forwards, microseconds.
        us: i64,
    },
    /// The receiver's time drifts at a constant rate (localisation only).
    TimeDrift {
        /// Rate by which the time runs too fast, parts per million.
        ppm: i32,
    },
    /// The speed is multiplied by a factor (odometry only).
    Scale {
        /// Factor, permille, up to [`MAX_SCALE`].
        permille: u16,
    },
    /// The position wanders about the true one (localisation only, `wander`).
    Wander {
        /// Deviation on each axis after a long time, millimetres, up to [`MAX_WANDER_MM`].
        deviation_mm: u32,
    },
}

/// True if a sensor is part of the frames (and not of the navigation readings).
pub fn is_imaging(sensor: Sensor) -> bool {
    match sensor {
        Sensor::Rgb | Sensor::Depth | Sensor::Thermal | Sensor::Lidar => true,
        Sensor::Odometry | Sensor::Localisation | Sensor::Height => false,
    }
}

/// A fault of one sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    /// Affected sensor.
    pub sensor: Sensor,
    /// Disturbance of the sensor.
    pub disturbance: Disturbance,
    /// Milliseconds after the start of the run.
    pub start_ms: u64,
    /// Duration, milliseconds.
    pub duration_ms: u64,
    /// Step that the fault is a part of, under which it is reported and called, where the step has a name.
    #[serde(default)]
    pub step: Option<StepName>,
    /// Milliseconds from the call of the step to the beginning, at `start_ms` at the earliest; without it, the fault
    /// begins at `start_ms`.
    #[serde(default)]
    pub waits_ms: Option<u64>,
}

impl Fault {
    /// True if it is in force this long after the start of the run.
    pub fn active(&self, run: Span) -> bool {
        self.waits_ms.is_none() && run >= self.begins() && run < self.ends()
    }

    /// Start, after the start of the run.
    pub fn begins(&self) -> Span {
        Span(self.start_ms.saturating_mul(1000))
    }

    /// End, after the start of the run.
    pub fn ends(&self) -> Span {
        self.begins() + Span(self.duration_ms.saturating_mul(1000))
    }

    /// Name of the fault's kind in the audit trail.
    pub fn kind(&self) -> FaultKind {
        match self.disturbance {
            Disturbance::Dropout => FaultKind::Dropout,
            Disturbance::Freeze => FaultKind::Freeze,
            Disturbance::Skew { .. } => FaultKind::Skew,
            Disturbance::Chaff { .. } => FaultKind::Chaff,
            Disturbance::Perturbation { .. } => FaultKind::Perturbation,
            Disturbance::Noise { .. } => FaultKind::Noise,
            Disturbance::Occlusion { .. } => FaultKind::Occlusion,
            Disturbance::Drift { .. } => FaultKind::Drift,
            Disturbance::Jump { .. } => FaultKind::Jump,
            Disturbance::TimeStep { .. } => FaultKind::TimeStep,
            Disturbance::TimeDrift { .. } => FaultKind::TimeDrift,
            Disturbance::Scale { .. } => FaultKind::Scale,
            Disturbance::Wander { .. } => FaultKind::Wander,
        }
    }

    fn applies(&self) -> bool {
        match self.disturbance {
            Disturbance::Dropout | Disturbance::Freeze => true,
            Disturbance::Skew { frames } => {
                matches!(self.sensor, Sensor::Rgb | Sensor::Thermal) && (1..=MAX_SKEW).contains(&frames)
            }
            Disturbance::Chaff { count } => self.sensor == Sensor::Rgb && (1..=MAX_CHAFF).contains(&count),
            Disturbance::Perturbation { strength } => self.sensor == Sensor::Rgb && strength <= MAX_STRENGTH,
            Disturbance::Noise { factor } => factor >= 1,
            Disturbance::Occlusion { permille } => is_imaging(self.sensor) && permille <= 1000,
            Disturbance::Drift { .. } | Disturbance::Jump { .. } => {
                matches!(self.sensor, Sensor::Odometry | Sensor::Localisation | Sensor::Height)
            }
            Disturbance::Scale { permille } => self.sensor == Sensor::Odometry && permille <= MAX_SCALE,
            Disturbance::TimeStep { .. } | Disturbance::TimeDrift { .. } => self.sensor == Sensor::Localisation,
            Disturbance::Wander { deviation_mm } => {
                self.sensor == Sensor::Localisation && deviation_mm <= MAX_WANDER_MM
            }
        }
    }
}

/// Combined effect of all active faults on one sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effect {
    /// Gives no reading.
    pub dropout: bool,
    /// Repeats its last content.
    pub freeze: bool,
    /// Delay of the content, frames.
    pub skew: u8,
    /// Number of additional weak detections.
    pub chaff: u8,
    /// Largest change by the scene's perturbation, of 255, if it is added at all.
    pub perturbation: Option<u8>,
    /// Factor on the noise.
    pub noise: f32,
    /// Covered share of its view from the left, permille.
    pub occluded: u16,
    /// Displacement east and north, millimetres; of height: up, in the first.
    pub displaced_mm: [i64; 2],
    /// Displacement of the receiver's time forwards, microseconds.
    pub displaced_us: i64,
    /// Factor on the speed, permille.
    pub scale: i64,
    /// Excess of the speed, mm/s.
    pub fast_mm_s: i64,
}

impl Effect {
    /// The effect without a fault.
    pub const NONE: Effect = Effect {
        dropout: false,
        freeze: false,
        skew: 0,
        chaff: 0,
        perturbation: None,
        noise: 1.0,
        occluded: 0,
        displaced_mm: [0, 0],
        displaced_us: 0,
        scale: 1000,
        fast_mm_s: 0,
    };

    /// True if a new reading has to be made.
    pub fn refreshes(&self) -> bool {
        !self.dropout && !self.freeze
    }

    /// Speed as the faulty sensor gives it, mm/s.
    pub(crate) fn scaled(&self, mm_s: i32) -> i64 {
        i64::from(mm_s) * self.scale / 1000
    }
}

/// The faults of a run, and how noisy every sensor is without any.
#[derive(Clone, Debug)]
pub struct Faults {
    all: Arc<[Fault]>,
    noise: f32,
    /// Way of each fault that wanders, by index; empty for others.
    ways: Arc<[Way]>,
}

impl Faults {
    /// Takes at most [`MAX_FAULTS`] faults, each of which its sensor can have.
    pub fn new(faults: &[Fault]) -> Result<Self, SceneError> {
        if faults.len() > MAX_FAULTS {
            return Err(SceneError::Count { field: "faults", got: faults.len(), low: 0, high: MAX_FAULTS });
        }
        match faults.iter().position(|f| !f.applies()) {
            Some(index) => Err(SceneError::FaultDoesNotApply { index }),
            None => Ok(Faults { all: faults.into(), noise: Effect::NONE.noise, ways: Arc::new([]) }),
        }
    }

    /// The faults with the way of each that wanders drawn from `seed`.
    #[must_use]
    pub(crate) fn wandering(self, seed: u64) -> Self {
        let way = |(index, fault): (usize, &Fault)| {
            let Disturbance::Wander { deviation_mm } = fault.disturbance else { return Way::default() };
            Way::new(seed, index, deviation_mm, fault.duration_ms)
        };
        Self { ways: self.all.iter().enumerate().map(way).collect(), ..self }
    }

    /// The faults, with `noise` as a factor on every sensor's noise.
    #[must_use]
    pub(crate) fn with_noise(self, noise: f32) -> Self {
        Self { noise, ..self }
    }

    /// All of them, by index.
    pub fn all(&self) -> &[Fault] {
        &self.all
    }

    /// The faults without faults of this kind on this sensor; indices stay.
    pub(crate) fn without_fault(&self, sensor: Sensor, kind: FaultKind) -> Self {
        let calm = |fault: &Fault| match (fault.sensor, fault.kind()) == (sensor, kind) {
            true => Fault { duration_ms: 0, ..*fault },
            false => *fault,
        };
        Faults { all: self.all.iter().map(calm).collect(), noise: self.noise, ways: self.ways.clone() }
    }

    /// The most frames by which `sensor` will ever be late.
    pub(crate) fn deepest_skew(&self, sensor: Sensor) -> u8 {
        let of_sensor = self.all.iter().filter(|f| f.sensor == sensor);
        let late = |f: &Fault| if let Disturbance::Skew { frames } = f.disturbance { frames } else { 0 };
        of_sensor.map(late).max().unwrap_or(0)
    }

    /// The step `name` is called this long after the start of the run.
    pub fn call(&mut self, name: StepName, run: Span) {
        let called = |fault: &Fault| match fault.waits_ms {
            Some(after) if fault.step == Some(name) => {
                Fault { start_ms: fault.start_ms.max(run.0 / 1000).saturating_add(after), waits_ms: None, ..*fault }
            }
            Some(_) | None => *fault,
        };
        self.all = self.all.iter().map(called).collect();
    }

    /// Factor on every sensor's noise apart from faults.
    pub(crate) fn own_noise(&self) -> f32 {
        self.noise
    }

    /// Effect on `sensor` this long after the start of the run.
    pub fn effect_at(&self, run: Span, sensor: Sensor) -> Effect {
        let active = self.all.iter().enumerate().filter(|(_, f)| f.sensor == sensor && f.active(run));
        active.fold(Effect { noise: self.noise, ..Effect::NONE }, |effect, (index, fault)| {
            let strayed = self.ways.get(index).map_or([0, 0], |way| way.displacement(Span(run.0 - fault.begins().0)));
            effect.with_fault(fault, run).strayed(strayed)
        })
    }
}

/// Effects on colour, depth, thermal and LiDAR.
pub(crate) fn imaging(faults: &Faults, run: Span) -> [Effect; 4] {
    [Sensor::Rgb, Sensor::Depth, Sensor::Thermal, Sensor::Lidar].map(|s| faults.effect_at(run, s))
}

impl Effect {
    fn with_fault(mut self, fault: &Fault, run: Span) -> Effect {
        match fault.disturbance {
            Disturbance::Dropout => self.dropout = true,
            Disturbance::Freeze => self.freeze = true,
            Disturbance::Skew { frames } => self.skew = self.skew.max(frames),
            Disturbance::Chaff { count } => self.chaff = self.chaff.saturating_add(count).min(MAX_CHAFF),
            Disturbance::Perturbation { strength } => self.perturbation = self.perturbation.max(Some(strength)),
            Disturbance::Noise { factor } => self.noise = (self.noise * f32::from(factor)).min(MAX_NOISE),
            Disturbance::Occlusion { permille } => self.occluded = self.occluded.max(permille),
            Disturbance::Drift { east_mm_s, .. } if fault.sensor == Sensor::Odometry => {
                self.fast_mm_s += i64::from(east_mm_s);
            }
            Disturbance::Drift { east_mm_s, north_mm_s } => {
                let us = (run.0 - fault.begins().0) as i64;
                self.displaced_mm[0] += i64::from(east_mm_s) * us / 1_000_000;
                self.displaced_mm[1] += i64::from(north_mm_s) * us / 1_000_000;
            }
            Disturbance::Jump { east_mm, .. } if fault.sensor == Sensor::Odometry => {
                let first = run.0 - fault.begins().0 < NAVIGATION_PERIOD.0;
                let a_second = (1_000_000 / NAVIGATION_PERIOD.0) as i64;
                self.fast_mm_s += if first { i64::from(east_mm) * a_second } else { 0 };
            }
            Disturbance::Jump { east_mm, north_mm } => {
                self.displaced_mm[0] += i64::from(east_mm);
                self.displaced_mm[1] += i64::from(north_mm);
            }
            Disturbance::TimeStep { us } => self.displaced_us = self.displaced_us.saturating_add(us),
            Disturbance::TimeDrift { ppm } => {
                let us = (run.0 - fault.begins().0) as i64;
                self.displaced_us = self.displaced_us.saturating_add(i64::from(ppm) * us / 1_000_000);
            }
            Disturbance::Scale { permille } => {
                self.scale = (self.scale * i64::from(permille) / 1000).min(i64::from(MAX_SCALE));
            }
            Disturbance::Wander { .. } => {}
        }
        self
    }

    /// The effect with a place displaced further, millimetres.
    fn strayed(mut self, by_mm: [i32; 2]) -> Effect {
        self.displaced_mm[0] += i64::from(by_mm[0]);
        self.displaced_mm[1] += i64::from(by_mm[1]);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drift_grows_and_ends_with_its_fault() {
        let disturbance = Disturbance::Drift { east_mm_s: 500, north_mm_s: -100 };
        let fault = Fault {
            sensor: Sensor::Localisation,
            disturbance,
            start_ms: 1000,
            duration_ms: 4000,
            step: None,
            waits_ms: None,
        };
        let faults = Faults::new(&[fault]).unwrap();
        assert_eq!(faults.effect_at(Span::ms(3000), Sensor::Localisation).displaced_mm, [1000, -200]);
        assert_eq!(faults.effect_at(Span::ms(3000), Sensor::Odometry), Effect::NONE);
        assert_eq!(faults.effect_at(Span::ms(5000), Sensor::Localisation), Effect::NONE);
    }

    /// Odometry goes on from where it was led.
    #[test]
    fn odometry_is_too_fast_while_its_fault_lasts() {
        let fast = |disturbance: Disturbance, ms: u64| {
            let (sensor, start_ms, duration_ms) = (Sensor::Odometry, 1000, 4000);
            let fault = Fault { sensor, disturbance, start_ms, duration_ms, step: None, waits_ms: None };
            let effect = Faults::new(&[fault]).unwrap().effect_at(Span::ms(ms), Sensor::Odometry);
            (effect.fast_mm_s, effect.scaled(2000), effect.displaced_mm)
        };
        let drift = Disturbance::Drift { east_mm_s: 500, north_mm_s: 0 };
        assert_eq!([900, 1000, 4999, 5000].map(|ms| fast(drift, ms).0), [0, 500, 500, 0]);
        let jump = Disturbance::Jump { east_mm: -300, north_mm: 0 };
        assert_eq!([950, 1000, 1049, 1050, 5000].map(|ms| fast(jump, ms).0), [0, -6000, -6000, 0, 0]);
        assert_eq!(fast(Disturbance::Scale { permille: 1100 }, 1000), (0, 2200, [0, 0]));
    }

    /// Not before the time of the fault.
    #[test]
    fn waiting_fault_starts_with_its_step() {
        let step = StepName::new("blind");
        let (sensor, disturbance) = (Sensor::Thermal, Disturbance::Dropout);
        let fault = Fault { sensor, disturbance, start_ms: 1000, duration_ms: 500, step, waits_ms: Some(100) };
        let mut faults = Faults::new(&[fault]).unwrap();
        let blind = |faults: &Faults, ms: u64| faults.effect_at(Span::ms(ms), Sensor::Thermal).dropout;
        assert!(!blind(&faults, 1200));
        faults.call(StepName::new("other").unwrap(), Span::ms(1300));
        assert!(!blind(&faults, 1500));
        faults.call(step.unwrap(), Span::ms(2000));
        assert_eq!([2099, 2100, 2599, 2600].map(|ms| blind(&faults, ms)), [false, true, true, false]);
        faults.call(step.unwrap(), Span::ms(3000));
        assert!(!blind(&faults, 3200), "a step begins once");
    }

    #[test]
    fn noise_fault_multiplies_the_present_noise() {
        let (sensor, disturbance) = (Sensor::Rgb, Disturbance::Noise { factor: 4 });
        let fault = Fault { sensor, disturbance, start_ms: 0, duration_ms: 1000, step: None, waits_ms: None };
        let faults = Faults::new(&[fault]).unwrap().with_noise(0.5);
        let noise = |ms, sensor| faults.effect_at(Span::ms(ms), sensor).noise;
        assert_eq!([noise(500, sensor), noise(1500, sensor), noise(500, Sensor::Lidar)], [2.0, 0.5, 0.5]);
    }

    #[test]
    fn a_lidar_cannot_jump() {
        let disturbance = Disturbance::Jump { east_mm: 1, north_mm: 0 };
        let fault =
            Fault { sensor: Sensor::Lidar, disturbance, start_ms: 0, duration_ms: 1, step: None, waits_ms: None };
        assert_eq!(Faults::new(&[fault]).unwrap_err(), SceneError::FaultDoesNotApply { index: 0 });
    }
}
