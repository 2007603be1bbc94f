//! The three ways to run a trial; trials of different ways are never counted together.

use scenario::Evidence;
use serde::{Deserialize, Serialize};

/// Clock and place of a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// A twin: one thread on a virtual clock.
    Twin,
    /// Processes, sockets, real clocks.
    Live,
    /// The real DTLS and TLS libraries between two ends in memory.
    Stack,
}

impl Mode {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Mode::Twin => "twin",
            Mode::Live => "live",
            Mode::Stack => "stack",
        }
    }

    /// Origin of the evidence of a trial in this mode.
    pub fn evidence(self) -> Evidence {
        match self {
            Mode::Twin => Evidence::Model,
            Mode::Live => Evidence::Live,
            Mode::Stack => Evidence::Stack,
        }
    }

    /// True if the mechanism of a scenario runs in this mode, when its real place is `place`.
    pub fn counts_for(self, place: Evidence) -> bool {
        self.evidence() != Evidence::Model || place == Evidence::Model
    }
}
