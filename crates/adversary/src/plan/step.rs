//! What an action waits for when a time on the clock is not enough: the word that something has come to pass, or what
//! the adversary sees from its own place.
//!
//! How much an adversary may know of is the scenario's to say and its check's to hold; here everything is carried out.

use serde::{Deserialize, Serialize};
use wire::mode::Mode;
use wire::step::StepName;

use super::{MAX_HOLD_MS, MAX_MS, PlanError, within};

/// Most datagrams or pieces that may be waited for.
pub const MAX_PASSES: u32 = 100_000;

/// The step that an action is a part of: its name, under which it is told and called, and what it waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Step {
    /// Its name.
    pub name: StepName,
    /// What has to come first; without it the action begins at its time.
    #[serde(default)]
    pub wait: Option<Wait>,
}

/// What has to come, and how long after that the action begins. Nothing counts that comes before the action's time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wait {
    /// What.
    pub on: On,
    /// And so long after it.
    pub after_ms: u64,
}

/// What an action can wait for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum On {
    /// The word that the step may begin ([`wire::core::Input::Cue`]).
    Cue,
    /// So many datagrams or pieces have passed the action's way.
    Passes(u32),
    /// Nothing has passed the action's way for so many milliseconds.
    Silence(u64),
    /// The unit under test reports this mode to the team.
    Hears(Mode),
}

impl Step {
    /// Every magnitude within its bounds.
    pub(super) fn check(&self) -> Result<(), PlanError> {
        let Some(wait) = self.wait else { return Ok(()) };
        within("after_ms", wait.after_ms, 0, MAX_MS)?;
        match wait.on {
            On::Cue | On::Hears(_) => Ok(()),
            On::Passes(count) => within("datagrams", u64::from(count), 1, u64::from(MAX_PASSES)),
            On::Silence(ms) => within("silence_ms", ms, 1, MAX_HOLD_MS),
        }
    }
}

/// The bounds of a step that may not be there.
pub(super) fn check(step: Option<Step>) -> Result<(), PlanError> {
    step.map_or(Ok(()), |step| step.check())
}
