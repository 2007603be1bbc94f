//! Orders that a rogue or a hostile broker gives, or picks out among others.

use adversary::plan::OrderKind;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// An order of an adversary that is no operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
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
    /// To set values.
    Configure,
}

impl Order {
    /// The order as an adversary's plan has it.
    pub fn kind(self) -> OrderKind {
        match self {
            Order::Enable => OrderKind::Enable,
            Order::Arm => OrderKind::Arm,
            Order::Confirm => OrderKind::Confirm,
            Order::Hold => OrderKind::Hold,
            Order::Resume => OrderKind::Resume,
            Order::Disarm => OrderKind::Disarm,
            Order::Configure => OrderKind::Configure,
        }
    }

    /// The request of the order, by its name in the log.
    pub(crate) fn request_name(self) -> &'static str {
        match self {
            Order::Hold => "hold",
            Order::Disarm => "disarm",
            Order::Enable => "enable",
            Order::Resume => "resume",
            Order::Arm => "arm",
            Order::Confirm => "confirm",
            Order::Configure => "configure",
        }
    }
}
