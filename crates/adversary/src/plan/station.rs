//! Plan of the rogue station: it gives orders under a key that is not its own.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use wire::command::OrderKind;
use wire::id::{NodeId, PeerId, UnitId};
use wire::settings::Settings;
use wire::sign::Secret;

use super::{MAX_MS, PlanError, PlanStep, at_most, check_range, repeats, step};

/// Plan of the rogue station.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InsiderOperatorConfig {
    /// Node of the signing key that it holds.
    pub holds: NodeId,
    /// Secret of the stolen key.
    pub secret: Secret,
    /// The certificate under which it publishes at the broker; without one it has its own station at the gateway.
    #[serde(default)]
    pub certificate: Option<PeerId>,
    /// Whom it orders.
    pub unit: UnitId,
    /// Orders, with their times.
    pub orders: Vec<RogueOrders>,
}

/// A run of orders of one kind.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RogueOrders {
    /// Start, milliseconds.
    pub at_ms: u64,
    /// Number of orders.
    pub count: u32,
    /// Time between two of them, milliseconds.
    pub every_ms: u64,
    /// Operator that the orders claim to be of.
    pub claim: NodeId,
    /// Command asked for.
    pub order: OrderKind,
    /// The values, where it asks to set some.
    #[serde(default)]
    pub values: Option<Settings>,
    /// Steps by which the counter is run ahead with each.
    #[serde(default)]
    pub ahead: u64,
    /// Under which id.
    #[serde(default)]
    pub id: OrderId,
    /// On which track, to arm or to confirm.
    #[serde(default)]
    pub track: OrderTrack,
    /// The step it is, when it waits for something or is waited for.
    #[serde(default)]
    pub step: Option<PlanStep>,
}

/// Id of a rogue's order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum OrderId {
    /// The number after the newest.
    #[default]
    Next,
    /// The number that the unit counted last, which another order had.
    Last,
    /// The next number in a boot before the operator's.
    OlderBoot,
}

/// Track of a rogue's order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum OrderTrack {
    /// To arm the most confident vehicle, to confirm the one that authority is held on.
    #[default]
    Seen,
    /// The most confident vehicle on which no authority is held.
    Other,
}

impl InsiderOperatorConfig {
    /// Every magnitude within its bounds.
    pub fn check(&self) -> Result<(), PlanError> {
        at_most(self.orders.len())?;
        self.orders.iter().try_for_each(|run| {
            check_range("at_ms", run.at_ms, 0, MAX_MS)?;
            step::check(run.step)?;
            repeats(run.count, run.every_ms)
        })
    }
}
