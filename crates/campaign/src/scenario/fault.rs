//! Faults that need no adversary: sensors that fail, processes that end or hang.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::attack::Windowed;
use super::value::{List, Located, Real, Seconds};

/// A fault of one sensor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    /// Which sensor.
    pub sensor: Sensor,
    /// What goes wrong.
    pub kind: FaultKind,
    /// Start on the trial's clock; the trial's phase is added.
    pub at_s: Located<Seconds>,
    /// A further uniform shift of the start, this fault's own.
    #[serde(default)]
    pub jitter_s: Real<0, 10_000>,
    /// Length.
    pub duration_s: Seconds,
    /// How much, in the unit of the kind (see [`FaultKind`]).
    #[serde(default)]
    pub magnitude: Option<Located<Magnitude>>,
}

/// One number, or east and north.
pub type Magnitude = List<Real<-100_000, 100_000>, 2>;

impl Windowed for Fault {
    fn at_s(&self) -> &Located<Seconds> {
        &self.at_s
    }
    fn duration_s(&self) -> Seconds {
        self.duration_s
    }
}

/// A sensor of the platform.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
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
}

/// How a sensor fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FaultKind {
    /// Nothing comes. Takes no magnitude.
    Dropout,
    /// The last reading comes again with a fresh stamp. Takes no magnitude.
    Freeze,
    /// More noise: magnitude `[factor]`, at least 1.
    Noise,
    /// A part of the view is hidden: magnitude `[share]`, 0 to 1.
    Occlusion,
    /// A growing error of localisation: magnitude `[east, north]` in metres per second.
    Drift,
    /// A sudden error of localisation: magnitude `[east, north]` in metres.
    Jump,
    /// A sudden error of the receiver's time: magnitude `[forwards]` in seconds, negative for a roll-back.
    TimeStep,
    /// A growing error of the receiver's time: magnitude `[too fast]` in milliseconds a second.
    TimeDrift,
}

impl FaultKind {
    /// How many numbers its magnitude has.
    pub fn numbers(self) -> usize {
        match self {
            FaultKind::Dropout | FaultKind::Freeze => 0,
            FaultKind::Noise | FaultKind::Occlusion | FaultKind::TimeStep | FaultKind::TimeDrift => 1,
            FaultKind::Drift | FaultKind::Jump => 2,
        }
    }

    /// Whether `sensor` can fail so.
    pub fn fits(self, sensor: Sensor) -> bool {
        match self {
            FaultKind::Dropout | FaultKind::Freeze | FaultKind::Noise => true,
            FaultKind::Occlusion => !matches!(sensor, Sensor::Odometry | Sensor::Localisation),
            FaultKind::Drift | FaultKind::Jump | FaultKind::TimeStep | FaultKind::TimeDrift => {
                sensor == Sensor::Localisation
            }
        }
    }
}

/// A process that ends or hangs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Kill {
    /// Which one.
    pub process: Process,
    /// How.
    #[serde(default)]
    pub ending: Ending,
    /// Time on the trial's clock; the trial's phase is added.
    pub at_s: Located<Seconds>,
}

impl Windowed for Kill {
    fn at_s(&self) -> &Located<Seconds> {
        &self.at_s
    }
    fn duration_s(&self) -> Seconds {
        Seconds::default()
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

/// How a process ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Ending {
    /// At once, without a last word.
    #[default]
    Kill,
    /// It stays and does nothing.
    Hang,
}
