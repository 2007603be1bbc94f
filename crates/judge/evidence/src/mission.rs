//! The mission that a scenario presumes: the operator's script, and its progress.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use wire::mode::Mode;
use wire::sensor::Class;

use crate::progress::Progress;
use crate::witnessed::Micros;

/// Act of an operator.
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
    /// Revoke an identity, by the authority's revocation that the console keeps.
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

    /// True if it leads away from safe, and so needs a reason.
    pub fn leads_away_from_safe(self) -> bool {
        match self {
            Verb::Enable | Verb::Arm | Verb::Confirm | Verb::Resume | Verb::Configure => true,
            Verb::Hold | Verb::Disarm | Verb::Revoke => false,
        }
    }
}

/// Progress of a mission.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Stage {
    /// No stage.
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

    /// Stage that a step of this verb leads to, once it is carried out.
    pub fn from_verb(verb: Verb) -> Stage {
        match verb {
            Verb::Enable => Stage::Enabled,
            Verb::Arm => Stage::Armed,
            Verb::Confirm => Stage::Acted,
            Verb::Hold | Verb::Resume | Verb::Disarm | Verb::Configure | Verb::Revoke => Stage::None,
        }
    }
}

/// The operator's script.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Script {
    /// Stage that the mission has to reach before the attack, where the scenario has one.
    pub mission: Option<Stage>,
    /// The steps that are orders, in order.
    pub steps: Vec<Due>,
}

/// One step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Due {
    /// Act.
    #[serde(rename = "do")]
    pub verb: Verb,
    /// Earliest time.
    pub at_us: Micros,
    /// Longest wait for its conditions.
    pub within_us: Micros,
    /// Time from the order until the unit is to carry it out, by its time tag; zero without one.
    pub after_us: Micros,
    /// The mode that has to be displayed.
    pub mode: Option<Mode>,
    /// The class of a track that has to be displayed.
    pub track: Option<Class>,
}

/// Progress of the mission.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Mission {
    /// Stage that it had to reach before the attack took hold; without an attack, before the end.
    #[serde(rename = "owed")]
    pub required: Stage,
    /// Missing parts of it, each in one line. With any of them, the trial shows no result.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<String>,
    /// Time at which authority was first held, milliseconds of the run.
    pub armed_ms: Option<f64>,
    /// Time at which the plant first acted.
    pub acted_ms: Option<f64>,
    /// Distance that the vehicle covered by the plant's truth, metres.
    pub driven_m: f64,
    /// Seconds in READY or PREPARE_TO_ACT.
    pub nominal_s: f64,
    /// Progress along the route; none for a unit without a route, and none in objects of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub progress: Option<Progress>,
    /// Result of each step of the operator.
    pub steps: Vec<Carried>,
}

impl Mission {
    /// True if the vehicle was stuck though its mode let it drive and way points were left.
    pub fn is_stuck(&self) -> bool {
        self.progress.as_ref().is_some_and(Progress::is_stuck)
    }
}

/// Result of a step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Carried {
    /// Act of the script.
    #[serde(rename = "do")]
    pub verb: Verb,
    /// Earliest time, milliseconds of the run.
    pub due_ms: f64,
    /// Time at which the unit carried it out; none where it never did.
    pub done_ms: Option<f64>,
    /// Reason that it never did.
    #[serde(default, rename = "why", skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}
