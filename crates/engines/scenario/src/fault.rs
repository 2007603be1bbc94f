//! Faults that need no adversary: sensors that fail, processes that end, hang or get too little of the processor.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::timed::timed;
use super::value::{List, Located, Real, Seconds, Share, Whole};

timed! {
    /// A fault of one sensor.
    Fault lasts duration_s {
        /// The sensor.
        sensor: Sensor,
        /// Kind of the failure.
        kind: FaultKind,
        /// A further uniform shift of the start, this fault's own.
        #[serde(default)]
        jitter_s: Real<0, 10_000>,
        /// Length.
        duration_s: Seconds,
        /// Size, in the unit of the kind (see [`FaultKind`]).
        #[serde(default)]
        magnitude: Option<Located<Magnitude>>,
    }
}

/// One number, or east and north.
pub type Magnitude = List<Real<-100_000, 100_000>, 2>;

/// A sensor of the platform.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema, strum::IntoStaticStr,
)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum Sensor {
    /// Colour camera.
    Rgb,
    /// Depth camera.
    Depth,
    /// Thermal camera.
    Thermal,
    /// LiDAR.
    Lidar,
    /// Wheel odometry.
    Odometry,
    /// Localisation.
    Localisation,
    /// Height by air pressure, of a platform that flies.
    Height,
}

/// Kind of failure of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FaultKind {
    /// No reading comes. Takes no magnitude.
    Dropout,
    /// The last reading comes again with a fresh stamp. Takes no magnitude.
    Freeze,
    /// A camera (colour, thermal) shows an earlier view under fresh stamps: magnitude `[frames]`, 4 to 32.
    Skew,
    /// The colour stage finds a given number of weak detections in each frame: magnitude `[count]`, 12 to 32.
    Chaff,
    /// The scene's `perturbation` is added to each colour image: magnitude `[strength]`, the largest change of a byte, of 255, 0
    /// to 100.
    Perturbation,
    /// More noise: magnitude `[factor]`, at least 1.
    Noise,
    /// A part of the view is hidden: magnitude `[share]`, 0 to 1.
    Occlusion,
    /// A growing error: of localisation, magnitude `[east, north]` in metres per second; of height, `[up]`; of odometry, `[ahead]`, by
    /// which each speed is too great, -3 to 3.
    Drift,
    /// A sudden error: of localisation, magnitude `[east, north]` in metres; of height, `[up]`; of odometry, `[ahead]`, all of it in
    /// one reading, -100 to 100.
    Jump,
    /// An error of localisation that wanders about nought, east and north each a Gauss-Markov process of 60 s that starts at nought:
    /// magnitude `[deviation]` in metres, 0 to 100.
    Wander,
    /// The speed of odometry times a factor: magnitude `[factor]`, 0 to 10.
    Scale,
    /// A sudden error of the receiver's time: magnitude `[forwards]` in seconds, negative for a roll-back.
    TimeStep,
    /// A growing error of the receiver's time: magnitude `[too fast]` in milliseconds a second.
    TimeDrift,
}

impl FaultKind {
    /// Count of the numbers in its magnitude at `sensor`.
    pub fn numbers(self, sensor: Sensor) -> usize {
        match self {
            FaultKind::Dropout | FaultKind::Freeze => 0,
            FaultKind::Noise | FaultKind::Occlusion | FaultKind::TimeStep | FaultKind::TimeDrift => 1,
            FaultKind::Skew | FaultKind::Chaff | FaultKind::Perturbation | FaultKind::Scale | FaultKind::Wander => 1,
            FaultKind::Drift | FaultKind::Jump if sensor != Sensor::Localisation => 1,
            FaultKind::Drift | FaultKind::Jump => 2,
        }
    }

    /// True if `sensor` can fail so.
    pub fn fits(self, sensor: Sensor) -> bool {
        match self {
            FaultKind::Dropout | FaultKind::Freeze | FaultKind::Noise => true,
            FaultKind::Skew => matches!(sensor, Sensor::Rgb | Sensor::Thermal),
            FaultKind::Chaff | FaultKind::Perturbation => sensor == Sensor::Rgb,
            FaultKind::Occlusion => !matches!(sensor, Sensor::Odometry | Sensor::Localisation | Sensor::Height),
            FaultKind::Drift | FaultKind::Jump => {
                matches!(sensor, Sensor::Odometry | Sensor::Localisation | Sensor::Height)
            }
            FaultKind::Scale => sensor == Sensor::Odometry,
            FaultKind::TimeStep | FaultKind::TimeDrift | FaultKind::Wander => sensor == Sensor::Localisation,
        }
    }

    /// Least and greatest error of odometry: of its speed (m/s), its way (m), its factor. No platform goes faster than such an error of speed.
    pub(super) fn of_odometry(self) -> Option<(f64, f64)> {
        match self {
            FaultKind::Drift => Some((-3.0, 3.0)),
            FaultKind::Jump => Some((-100.0, 100.0)),
            FaultKind::Scale => Some((0.0, 10.0)),
            FaultKind::Dropout | FaultKind::Freeze | FaultKind::Noise | FaultKind::Occlusion => None,
            FaultKind::Skew | FaultKind::Chaff | FaultKind::Perturbation => None,
            FaultKind::TimeStep | FaultKind::TimeDrift | FaultKind::Wander => None,
        }
    }
}

timed! {
    /// A process that ends, hangs, is slow or finds its disk full.
    Kill lasts duration_s {
        /// The process.
        process: Process,
        /// Kind of the fault.
        #[serde(default)]
        ending: Ending,
        /// Time for which it hangs, is slow, or has no room on its disk.
        #[serde(default)]
        duration_s: Seconds,
        /// For a slow one: the share of each period for which it runs. For the rest it is stopped unconditionally.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        quota: Option<Located<Share>>,
        /// For a slow one: the period. 100 ms are the kernel's own for processor quotas.
        #[serde(default = "quota_period")]
        period_ms: Whole<10, 10_000>,
        /// For a killed one: it is started again so long after its end, with a new boot. Autonomy only.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        restart_after_s: Option<Located<Seconds>>,
    }
}

impl Kill {
    /// A fault of `process` at once and for no time; the rest is to be filled in.
    pub(super) fn new(process: Process, ending: Ending) -> Self {
        Self {
            process,
            ending,
            duration_s: Seconds::default(),
            quota: None,
            period_ms: quota_period(),
            restart_after_s: None,
            at_s: Located::default(),
            step: None,
            when: None,
            knowledge: None,
        }
    }
}

/// A process of the twin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Process {
    /// World and sensors.
    Sim,
    /// Detector, corroboration, tracker.
    Perception,
    /// State machine of the platform under test.
    Autonomy,
    /// Admission on the control side.
    Gateway,
    /// Command broker.
    Broker,
    /// Supervisory console.
    Console,
    /// The relays.
    Adversary,
    /// Evidence recorder.
    Recorder,
}

/// Kind of fault of a process.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Ending {
    /// At once, without a last word.
    #[default]
    Kill,
    /// It stays and does no work for a time; messages to it wait, as far as there is room.
    Hang,
    /// It runs for a share of the time.
    Slow,
    /// It runs, and its disk takes no more for a time. The recorder only.
    Full,
}

fn quota_period() -> Whole<10, 10_000> {
    Whole::new(100).expect("invariant: within its range")
}
