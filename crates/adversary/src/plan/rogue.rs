//! Plan of a rogue on a host's shared memory: its messages on channels of other producers.

use serde::{Deserialize, Serialize};
use wire::core::Topic;
use wire::id::NodeId;

use super::{MAX_COUNT, MAX_HOLD_MS, MAX_MS, PlanError, at_most, check_range};

/// Largest coordinate or shift of a fabricated place, mm.
const MAX_PLACE: u64 = 1_000_000;

/// Plan of a process on a host's shared memory that is not the one it says it is. Without moves it only listens.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RogueConfig {
    /// Moves of the rogue, each on one channel.
    #[serde(default)]
    pub moves: Vec<RogueMove>,
}

/// A move: a run of messages on one channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RogueMove {
    /// Channel of the messages.
    pub topic: Topic,
    /// Producer that the messages claim to be of.
    pub producer: NodeId,
    /// Start, milliseconds.
    pub at_ms: u64,
    /// Duration, milliseconds.
    pub duration_ms: u64,
    /// Time between messages; of no effect where each genuine message sets one off.
    pub every_ms: u64,
    /// Message to send.
    pub says: Says,
}

/// Message of a rogue.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Says {
    /// The producer's last message, under a new header; if the rogue knows the message, with its time made new.
    Echo,
    /// A producer that lives and does no work: no track, and the last frame with its old stamps.
    Beat,
    /// A corroborated vehicle where there is none, every stage at work.
    Vehicle(Spot),
    /// A spot published as a synthetic product.
    Synthetic(Spot),
    /// A spot published as a product that is played back.
    PlayedBack(Spot),
    /// The last position heard, shifted.
    Elsewhere(Spot),
    /// Messages recorded at least a given number of milliseconds ago, byte for byte.
    Recorded {
        /// Age of it.
        lag_ms: u64,
    },
    /// Each genuine tracks message at once again, with a vehicle that is not there in place of those that are.
    Altered(Spot),
    /// Each genuine tracks message at once again, with its vehicles at this place under their own identities.
    Moved(Spot),
}

impl Says {
    /// True if each genuine message sets one off, and none is sent by time alone.
    pub(crate) fn waits(self) -> bool {
        matches!(self, Says::Altered(_) | Says::Moved(_))
    }
}

/// A place, or a shift, in the world frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spot {
    /// Place east, mm.
    pub x_mm: i32,
    /// Place north, mm.
    pub y_mm: i32,
}

impl RogueConfig {
    /// Every magnitude within its bounds.
    pub fn check(&self) -> Result<(), PlanError> {
        at_most(self.moves.len())?;
        self.moves.iter().try_for_each(RogueMove::check)
    }
}

impl RogueMove {
    fn check(&self) -> Result<(), PlanError> {
        check_range("at_ms", self.at_ms, 0, MAX_MS)?;
        check_range("duration_ms", self.duration_ms, 1, MAX_MS)?;
        check_range("every_ms", self.every_ms, 1, MAX_HOLD_MS)?;
        check_range("messages", self.count(), 1, u64::from(MAX_COUNT))?;
        match self.says {
            Says::Vehicle(at)
            | Says::Synthetic(at)
            | Says::PlayedBack(at)
            | Says::Elsewhere(at)
            | Says::Altered(at)
            | Says::Moved(at) => {
                check_range("x_mm", u64::from(at.x_mm.unsigned_abs()), 0, MAX_PLACE)?;
                check_range("y_mm", u64::from(at.y_mm.unsigned_abs()), 0, MAX_PLACE)
            }
            Says::Recorded { lag_ms } => check_range("lag_ms", lag_ms, 0, MAX_HOLD_MS),
            Says::Echo | Says::Beat => Ok(()),
        }
    }

    /// Number of messages that fit into its window.
    pub(crate) fn count(&self) -> u64 {
        self.duration_ms.div_ceil(self.every_ms.max(1))
    }
}
