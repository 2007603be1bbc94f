//! Commands of an adversary's orders: from the planned kind and the tracks seen.

use wire::command::{CommandKind, OrderKind};
use wire::id::TrackId;
use wire::settings::Settings;

/// The boldest values that are legal one by one: set if a plan names none.
const BOLDEST: Settings = Settings { speed_mm_s: 3000, margin_mm: 300, arm_permille: 500, keep_permille: 300 };

/// The command of a kind, with the tracks that it arms on or confirms.
pub(crate) fn command(kind: OrderKind, arm: TrackId, confirm: TrackId, values: Option<Settings>) -> CommandKind {
    match kind {
        OrderKind::Hold => CommandKind::Hold,
        OrderKind::Disarm => CommandKind::Disarm,
        OrderKind::Enable => CommandKind::Enable,
        OrderKind::Resume => CommandKind::Resume,
        OrderKind::Arm => CommandKind::Arm(arm),
        OrderKind::Confirm => CommandKind::Confirm(confirm),
        OrderKind::Configure => CommandKind::Configure(values.unwrap_or(BOLDEST)),
    }
}
