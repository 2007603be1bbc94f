//! Plan of the hostile broker: actions on publications at the broker that every client dials.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use wire::command::OrderKind;

use super::{Direction, MAX_COPIES, MAX_HOLD_MS, PlanError, Timed, at_most, check_range, repeats};

/// Plan of the holder of the broker's certificate and key. Without actions it is an honest broker.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InsiderBrokerConfig {
    /// Actions; where several are open, they apply in the order: drop, delay and reorder, duplicate.
    #[serde(default)]
    pub actions: Vec<Timed<BrokerAction>>,
}

/// Action on publications, or publications added beside them. Down is towards the units (orders), up towards the
/// gateway (acknowledgements).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum BrokerAction {
    /// Publications are not passed on.
    Drop {
        /// Kind of order that the action is limited to; absent: every publication.
        only: Option<OrderKind>,
    },
    /// Publications are passed on later.
    Delay {
        /// Delay, milliseconds.
        ms: u64,
        /// Kind of order that the action is limited to; absent: every publication.
        only: Option<OrderKind>,
    },
    /// Each publication is held until the next of its direction has passed.
    Reorder {
        /// Longest hold, milliseconds.
        hold_ms: u64,
    },
    /// Each publication is delivered more than once.
    Duplicate {
        /// Copies beside the original.
        copies: u32,
    },
    /// Captured publications are delivered again, the newest first and then back in turn.
    Replay {
        /// Number of publications.
        count: u32,
        /// Time between two of them, milliseconds.
        every_ms: u64,
    },
    /// The newest publication of a subject is delivered again to each subscriber that connects, as a retained one would
    /// be.
    Retain,
    /// Orders of the broker's own making.
    Invent {
        /// Command that they ask for.
        kind: OrderKind,
        /// Material that they are made of.
        forgery: OrderForgery,
        /// Number of orders.
        count: u32,
        /// Time between two of them, milliseconds.
        every_ms: u64,
    },
    /// For each order seen, the broker makes an acknowledgement of its execution.
    Forge {
        /// Material that it is made of.
        forgery: AckForgery,
    },
}

/// Kind of an invented order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum OrderForgery {
    /// A new intent in the operator's name, with the newest nonce seen, both steps under the broker's own key.
    OwnKey,
    /// The newest captured intent, altered to ask for another command under a later id, with its signature as it was.
    Altered,
    /// The newest captured intent with the confirmation of another.
    Spliced,
}

/// Kind of a forged acknowledgement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum AckForgery {
    /// An invented message under the broker's own key.
    OwnKey,
    /// The unit's newest acknowledgement, altered to be about this order, with its signature as it was.
    Altered,
    /// The unit's newest acknowledgement, unchanged.
    Replayed,
}

impl InsiderBrokerConfig {
    /// Every magnitude within its bounds.
    pub fn check(&self) -> Result<(), PlanError> {
        at_most(self.actions.len())?;
        self.actions.iter().try_for_each(|timed| {
            timed.check_window(timed.action.counted().is_none())?;
            timed.action.check(timed.direction)
        })
    }
}

impl BrokerAction {
    /// Number of publications that the action adds, and their spacing in ms; `None` for an action on passing ones.
    pub fn counted(&self) -> Option<(u32, u64)> {
        match *self {
            BrokerAction::Replay { count, every_ms } | BrokerAction::Invent { count, every_ms, .. } => {
                Some((count, every_ms))
            }
            BrokerAction::Drop { .. }
            | BrokerAction::Delay { .. }
            | BrokerAction::Reorder { .. }
            | BrokerAction::Duplicate { .. }
            | BrokerAction::Retain
            | BrokerAction::Forge { .. } => None,
        }
    }

    fn check(&self, direction: Direction) -> Result<(), PlanError> {
        match *self {
            BrokerAction::Drop { only: _ } | BrokerAction::Retain => Ok(()),
            BrokerAction::Delay { ms, only: _ } => check_range("ms", ms, 0, MAX_HOLD_MS),
            BrokerAction::Reorder { hold_ms } => check_range("hold_ms", hold_ms, 1, MAX_HOLD_MS),
            BrokerAction::Duplicate { copies } => check_range("copies", u64::from(copies), 1, u64::from(MAX_COPIES)),
            BrokerAction::Replay { count, every_ms } => repeats(count, every_ms),
            BrokerAction::Invent { count, every_ms, .. } => {
                one_way("invent", direction, Direction::Down)?;
                repeats(count, every_ms)
            }
            BrokerAction::Forge { forgery: _ } => one_way("forge", direction, Direction::Up),
        }
    }
}

/// An action that goes one way only; `Both` is read as that way.
fn one_way(what: &'static str, got: Direction, way: Direction) -> Result<(), PlanError> {
    if got == way || got == Direction::Both { Ok(()) } else { Err(PlanError::OneWay { what }) }
}
