//! Command that an adversary asks for in an order, before it knows of which track.

use serde::{Deserialize, Serialize};
use wire::command::CommandKind;
use wire::id::TrackId;
use wire::settings::Settings;

/// The boldest values that are legal one by one: set if a plan names none.
const BOLDEST: Settings = Settings { speed_mm_s: 3000, margin_mm: 300, arm_permille: 500, keep_permille: 300 };

/// Command that an order asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[expect(missing_docs, reason = "named as in `wire::command::CommandKind`")]
pub enum OrderKind {
    Hold,
    Disarm,
    Enable,
    Resume,
    Arm,
    Confirm,
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
