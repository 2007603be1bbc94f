//! Plans of an admitted teammate's statements that are old, untrue or of another kind.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use wire::sensor::ProductMode;

use super::{MAX_HOLD_MS, MAX_MS, PlanError, check_range, repeats};

/// Largest speed of a lie, mm/s.
const MAX_SPEED: u64 = 100_000;
/// Largest angle, mrad.
const MAX_ANGLE: u64 = 7_000;

/// B ends its session, dials again and sends the records of the one before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Resend {
    /// Time at which the session ends.
    pub at_ms: u64,
    /// Number of records sent once the next one stands: the newest first, each whole and then its report alone.
    pub count: u32,
    /// Time between two of them, milliseconds.
    pub every_ms: u64,
    /// True if B has a later boot from then on, and counts from the beginning.
    pub restart: bool,
}

/// B claims to be where, or to move as, it does not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Falsehood {
    /// Start, milliseconds.
    pub at_ms: u64,
    /// Duration, milliseconds.
    pub duration_ms: u64,
    /// Speed of the drift, mm/s.
    pub drift_mm_s: u32,
    /// Direction of the drift, mrad from east to north.
    pub towards_mrad: i32,
    /// Part of it that the claimed motion shows.
    pub motion: MotionClaim,
}

/// Relation of the claimed motion to the claimed place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MotionClaim {
    /// The place drifts; speed and heading are the true ones.
    Hidden,
    /// The place drifts; speed and heading are those that go with it.
    Owned,
    /// The place is the true one; speed and heading are not.
    Feigned,
}

/// B's reports are of another product mode, or stamped in another time base.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Confusion {
    /// Start, milliseconds.
    pub at_ms: u64,
    /// Duration, milliseconds.
    pub duration_ms: u64,
    /// The product mode that the reports name.
    pub product: Product,
    /// Lead of their stamps over B's clock.
    pub clock_ms: i64,
}

/// Claimed origin of a report's content.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Product {
    /// A product made now.
    Live,
    /// A product of a generator.
    Synthetic,
    /// A recorded product.
    Replayed,
}

impl Product {
    /// Mode as reports name it.
    pub fn mode(self) -> ProductMode {
        match self {
            Product::Live => ProductMode::Live,
            Product::Synthetic => ProductMode::Synthetic,
            Product::Replayed => ProductMode::Replay,
        }
    }
}

impl Resend {
    pub(super) fn check(&self) -> Result<(), PlanError> {
        check_range("at_ms", self.at_ms, 0, MAX_MS)?;
        repeats(self.count, self.every_ms)
    }
}

impl Falsehood {
    pub(super) fn check(&self) -> Result<(), PlanError> {
        check_range("at_ms", self.at_ms, 0, MAX_MS)?;
        check_range("duration_ms", self.duration_ms, 1, MAX_MS)?;
        check_range("drift_mm_s", u64::from(self.drift_mm_s), 0, MAX_SPEED)?;
        check_range("towards_mrad", u64::from(self.towards_mrad.unsigned_abs()), 0, MAX_ANGLE)
    }
}

impl Confusion {
    pub(super) fn check(&self) -> Result<(), PlanError> {
        check_range("at_ms", self.at_ms, 0, MAX_MS)?;
        check_range("duration_ms", self.duration_ms, 1, MAX_MS)?;
        check_range("clock_ms", self.clock_ms.unsigned_abs(), 0, MAX_HOLD_MS)
    }
}
