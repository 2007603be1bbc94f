//! Jump targets in a recording: changes of the display, and true events.
//!
//! The latter are the instrument's knowledge. They reach the viewer of a recording, and no running console.

use serde::{Deserialize, Serialize};
use wire::person::Alarm;
use wire::time::Span;

use crate::alarm;
use crate::shown::Shown;
use crate::wording;

/// Moments of either kind that are kept, at most.
pub const MAX_MOMENTS: usize = 256;

/// A moment of a recording to jump to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Moment {
    /// Time since the recording's beginning.
    pub at: Span,
    /// The change or event.
    pub what: String,
    /// True if the moment is a true event; false for a change of the display.
    pub truth: bool,
}

/// Something that really happened, as it is kept beside a recording.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Happened {
    /// On the console's clock, microseconds.
    pub at_us: u64,
    /// Description of the event.
    pub what: String,
}

/// True if a unit that was shown before is shown in another mode.
pub(crate) fn mode_changed(before: &Shown, after: &Shown) -> bool {
    let mode = |shown: &Shown, unit| shown.unit(unit).map(|unit| unit.state.get().0.mode);
    before.units.iter().any(|unit| mode(before, unit.unit) != mode(after, unit.unit))
}

/// Jump targets between two pictures: another mode with its cause, a new alarm, an answered command.
pub(crate) fn changes(before: &Shown, after: &Shown) -> Vec<String> {
    let mut changes = Vec::new();
    for unit in &after.units {
        let (state, _) = unit.state.get();
        let was = before.unit(unit.unit).map(|unit| unit.state.get().0.mode);
        if was != Some(state.mode) {
            let failing: Vec<&str> = state.failing.iter().map(|guard| wording::guard(state.suite(), guard)).collect();
            let failing = if failing.is_empty() { String::new() } else { format!(", failing {}", failing.join(", ")) };
            let [why, _] = state.why(&after.bounds);
            changes.push(format!("{} {}: {why}{failing}", unit.unit, state.mode.name()));
        }
    }
    let known = |cause: &Alarm| before.alarms.iter().any(|group| group.cause == *cause);
    let tells_mode = |cause: &Alarm| matches!(cause, Alarm::HoldSafe(_) | Alarm::Degraded(_) | Alarm::GuardLost(..));
    let raised = after.alarms.iter().filter(|group| !known(&group.cause) && !tells_mode(&group.cause));
    changes.extend(raised.map(|group| alarm::words(&group.cause, group.suite, true)));
    let new = after.commands.iter().filter(|command| before.command(&command.intent).is_none());
    changes.extend(new.map(|command| {
        let giver = command.by.words();
        format!("{} to {} given by {giver}", command.kind.name(), command.unit)
    }));
    changes
}
