//! Direction in which an attack on a path works.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use wire::core::Side;

/// Direction of the datagrams or bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Direction {
    /// Path from the platform to the gateway.
    Up,
    /// Path from the gateway to the platform.
    Down,
    /// Both ways.
    #[default]
    Both,
}

impl Direction {
    /// True if it covers the way from the platform to the gateway.
    pub fn covers_up(self) -> bool {
        matches!(self, Direction::Up | Direction::Both)
    }

    /// True if it covers the way from the gateway to the platform.
    pub fn covers_down(self) -> bool {
        matches!(self, Direction::Down | Direction::Both)
    }

    /// The side that datagrams and publications of this direction go to; either without one.
    pub(crate) fn side(self) -> Option<Side> {
        match self {
            Direction::Up => Some(Side::Server),
            Direction::Down => Some(Side::Client),
            Direction::Both => None,
        }
    }

    /// The direction as an adversary's plan has it.
    pub(crate) fn planned(self) -> adversary::plan::Direction {
        match self {
            Direction::Up => adversary::plan::Direction::Up,
            Direction::Down => adversary::plan::Direction::Down,
            Direction::Both => adversary::plan::Direction::Both,
        }
    }
}
