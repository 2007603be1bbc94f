//! Command that an adversary asks for in an order, before it knows of which track.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use wire::command::CommandKind;
use wire::id::TrackId;
use wire::settings::Settings;

/// The boldest values that are legal one by one: set if a plan names none.
const BOLDEST: Settings = Settings { speed_mm_s: 3000, margin_mm: 300, arm_permille: 500, keep_permille: 300 };

/// Order of an adversary that is no operator, before it is known which track it is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum OrderKind {
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

impl OrderKind {
    /// The command, with the tracks that it arms on or confirms.
    pub fn command(self, arm: TrackId, confirm: TrackId, values: Option<Settings>) -> CommandKind {
        match self {
            OrderKind::Hold => CommandKind::Hold,
            OrderKind::Disarm => CommandKind::Disarm,
            OrderKind::Enable => CommandKind::Enable,
            OrderKind::Resume => CommandKind::Resume,
            OrderKind::Arm => CommandKind::Arm(arm),
            OrderKind::Confirm => CommandKind::Confirm(confirm),
            OrderKind::Configure => CommandKind::Configure(values.unwrap_or(BOLDEST)),
        }
    }

    /// Its request, by the name in the log.
    pub fn request(self) -> &'static str {
        match self {
            OrderKind::Hold => "hold",
            OrderKind::Disarm => "disarm",
            OrderKind::Enable => "enable",
            OrderKind::Resume => "resume",
            OrderKind::Arm => "arm",
            OrderKind::Confirm => "confirm",
            OrderKind::Configure => "configure",
        }
    }
}

impl From<CommandKind> for OrderKind {
    fn from(kind: CommandKind) -> Self {
        match kind {
            CommandKind::Hold => OrderKind::Hold,
            CommandKind::Disarm => OrderKind::Disarm,
            CommandKind::Enable => OrderKind::Enable,
            CommandKind::Resume => OrderKind::Resume,
            CommandKind::Arm(_) => OrderKind::Arm,
            CommandKind::Confirm(_) => OrderKind::Confirm,
            CommandKind::Configure(_) => OrderKind::Configure,
        }
    }
}
