//! Plan of the rogue station: whoever gives orders under a key that is not its own.

use serde::{Deserialize, Serialize};
use wire::command::CommandKind;
use wire::id::{NodeId, PeerId, UnitId};
use wire::settings::Settings;
use wire::setup::Secret;

use super::{MAX_MS, PlanError, Step, at_most, repeats, step, within};

/// Plan of the rogue station.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InsiderOperatorConfig {
    /// Whose signing key it holds.
    pub holds: NodeId,
    /// That key.
    pub secret: Secret,
    /// The certificate under which it publishes at the broker; without one it has a station of its own at the gateway.
    #[serde(default)]
    pub certificate: Option<PeerId>,
    /// Whom it orders.
    pub unit: UnitId,
    /// What it orders, and when.
    pub orders: Vec<RogueOrders>,
}

/// A run of orders of one kind.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RogueOrders {
    /// From when.
    pub at_ms: u64,
    /// How many.
    pub count: u32,
    /// Time between them.
    pub every_ms: u64,
    /// Under whose name.
    pub claim: NodeId,
    /// What is asked.
    pub demand: Demand,
    /// How far the counter is run ahead with each.
    #[serde(default)]
    pub ahead: u64,
    /// The step it is, when it waits for something or is waited for.
    #[serde(default)]
    pub step: Option<Step>,
}

/// What a rogue station asks for; the track is what it sees on the feed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Demand {
    /// To stop.
    Hold,
    /// To give up authority.
    Disarm,
    /// To begin.
    Enable,
    /// To go on after a stop.
    Resume,
    /// To take authority on the most confident vehicle.
    Arm,
    /// To use the authority that is held.
    Confirm,
    /// To set these values.
    Configure(Settings),
}

impl Demand {
    /// The command, with `seen` and `held` for the tracks that it takes; track 0 where there is none.
    pub fn kind(self, seen: wire::id::TrackId, held: wire::id::TrackId) -> CommandKind {
        match self {
            Demand::Hold => CommandKind::Hold,
            Demand::Disarm => CommandKind::Disarm,
            Demand::Enable => CommandKind::Enable,
            Demand::Resume => CommandKind::Resume,
            Demand::Arm => CommandKind::Arm(seen),
            Demand::Confirm => CommandKind::Confirm(held),
            Demand::Configure(settings) => CommandKind::Configure(settings),
        }
    }
}

impl InsiderOperatorConfig {
    /// Every magnitude within its bounds.
    pub fn check(&self) -> Result<(), PlanError> {
        at_most(self.orders.len())?;
        self.orders.iter().try_for_each(|run| {
            within("at_ms", run.at_ms, 0, MAX_MS)?;
            step::check(run.step)?;
            repeats(run.count, run.every_ms)
        })
    }
}
