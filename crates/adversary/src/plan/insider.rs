//! Plan of the insider who is a teammate and forwards a third unit's telemetry.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::peer::{Confusion, Falsehood, Resend};
use super::step::{self, PlanStep};
use super::{MAX_HOLD_MS, MAX_MS, PlanError, at_most, check_range, repeats};

/// Largest coordinate or speed of a claimed place, mm or mm/s.
const MAX_PLACE: u64 = 1_000_000;

/// Plan of the insider who holds teammate B's credentials. With only a place it is an honest B.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InsiderTeammateConfig {
    /// Place that B claims.
    pub place: ClaimedMotion,
    /// Treatment of C's telemetry; several at once each send it on.
    #[serde(default)]
    pub forwards: Vec<Forward>,
    /// Records that are authenticated and broken.
    #[serde(default)]
    pub malformed: Vec<Malformed>,
    /// Records of one session sent again in the next.
    #[serde(default)]
    pub resend: Option<Resend>,
    /// Untrue claims of B's place and motion.
    #[serde(default)]
    pub falsehoods: Vec<Falsehood>,
    /// Reports of another product mode or time base.
    #[serde(default)]
    pub confusions: Vec<Confusion>,
}

/// A claimed place and constant velocity, world frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClaimedMotion {
    /// East at the start of the core, mm.
    pub x_mm: i32,
    /// Place north, mm.
    pub y_mm: i32,
    /// Velocity east, mm/s.
    #[serde(default)]
    pub vx_mm_s: i32,
    /// Velocity north, mm/s.
    #[serde(default)]
    pub vy_mm_s: i32,
}

/// Way of forwarding C's telemetry.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Forward {
    /// Form of the forwarded report.
    pub form: Form,
    /// Start, milliseconds.
    pub at_ms: u64,
    /// Duration, milliseconds.
    pub duration_ms: u64,
    /// Time for which each report is held before it is forwarded.
    #[serde(default)]
    pub lag_ms: u64,
    /// True if B's own reports go on beside the forwarded ones.
    #[serde(default = "yes")]
    pub own_reports: bool,
    /// Step that the action is a part of, where it has a name.
    #[serde(default)]
    pub step: Option<PlanStep>,
}

fn yes() -> bool {
    true
}

/// Form in which B forwards C's telemetry.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Form {
    /// The record says C and is C's.
    Verbatim,
    /// The record says B, with B's boot, sequence and stamp, and keeps C's signature, which no longer verifies.
    Relabelled,
    /// The record says B, with B's boot, sequence and stamp, and is signed by B.
    ReSigned,
}

/// A run of broken records in B's session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Malformed {
    /// Start, milliseconds.
    pub at_ms: u64,
    /// The flaws, taken in turn; at least one.
    pub flaws: Vec<Flaw>,
    /// Number of records.
    pub count: u32,
    /// Time between two of them, milliseconds.
    pub every_ms: u64,
    /// Step that the action is a part of, where it has a name.
    #[serde(default)]
    pub step: Option<PlanStep>,
}

/// Flaw of a malformed record.
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

impl InsiderTeammateConfig {
    /// Every magnitude within its bounds.
    pub fn check(&self) -> Result<(), PlanError> {
        let ClaimedMotion { x_mm, y_mm, vx_mm_s, vy_mm_s } = self.place;
        for (what, value) in [("x_mm", x_mm), ("y_mm", y_mm), ("vx_mm_s", vx_mm_s), ("vy_mm_s", vy_mm_s)] {
            check_range(what, u64::from(value.unsigned_abs()), 0, MAX_PLACE)?;
        }
        for forward in &self.forwards {
            check_range("at_ms", forward.at_ms, 0, MAX_MS)?;
            check_range("duration_ms", forward.duration_ms, 1, MAX_MS)?;
            check_range("lag_ms", forward.lag_ms, 0, MAX_HOLD_MS)?;
            step::check(forward.step)?;
        }
        self.resend.iter().try_for_each(Resend::check)?;
        at_most(self.forwards.len() + self.malformed.len() + self.falsehoods.len() + self.confusions.len())?;
        self.falsehoods.iter().try_for_each(Falsehood::check)?;
        self.confusions.iter().try_for_each(Confusion::check)?;
        self.malformed.iter().try_for_each(|run| {
            check_range("at_ms", run.at_ms, 0, MAX_MS)?;
            check_range("flaws", run.flaws.len() as u64, 1, 8)?;
            step::check(run.step)?;
            repeats(run.count, run.every_ms)
        })
    }
}
