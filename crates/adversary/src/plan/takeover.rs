//! Plan of the thief of a session at the broker.

use serde::{Deserialize, Serialize};
use wire::id::PeerId;

use super::step::{self, PlanStep};
use super::{MAX_MS, PlanError, at_most, check_range};

/// Plan of a thief who holds a copy of a certificate and takes that identity's session at the broker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SessionThiefConfig {
    /// Peer of the certificate it holds.
    pub certificate: PeerId,
    /// Times at which it has the session.
    pub takeovers: Vec<Takeover>,
}

/// A time during which the thief holds the session, or fights for it with the owner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Takeover {
    /// Start, milliseconds.
    pub at_ms: u64,
    /// Duration, milliseconds.
    pub duration_ms: u64,
    /// Step that the action is a part of, where it has a name.
    #[serde(default)]
    pub step: Option<PlanStep>,
}

impl SessionThiefConfig {
    /// Every magnitude within its bounds.
    pub fn check(&self) -> Result<(), PlanError> {
        at_most(self.takeovers.len())?;
        self.takeovers.iter().try_for_each(|takeover| {
            check_range("at_ms", takeover.at_ms, 0, MAX_MS)?;
            check_range("duration_ms", takeover.duration_ms, 1, MAX_MS)?;
            step::check(takeover.step)
        })
    }
}
