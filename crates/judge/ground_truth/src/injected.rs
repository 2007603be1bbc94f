//! Injected faults and attacks: an adversary's actions, a sensor's faults, a process that is kept from running.
//!
//! Scenarios plan injections; `adversary`, `sim` and the launcher carry them out.

use minicbor::{Decode, Encode};
use wire::sensor::Modality;
use wire::time::Span;

/// Action of an adversary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[cbor(index_only)]
pub enum Action {
    /// Held a datagram back for some time.
    #[n(0)]
    Delay,
    /// Dropped it.
    #[n(1)]
    Drop,
    /// Sent copies of a datagram at once.
    #[n(2)]
    Duplicate,
    /// Let a later one overtake it.
    #[n(3)]
    Reorder,
    /// Emitted an earlier one again.
    #[n(4)]
    Replay,
    /// Changed its bytes.
    #[n(5)]
    Corrupt,
    /// Sent its bytes from another source.
    #[n(6)]
    Reoriginate,
    /// Sent bytes that it made itself.
    #[n(7)]
    Inject,
    /// Sent a record under a teammate's own credentials.
    #[n(8)]
    Forward,
    /// Ended a process.
    #[n(11)]
    Kill,
    /// Published, on a shared-memory channel that is another's, its own message making.
    #[n(45)]
    Forge,
    /// Published there again a message of that channel's producer.
    #[n(46)]
    Republish,
    /// Sent a record of an earlier session again, under its own credentials.
    #[n(35)]
    Resend,
    /// Reported a falsehood of itself.
    #[n(36)]
    Lie,
    /// Reported as a live product, in this time base, one that is neither or not both.
    #[n(37)]
    Confuse,
}

/// The most frames by which a camera's content may be late.
pub const MAX_SKEW: u8 = 32;
/// The most weak detections that one frame can be given: as many as a stage's list has room for.
pub const MAX_CHAFF: u8 = 32;
/// Largest change of a byte by a perturbation, of 255.
pub const MAX_STRENGTH: u8 = 100;

/// A sensor that a fault can befall.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Encode,
    Decode,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
    strum::IntoStaticStr,
)]
#[strum(serialize_all = "kebab-case")]
#[cbor(index_only)]
#[serde(rename_all = "snake_case")]
pub enum Sensor {
    /// Colour camera.
    #[n(0)]
    Rgb,
    /// Depth camera.
    #[n(1)]
    Depth,
    /// Thermal camera.
    #[n(2)]
    Thermal,
    /// LiDAR.
    #[n(3)]
    Lidar,
    /// Wheel odometry.
    #[n(4)]
    Odometry,
    /// Localisation.
    #[n(5)]
    Localisation,
    /// Height by air pressure.
    #[n(6)]
    Height,
}

impl Sensor {
    /// The sensor behind a modality.
    pub fn from_modality(modality: Modality) -> Sensor {
        match modality {
            Modality::Rgb => Sensor::Rgb,
            Modality::Depth => Sensor::Depth,
            Modality::Thermal => Sensor::Thermal,
            Modality::Lidar => Sensor::Lidar,
        }
    }
}

/// Fault of the sensor.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Encode,
    Decode,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
)]
#[cbor(index_only)]
#[serde(rename_all = "kebab-case")]
pub enum FaultKind {
    /// No reading comes. Takes no magnitude.
    #[n(0)]
    Dropout,
    /// The last reading comes again with a fresh stamp. Takes no magnitude.
    #[n(1)]
    Freeze,
    /// More noise: magnitude `[factor]`, at least 1.
    #[n(2)]
    Noise,
    /// A part of the view is hidden: magnitude `[share]`, 0 to 1.
    #[n(3)]
    Occlusion,
    /// A growing error: of localisation, magnitude `[east, north]` in metres per second; of height, `[up]`; of odometry, `[ahead]`, by
    /// which each speed is too great, -3 to 3.
    #[n(4)]
    Drift,
    /// A sudden error: of localisation, magnitude `[east, north]` in metres; of height, `[up]`; of odometry, `[ahead]`, all of it in
    /// one reading, -100 to 100.
    #[n(5)]
    Jump,
    /// A sudden error of the receiver's time: magnitude `[forwards]` in seconds, negative for a roll-back.
    #[n(60)]
    #[serde(alias = "time_step")]
    TimeStep,
    /// A growing error of the receiver's time: magnitude `[too fast]` in milliseconds a second.
    #[n(61)]
    #[serde(alias = "time_drift")]
    TimeDrift,
    /// A camera (colour, thermal) shows an earlier view under fresh stamps: magnitude `[frames]`, 4 to 32.
    #[n(62)]
    Skew,
    /// The colour stage finds a given number of weak detections in each frame: magnitude `[count]`, 12 to 32.
    #[n(63)]
    Chaff,
    /// The scene's `perturbation` is added to each colour image: magnitude `[strength]`, the largest change of a byte, of 255, 0
    /// to 100.
    #[n(64)]
    Perturbation,
    /// The speed of odometry times a factor: magnitude `[factor]`, 0 to 10.
    #[n(65)]
    Scale,
    /// A wandering error of localisation: east and north are each a Gauss-Markov process with a time constant of 60 s,
    /// zero at the start. Magnitude `[deviation]` in metres, 0 to 100.
    #[n(66)]
    Wander,
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

    /// True if `sensor` can have a fault of this kind.
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
}

/// Way in which a process is kept from running while it lives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Encode, Decode, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Suspension {
    /// The process does not run at all.
    #[n(0)]
    Hang,
    /// The process runs for a share of each period.
    #[n(1)]
    Slow {
        /// The share, permille.
        #[n(0)]
        quota: u16,
        /// The period.
        #[n(1)]
        period: Span,
    },
}
