//! Teammates, and insiders among them: holders of valid credentials who do what their role does not allow.
//!
//! An insider is an identity of its own beside the honest units; no service knows which one it is.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::scene::Pose;
use super::timed::timed;
use super::value::{Count, List, Located, Millis, Name, Seconds};

/// A teammate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Unit {
    /// `unit-b`, `unit-c` or `unit-d`; `unit-a` is the platform under test.
    pub name: Located<Name>,
    /// What it is.
    pub role: Role,
    /// Where it starts.
    pub start: Pose,
}

/// What a teammate is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// It reports itself.
    Honest,
    /// It holds valid credentials and misuses them.
    Insider,
}

timed! {
    /// An admitted teammate B forwards a third unit C's telemetry: the paper's central finding.
    Teammate lasts duration_s needs Insider sees Insider {
        /// How it forwards.
        form: Forwarding,
        /// Whether C itself reports meanwhile.
        c: ThirdUnit,
        /// Length.
        duration_s: Seconds,
        /// Age of C's telemetry when it is forwarded.
        #[serde(default)]
        lag_ms: Millis,
    }
}

/// How B forwards C's telemetry.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Forwarding {
    /// The record says C and is C's.
    Verbatim,
    /// The record says B, C's signature is kept.
    Relabelled,
    /// The record says B and is signed by B.
    ReSigned,
}

/// Whether C reports while B forwards its telemetry.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ThirdUnit {
    /// It reports.
    Present,
    /// Its own telemetry stops when the forwarding starts.
    Silent,
}

timed! {
    /// An admitted teammate sends records that are authenticated and broken.
    Malformed needs Insider sees Insider {
        /// The flaws, taken in turn.
        flaws: Located<List<Flaw, 8>>,
        /// How many records.
        count: Count,
        /// Time between them.
        every_ms: Millis,
    }
}

/// What is wrong with a malformed record.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Flaw {
    /// Longer than any record may be.
    Length,
    /// Not the schema.
    Schema,
    /// Not the one canonical encoding.
    NonCanonical,
    /// A value outside its range.
    Range,
    /// A list that claims more elements than there are bytes.
    Count,
    /// Random bytes.
    Noise,
    /// Sound, but for the session that it says it is of.
    Session,
    /// Sound, but of another version of the session layer.
    Version,
    /// Sound, its sequence far ahead of the one before; the sender goes on from there.
    Jump,
    /// Sound, around a report that says it is of an identity that is no vehicle.
    Origin,
}
