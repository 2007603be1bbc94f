//! The operator's script: each step waits for its time and for its displayed conditions, then acts.
//!
//! A step away from safe is staged, confirmed and signed twice by the operator core; the script names it once. The operator sees
//! only the console's display. The operator core that follows the script, with its own key, is not here; nor are the requirements
//! of a verb in the state machine.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use evidence::mission::Verb;
use wire::mode::Mode;
use wire::settings::Settings;

use super::value::{List, Located, Name, Real, Seconds, Text, Whole};
use wire::sensor::Class;

/// The operator and the script.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Operator {
    /// Identity of the signing key.
    pub name: Name,
    /// Cycles across an object from which half of all observers can tell a fake (`console::eye`); without it the operator uses
    /// the machine.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub identification_cycles: Option<Real<500, 64_000>>,
    /// The steps, in order.
    pub step: List<Step, 32>,
}

impl Default for Operator {
    fn default() -> Self {
        Self { name: Name::constant("operator-1"), identification_cycles: None, step: List::default() }
    }
}

/// One step: at its time at the earliest, once its conditions are displayed, it acts; a step that never comes true is
/// passed over when the next one's time has come and its own patience is over.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Step {
    /// Earliest time on the trial's clock.
    pub at_s: Located<Seconds>,
    /// Longest wait for the conditions after that.
    #[serde(default = "patience")]
    pub within_s: Seconds,
    /// The state that has to be displayed.
    #[serde(default)]
    pub when_state: Option<Mode>,
    /// The class of a track that has to be displayed, fresh and corroborated.
    #[serde(default)]
    pub when_track: Option<Class>,
    /// The operator's action.
    #[serde(rename = "do")]
    pub verb: Located<Verb>,
    /// The values, for configuring.
    #[serde(default)]
    pub values: Option<Values>,
    /// The identity to be revoked.
    #[serde(default)]
    pub who: Option<Name>,
    /// Time from the order until the unit is to carry it out, by its own clock; absent: at once.
    #[serde(default)]
    pub after_s: Option<Located<Seconds>>,
    /// Time from then on within which the unit may carry it out.
    #[serde(default = "window")]
    pub window_s: Seconds,
    /// The reason; needed for every step away from safe.
    #[serde(default)]
    pub reason: Option<Text<64>>,
}

fn patience() -> Seconds {
    Seconds::constant(2.0)
}

fn window() -> Seconds {
    Seconds::constant(1.0)
}

/// Settings that an operator makes before a mission, each value within its range (`wire::settings`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Values {
    /// Largest speed.
    pub speed_mm_s: Whole<500, 3_000>,
    /// Distance that is kept to the fence beyond the stopping distance.
    pub margin_mm: Whole<300, 5_000>,
    /// Confidence from which a track can be designated.
    pub arm_permille: Whole<500, 950>,
    /// Confidence below which a designated track is given up.
    pub keep_permille: Whole<300, 900>,
}

impl Values {
    /// As a command carries them.
    pub fn settings(self) -> Settings {
        Settings {
            speed_mm_s: self.speed_mm_s.unsigned() as u16,
            margin_mm: self.margin_mm.unsigned() as u16,
            arm_permille: self.arm_permille.unsigned() as u16,
            keep_permille: self.keep_permille.unsigned() as u16,
        }
    }
}
