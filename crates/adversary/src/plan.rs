//! Plan of an adversary: timed actions, fixed before the run, every magnitude bounded.
//!
//! Times are milliseconds from the start of the core on the adversary's own clock; an action may also wait for
//! something ([`PlanStep`]). A plan without actions is the null attack: a passive adversary in the path. Turning a
//! scenario into plans is left to `topology`; the effect of an action on bytes, to `relay` and `insider`.

use config::setup::NoChannel;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use wire::core::Side;

mod broker;
mod gateway;
mod insider;
mod medium;
pub(crate) mod order;
mod peer;
mod recorder;
mod relay;
mod rogue;
mod station;
mod step;
mod takeover;

pub use broker::{AckForgery, BrokerAction, InsiderBrokerConfig, OrderForgery};
pub use gateway::{FeedAction, FeedForgery, InsiderGatewayConfig};
pub use insider::{ClaimedMotion, Flaw, Form, Forward, InsiderTeammateConfig, Malformed};
pub use medium::{MAX_STRETCHES, Medium, Stretch};
pub use peer::{Confusion, Falsehood, MotionClaim, Product, Resend};
pub use recorder::Tampering;
pub use relay::{Damage, DatagramAction, DatagramRelayConfig, InjectedContent, StreamAction, StreamRelayConfig};
pub use rogue::{RogueConfig, RogueMove, Says, Spot};
pub use station::{InsiderOperatorConfig, OrderId, OrderTrack, RogueOrders};
pub use step::{MAX_PASSES, On, PlanStep, Wait};
pub use takeover::{SessionThiefConfig, Takeover};

/// Longest time in a plan, ms: an hour.
pub const MAX_MS: u64 = 3_600_000;
/// Longest time for which one datagram, piece or report is held back, ms.
pub const MAX_HOLD_MS: u64 = 60_000;
/// Most repetitions of one action.
pub const MAX_COUNT: u32 = 10_000;
/// Most copies beside an original.
pub const MAX_COPIES: u32 = 64;
/// Most actions of one plan.
pub const MAX_ACTIONS: usize = 128;

/// Role of an adversary process, and its plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum AdversaryConfig {
    /// A relay in the telemetry path, without a key.
    DatagramRelay(DatagramRelayConfig),
    /// A relay in the command path, without a key.
    StreamRelay(StreamRelayConfig),
    /// The holder of teammate B's credentials.
    InsiderTeammate(InsiderTeammateConfig),
    /// The holder of a signing key that is not its own.
    InsiderOperator(InsiderOperatorConfig),
    /// The holder of the broker's credentials, in the broker's place.
    InsiderBroker(InsiderBrokerConfig),
    /// The holder of the gateway's keys, between it and the console.
    InsiderGateway(InsiderGatewayConfig),
    /// On a host's shared memory, in another's name.
    Rogue(RogueConfig),
    /// The holder of a copy of another's certificate.
    SessionThief(SessionThiefConfig),
}

/// Reason that a plan is not carried out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PlanError {
    /// A magnitude is outside its bounds.
    #[error("{what}: {min} to {max} expected, got {got}")]
    Magnitude {
        /// Name of the field.
        what: &'static str,
        /// Smallest value.
        min: u64,
        /// Largest value.
        max: u64,
        /// The value in the plan.
        got: u64,
    },
    /// More actions than one plan may hold.
    #[error("at most {max} actions expected, got {got}")]
    Actions {
        /// Most actions of one plan.
        max: usize,
        /// The number in the plan.
        got: usize,
    },
    /// The action can only go towards the server.
    #[error("{what} goes up only")]
    UpOnly {
        /// Name of the action.
        what: &'static str,
    },
    /// The setup lacks a channel that the plan needs.
    #[error(transparent)]
    Channel(#[from] NoChannel),
    /// The action goes the other way only.
    #[error("{what} goes the other way only")]
    OneWay {
        /// Name of the action.
        what: &'static str,
    },
}

/// Direction of the datagrams or bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Direction {
    /// From the platform to the gateway.
    Up,
    /// From the gateway to the platform.
    Down,
    /// Up and down.
    #[default]
    Both,
}

impl Direction {
    /// True if it covers traffic towards `side`.
    pub fn covers(self, side: Side) -> bool {
        match (self, side) {
            (Direction::Both, Side::Client | Side::Server)
            | (Direction::Up, Side::Server)
            | (Direction::Down, Side::Client) => true,
            (Direction::Up, Side::Client) | (Direction::Down, Side::Server) => false,
        }
    }

    /// The side that datagrams and publications of this direction go to; either without one.
    pub fn side(self) -> Option<Side> {
        match self {
            Direction::Up => Some(Side::Server),
            Direction::Down => Some(Side::Client),
            Direction::Both => None,
        }
    }

    /// The covered sides, as destinations.
    pub fn destinations(self) -> impl Iterator<Item = Side> {
        [Side::Server, Side::Client].into_iter().filter(move |side| self.covers(*side))
    }
}

/// An action with its window.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Timed<A> {
    /// Start of the window; of an action that waits, the earliest.
    pub start_ms: u64,
    /// Length of the window; zero only for an action that happens once, or a counted number of times.
    #[serde(default)]
    pub duration_ms: u64,
    /// Direction of the traffic that the action applies to.
    #[serde(default)]
    pub direction: Direction,
    /// The step it is a part of, where that has a name.
    #[serde(default)]
    pub step: Option<PlanStep>,
    /// Action to take.
    pub action: A,
}

impl<A> Timed<A> {
    /// Bounds of the window itself; `lasting` when the action needs one.
    fn check_window(&self, lasting: bool) -> Result<(), PlanError> {
        check_range("start_ms", self.start_ms, 0, MAX_MS)?;
        check_range("duration_ms", self.duration_ms, u64::from(lasting), MAX_MS)?;
        step::check(self.step)
    }
}

/// A magnitude within its bounds.
fn check_range(what: &'static str, got: u64, min: u64, max: u64) -> Result<(), PlanError> {
    if (min..=max).contains(&got) { Ok(()) } else { Err(PlanError::Magnitude { what, min, max, got }) }
}

/// A probability in permille.
fn share(name: &'static str, permille: u16) -> Result<(), PlanError> {
    check_range(name, u64::from(permille), 0, 1000)
}

/// A number of repetitions and the time between them.
fn repeats(count: u32, every_ms: u64) -> Result<(), PlanError> {
    check_range("count", u64::from(count), 1, u64::from(MAX_COUNT))?;
    check_range("every_ms", every_ms, 0, MAX_HOLD_MS)
}

/// No more actions than allowed.
fn at_most(got: usize) -> Result<(), PlanError> {
    if got <= MAX_ACTIONS { Ok(()) } else { Err(PlanError::Actions { max: MAX_ACTIONS, got }) }
}
