//! Modes of the platform, the guards that hold them up, and the causes that change them.

use minicbor::{Decode, Encode};
use strum::{EnumCount, IntoStaticStr, VariantArray};

use crate::id::{CommandId, FrameId, RecordId, UnitId};
use crate::sensor::Modality;
use crate::time::Instant;

/// The mode of the autonomy state machine.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
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
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
#[derive(EnumCount, VariantArray, IntoStaticStr)]
#[strum(serialize_all = "SCREAMING_SNAKE_CASE")]
pub enum Mode {
    /// Standing, not yet enabled.
    #[default]
    #[n(0)]
    Idle,
    /// Driving the mission under supervision.
    #[n(1)]
    Ready,
    /// Holding one-shot authority on one track.
    #[n(2)]
    PrepareToAct,
    /// A subsystem is lost: no authority, reduced speed.
    #[n(3)]
    Degraded,
    /// Trust is lost: standing still until an operator consents.
    #[n(4)]
    HoldSafe,
}

impl Mode {
    /// Every mode.
    pub const ALL: [Mode; Mode::COUNT] = *Mode::VARIANTS.first_chunk().expect("as many variants as it counts");

    /// Name as displayed.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// A condition that nominal control stands on.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode, serde::Serialize, serde::Deserialize,
)]
#[cbor(index_only)]
#[serde(rename_all = "snake_case")]
#[derive(EnumCount, VariantArray, IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum Guard {
    /// Fresh product of the colour detector.
    #[n(0)]
    Rgb,
    /// Fresh product of the depth stage.
    #[n(1)]
    Depth,
    /// Fresh product of the thermal stage.
    #[n(2)]
    Thermal,
    /// Fresh product of the LiDAR stage.
    #[n(3)]
    Lidar,
    /// Fresh track messages.
    #[n(4)]
    Tracks,
    /// Fresh localisation whose motion agrees with odometry.
    #[n(5)]
    Localisation,
    /// Inside the fence with the stopping distance to spare.
    #[n(6)]
    Geofence,
    /// An unexpired supervision lease.
    #[n(7)]
    Lease,
    /// Teammates' claims agree with each other, with physics and with their time base.
    #[n(8)]
    Teammates,
    /// The recorder has sealed the unit's log within the limit.
    #[n(9)]
    SealedLog,
    /// The designated track is fresh, corroborated and confident. Authority only.
    #[n(10)]
    Designation,
    /// Localisation does not drift away from odometry.
    #[n(60)]
    Drift,
    /// The receiver's time runs with this host's clock.
    #[n(61)]
    TimeBase,
}

impl Guard {
    /// Every guard, in the order of a set's bits.
    pub const ALL: [Guard; Guard::COUNT] = *Guard::VARIANTS.first_chunk().expect("as many variants as it counts");

    /// The guard over a perception stage.
    pub fn from_modality(modality: Modality) -> Guard {
        match modality {
            Modality::Rgb => Guard::Rgb,
            Modality::Depth => Guard::Depth,
            Modality::Thermal => Guard::Thermal,
            Modality::Lidar => Guard::Lidar,
        }
    }

    /// Name in policies and logs.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// A set of guards.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode)]
#[cbor(transparent)]
pub struct Guards(#[n(0)] pub u16);

impl Guards {
    /// The set with one guard more.
    #[must_use]
    pub fn with_guard(self, g: Guard) -> Guards {
        Guards(self.0 | 1 << g as u16)
    }

    /// True if `g` is in the set.
    pub fn contains(self, g: Guard) -> bool {
        self.0 & (1 << g as u16) != 0
    }

    /// True if the set is empty.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The members, in order.
    pub fn iter(self) -> impl Iterator<Item = Guard> {
        Guard::ALL.into_iter().filter(move |g| self.contains(*g))
    }

    /// Members that are also in `other`.
    #[must_use]
    pub fn and(self, other: Guards) -> Guards {
        Guards(self.0 & other.0)
    }
}

/// Names of the guards, for people and for other programs.
impl serde::Serialize for Guards {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.iter())
    }
}

/// Reason that a mode changed or authority ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Encode, Decode)]
pub enum Cause {
    /// The process started.
    #[default]
    #[n(0)]
    Start,
    /// The operator asked for it.
    #[n(1)]
    Operator,
    /// A guard failed.
    #[n(2)]
    Lost(#[n(0)] Guard),
    /// All guards have held for the hysteresis time.
    #[n(3)]
    Recovered,
    /// The authority was used.
    #[n(4)]
    Acted,
    /// The authority was not used in time.
    #[n(5)]
    Expired,
    /// A loss was not made good within the bound to HOLD_SAFE.
    #[n(6)]
    Unrecovered(#[n(0)] Guard),
}

impl Cause {
    /// Name in logs, such as `lost:thermal`.
    pub fn label(self) -> String {
        match self {
            Cause::Start => "start".into(),
            Cause::Operator => "operator".into(),
            Cause::Lost(g) => format!("lost:{}", g.name()),
            Cause::Recovered => "recovered".into(),
            Cause::Acted => "acted".into(),
            Cause::Expired => "expired".into(),
            Cause::Unrecovered(g) => format!("unrecovered:{}", g.name()),
        }
    }
}

/// A cause is serialised as its label.
impl serde::Serialize for Cause {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.label())
    }
}

/// The first link of the chain behind a transition: the record, frame, command or silence it goes back to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Encode, Decode, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Because {
    /// No cause outside the machine itself.
    #[default]
    #[n(0)]
    Itself,
    /// A record of a session.
    #[n(1)]
    Record(#[n(0)] RecordId),
    /// A sensor frame.
    #[n(2)]
    Frame(#[n(0)] FrameId),
    /// An operator's command.
    #[n(3)]
    Command(#[n(0)] CommandId),
    /// No message since then.
    #[n(4)]
    Silence(#[n(0)] Instant),
    /// A teammate's claim.
    #[n(5)]
    Claim(#[n(0)] UnitId),
}
