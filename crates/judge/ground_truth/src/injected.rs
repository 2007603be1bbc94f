//! Injected faults and attacks: an adversary's actions, a sensor's faults, a process that is kept from running.
//!
//! Planning it is left to scenarios; doing it to `adversary`, `sim` and the launcher.

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
    /// Emitted it again at once.
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

/// A sensor that a fault can befall.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode, serde::Serialize, serde::Deserialize,
)]
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
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode, serde::Serialize, serde::Deserialize,
)]
#[cbor(index_only)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// No readings.
    #[n(0)]
    Dropout,
    /// The reading from the start of the fault, under fresh stamps.
    #[n(1)]
    Freeze,
    /// More noise.
    #[n(2)]
    Noise,
    /// Something opaque before the sensor.
    #[n(3)]
    Occlusion,
    /// A slowly growing offset.
    #[n(4)]
    Drift,
    /// A sudden offset.
    #[n(5)]
    Jump,
    /// A sudden offset of the receiver's time.
    #[n(60)]
    TimeStep,
    /// A growing offset of the receiver's time.
    #[n(61)]
    TimeDrift,
    /// Readings of some time ago, under fresh stamps.
    #[n(62)]
    Skew,
    /// Many weak detections.
    #[n(63)]
    Chaff,
    /// A pattern over the whole image.
    #[n(64)]
    Perturbation,
    /// Readings times a factor.
    #[n(65)]
    Scale,
    /// An offset that wanders about zero.
    #[n(66)]
    Wander,
}

/// Way in which a process is kept from running while it lives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Encode, Decode, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Suspension {
    /// It is suspended entirely.
    #[n(0)]
    Hang,
    /// It runs for a share of each period.
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
