//! Condition of an action when a time on the clock is not enough: the word that an event has come to pass, or an
//! observation of the adversary from its own place.
//!
//! The knowledge of an adversary is the scenario's to say and its check's to hold; here everything is carried out.

use ground_truth::StepName;
use serde::{Deserialize, Serialize};
use wire::mode::Mode;

use super::{MAX_HOLD_MS, MAX_MS, PlanError, check_range};

/// Most datagrams or pieces that may be waited for.
pub const MAX_PASSES: u32 = 100_000;

/// The step that an action is a part of: its name, under which it is reported and called, and the event it waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlanStep {
    /// Name of the step.
    pub name: StepName,
    /// Event that has to come first; without it the action begins at its time.
    #[serde(default)]
    pub wait: Option<Wait>,
}

/// Event to wait for, and the delay from it to the action's beginning. Events before the action's time do not count.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wait {
    /// Event to wait for.
    pub on: On,
    /// Time from the event to the beginning, milliseconds.
    pub after_ms: u64,
}

/// Event that an action can wait for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum On {
    /// The word that the step may begin ([`wire::core::Input::Cue`]).
    Cue,
    /// A given number of datagrams or pieces have passed the action's way.
    Passes(u32),
    /// No traffic has passed the action's way for a given number of milliseconds.
    Silence(u64),
    /// The unit under test reports this mode to the team.
    Hears(Mode),
}

impl PlanStep {
    /// Every magnitude within its bounds.
    pub(super) fn check(&self) -> Result<(), PlanError> {
        let Some(wait) = self.wait else { return Ok(()) };
        check_range("after_ms", wait.after_ms, 0, MAX_MS)?;
        match wait.on {
            On::Cue | On::Hears(_) => Ok(()),
            On::Passes(count) => check_range("datagrams", u64::from(count), 1, u64::from(MAX_PASSES)),
            On::Silence(ms) => check_range("silence_ms", ms, 1, MAX_HOLD_MS),
        }
    }
}

/// The bounds of a step that may not be there.
pub(super) fn check(step: Option<PlanStep>) -> Result<(), PlanError> {
    step.map_or(Ok(()), |step| step.check())
}
