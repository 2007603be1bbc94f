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
pub enum Kind {
    Hold,
    Disarm,
    Enable,
    Resume,
    Arm,
    Confirm,
    Configure,
}

impl Kind {
    /// The command, with the tracks that it arms on or confirms.
    pub fn command(self, arm: TrackId, confirm: TrackId, values: Option<Settings>) -> CommandKind {
        match self {
            Kind::Hold => CommandKind::Hold,
            Kind::Disarm => CommandKind::Disarm,
            Kind::Enable => CommandKind::Enable,
            Kind::Resume => CommandKind::Resume,
            Kind::Arm => CommandKind::Arm(arm),
            Kind::Confirm => CommandKind::Confirm(confirm),
            Kind::Configure => CommandKind::Configure(values.unwrap_or(BOLDEST)),
        }
    }
}

impl From<CommandKind> for Kind {
    fn from(kind: CommandKind) -> Self {
        match kind {
            CommandKind::Hold => Kind::Hold,
            CommandKind::Disarm => Kind::Disarm,
            CommandKind::Enable => Kind::Enable,
            CommandKind::Resume => Kind::Resume,
            CommandKind::Arm(_) => Kind::Arm,
            CommandKind::Confirm(_) => Kind::Confirm,
            CommandKind::Configure(_) => Kind::Configure,
        }
    }
}
