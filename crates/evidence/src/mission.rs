//! The mission that a scenario presumes: what the operator was to do, and how far it came.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use wire::mode::Mode;
use wire::sensor::Class;

use crate::witnessed::Micros;

/// What an operator can do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Verb {
    /// Idle to ready.
    Enable,
    /// Take authority on the track that `when_track` found.
    Arm,
    /// Use the authority held: the abstract act.
    Confirm,
    /// To hold-safe; one step, from any state.
    Hold,
    /// Consent to leave hold-safe.
    Resume,
    /// Give authority back.
    Disarm,
    /// Set values for the mission; in idle only.
    Configure,
    /// Have an identity struck from the roll, by the authority's revocation that the console keeps.
    Revoke,
}

impl Verb {
    /// Its name in files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Verb::Enable => "enable",
            Verb::Arm => "arm",
            Verb::Confirm => "confirm",
            Verb::Hold => "hold",
            Verb::Resume => "resume",
            Verb::Disarm => "disarm",
            Verb::Configure => "configure",
            Verb::Revoke => "revoke",
        }
    }

    /// Whether it leads away from safe, and so needs a reason.
    pub fn leads_away_from_safe(self) -> bool {
        match self {
            Verb::Enable | Verb::Arm | Verb::Confirm | Verb::Resume | Verb::Configure => true,
            Verb::Hold | Verb::Disarm | Verb::Revoke => false,
        }
    }
}

/// How far a mission comes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Stage {
    /// Nowhere.
    #[default]
    None,
    /// The unit was enabled: READY.
    Enabled,
    /// It held authority: PREPARE_TO_ACT.
    Armed,
    /// The plant acted.
    Acted,
}

impl Stage {
    /// Its name in every file and table.
    pub fn name(self) -> &'static str {
        match self {
            Stage::None => "none",
            Stage::Enabled => "enabled",
            Stage::Armed => "armed",
            Stage::Acted => "acted",
        }
    }

    /// Where a step leads that is carried out.
    pub fn of(verb: Verb) -> Stage {
        match verb {
            Verb::Enable => Stage::Enabled,
            Verb::Arm => Stage::Armed,
            Verb::Confirm => Stage::Acted,
            Verb::Hold | Verb::Resume | Verb::Disarm | Verb::Configure | Verb::Revoke => Stage::None,
        }
    }
}

/// What the operator was to do.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Script {
    /// How far the mission has to come before the attack, where the scenario says so.
    pub mission: Option<Stage>,
    /// The steps that are orders, in order.
    pub steps: Vec<Due>,
}

/// One step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Due {
    /// What is done.
    #[serde(rename = "do")]
    pub verb: Verb,
    /// From when on, at the earliest.
    pub at_us: Micros,
    /// For how long its conditions are waited for.
    pub within_us: Micros,
    /// The mode that has to be displayed.
    pub mode: Option<Mode>,
    /// The class of a track that has to be displayed.
    pub track: Option<Class>,
}

/// How far the mission came.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Mission {
    /// How far it had to come before the attack took hold; without an attack, before the end.
    pub owed: Stage,
    /// What was owed and is missing, each in one line. Where there is any, the trial shows nothing.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<String>,
    /// When authority was first held, milliseconds of the run.
    pub armed_ms: Option<f64>,
    /// When the plant first acted.
    pub acted_ms: Option<f64>,
    /// Way that the vehicle went by the plant's truth, metres.
    pub driven_m: f64,
    /// Seconds in READY or PREPARE_TO_ACT.
    pub nominal_s: f64,
    /// What became of each step of the operator.
    pub steps: Vec<Carried>,
}

/// What became of a step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Carried {
    /// What was to be done.
    #[serde(rename = "do")]
    pub verb: Verb,
    /// From when on, milliseconds of the run.
    pub due_ms: f64,
    /// When the unit carried it out; nothing where it never did.
    pub done_ms: Option<f64>,
    /// Why it never did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
}
