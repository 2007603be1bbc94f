//! Observations: terms of the display and of a judge of teammates.

use minicbor::{Decode, Encode};

/// State of a shown value against its limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[cbor(index_only)]
pub enum Freshness {
    /// Within its limit.
    #[n(0)]
    Fresh,
    /// Beyond the limit by one period at most.
    #[n(1)]
    Late,
    /// Not to be relied on.
    #[n(2)]
    Stale,
    /// The source of the value is gone.
    #[n(3)]
    Lost,
}

/// Progress of a command according to the display.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[cbor(index_only)]
pub enum ShownAs {
    /// Asked of the gateway.
    #[n(0)]
    Requested,
    /// Waiting at the gateway for the operator's confirmation.
    #[n(1)]
    Staged,
    /// Confirmed by the operator.
    #[n(2)]
    Released,
    /// On its way to the unit.
    #[n(3)]
    Sent,
    /// Executed by the unit.
    #[n(4)]
    Executed,
    /// Refused by the unit.
    #[n(5)]
    Refused,
    /// Refused by the gateway, or waited too long there.
    #[n(6)]
    Void,
    /// Not answered in time: an alarm.
    #[n(7)]
    NotAcknowledged,
    /// Stored by the unit until its time.
    #[n(8)]
    Stored,
}

/// Contradiction in a teammate's claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Encode, Decode, serde::Serialize)]
#[serde(rename_all = "snake_case")]
#[cbor(index_only)]
pub enum Inconsistency {
    /// Movement faster than the body allows.
    #[n(0)]
    Kinematics,
    /// Two units claim one place.
    #[n(1)]
    Exclusion,
    /// The teammate's own sequence or stamps run backwards, or two sources claim the same report sequence.
    #[n(2)]
    TimeBase,
    /// Over many claims the place does not go where the claimed speed and heading lead.
    #[n(55)]
    Residual,
}

impl Inconsistency {
    /// Name in logs and in words.
    pub fn name(self) -> &'static str {
        match self {
            Inconsistency::Kinematics => "kinematics",
            Inconsistency::Exclusion => "exclusion",
            Inconsistency::TimeBase => "time base",
            Inconsistency::Residual => "residual",
        }
    }
}
