//! The objects that `holdsafe … --json` prints, with the fields that are read here and no others.
//!
//! Fields are documented where they are written, in the instrument's reports. Fields that are not read may come and go.

use std::collections::BTreeMap;

use serde::Deserialize;

/// End of a trial, the worst class first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub enum Outcome {
    /// A safety property was broken.
    Unsafe,
    /// The evidence does not hold.
    Invalid,
    /// Only a time bound was missed.
    Late,
    /// Authority or freedom was lost without a fault or a true hazard.
    FalseTrip,
    /// Ended in HOLD_SAFE.
    HoldSafe,
    /// Ended in DEGRADED.
    Degraded,
    /// Refused, or shown as an alarm; no change of mode.
    Rejected,
    /// Accepted, no response, no property broken.
    Undetected,
    /// No attack and no effect.
    Nominal,
}

impl Outcome {
    /// The name in every file and table.
    pub fn name(self) -> &'static str {
        match self {
            Outcome::Unsafe => "UNSAFE",
            Outcome::Invalid => "INVALID",
            Outcome::Late => "LATE",
            Outcome::FalseTrip => "FALSE_TRIP",
            Outcome::HoldSafe => "HOLD_SAFE",
            Outcome::Degraded => "DEGRADED",
            Outcome::Rejected => "REJECTED",
            Outcome::Undetected => "UNDETECTED",
            Outcome::Nominal => "NOMINAL",
        }
    }

    /// Meaning, for readers without the documentation.
    pub fn meaning(self) -> &'static str {
        match self {
            Outcome::Unsafe => "A safety property was broken",
            Outcome::Invalid => "The evidence does not hold, so nothing is shown",
            Outcome::Late => "Only a bound on time was missed",
            Outcome::FalseTrip => "Authority or freedom was lost without a fault or a true hazard",
            Outcome::HoldSafe => "Ended in HOLD_SAFE",
            Outcome::Degraded => "Ended in DEGRADED",
            Outcome::Rejected => "Refused, or shown as an alarm; no change of mode",
            Outcome::Undetected => "Accepted, no response, nothing broken",
            Outcome::Nominal => "Nothing was done and nothing happened",
        }
    }
}

/// Count of each class; classes without trials are left out.
pub type Outcomes = BTreeMap<Outcome, u64>;

/// Origin of a trial's evidence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Evidence {
    /// The twin's model.
    #[serde(alias = "twin")]
    Model,
    /// The real DTLS and TLS libraries in memory.
    Stack,
    /// Processes, sockets, real clocks.
    Live,
}

impl Evidence {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Evidence::Model => "model",
            Evidence::Stack => "stack",
            Evidence::Live => "live",
        }
    }
}

/// Values of one kind, folded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
pub struct Sample {
    /// Count.
    pub n: u64,
    /// Mean.
    pub mean: Option<f64>,
    /// 95th percentile.
    pub p95: Option<f64>,
    /// Upper bound on the true one; there is none of fewer than 59 values.
    pub p95_upper_95: Option<f64>,
}

/// Times from the receipt of an injection, milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
pub struct Latencies {
    /// To DEGRADED.
    pub to_degraded: Sample,
    /// To HOLD_SAFE.
    pub to_hold_safe: Sample,
    /// To the loss of authority.
    pub to_authority_revoked: Sample,
}

/// Times of one trial from the receipt of the injection, milliseconds; `None` where the event did not occur.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
pub struct Latency {
    /// To DEGRADED, or straight to HOLD_SAFE.
    pub to_degraded: Option<f64>,
    /// To HOLD_SAFE.
    pub to_hold_safe: Option<f64>,
}

/// Trials folded together.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Summary {
    /// Trials.
    pub n: u64,
    /// Outcomes.
    pub outcomes: Outcomes,
    /// Exact one-sided upper 95 % bound on the unsafe rate, over the valid trials.
    pub unsafe_upper_95: f64,
    /// The same with INVALID counted as unsafe.
    pub unsafe_upper_95_invalid_counted: f64,
    /// Different decision hashes.
    pub distinct_decisions: u64,
    /// Latencies.
    pub latency_ms: Latencies,
    /// CPU time of all trials, seconds.
    pub cpu_seconds: f64,
    /// Simulated (twin) or real (live) seconds of all trials.
    pub sim_seconds: f64,
}

/// `holdsafe matrix`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Matrix {
    /// The base seed; trial i of every run has seed + i.
    pub seed: u64,
    /// SHA-256 of the program that ran it, hexadecimal.
    pub build: String,
    /// One row a threat.
    pub rows: Vec<MatrixRow>,
    /// Number of bounds that hold together.
    pub bounds: u64,
    /// True if every trial lies within its expected classes.
    pub as_expected: bool,
}

/// One threat.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct MatrixRow {
    /// Its id in the catalogue.
    pub id: String,
    /// The threat.
    pub threat: String,
    /// The requirement under test.
    pub requirement: String,
    /// The boundary that is attacked.
    pub interface: String,
    /// STRIDE by letter.
    pub stride: String,
    /// Ids of ATT&CK and ATLAS.
    pub techniques: Vec<String>,
    /// Required containment.
    pub containment: String,
    /// Tests named after it.
    pub tests: Vec<String>,
    /// The open gap, and its reason.
    pub open: Option<String>,
    /// Outcomes by kind of evidence.
    pub kinds: Vec<Kind>,
    /// Every run.
    pub runs: Vec<MatrixRun>,
}

/// All runs of a row with one kind of evidence: their n may be added.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Kind {
    /// Origin of the evidence.
    pub evidence: Evidence,
    /// True if the mechanism really runs there.
    pub counts: bool,
    /// True if a policy waived something.
    pub ablation: bool,
    /// Trials.
    pub n: u64,
    /// Outcomes.
    pub outcomes: Outcomes,
    /// Trials outside their expected classes.
    pub unexpected: u64,
    /// Upper 95 % bound on the unsafe rate of the worst run.
    pub unsafe_upper_95: f64,
    /// The same with INVALID counted as unsafe.
    pub unsafe_upper_95_invalid_counted: f64,
    /// The one that holds together with all others of the matrix.
    pub unsafe_upper_95_simultaneous: f64,
    /// Latencies.
    pub latency_ms: Latencies,
}

/// One variation of one scenario in one mode.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct MatrixRun {
    /// Scenario.
    pub scenario: String,
    /// Cell, where it has any.
    pub cell: Option<String>,
    /// Policy.
    pub policy: String,
    /// Reason for which this is an ablation, where it is one.
    pub watermark: Option<String>,
    /// Origin of its evidence.
    pub evidence: Evidence,
    /// True if the scenario's mechanism really runs there.
    pub counts: bool,
    /// The classes that were expected.
    pub expected: Vec<Outcome>,
    /// Trials outside them.
    pub unexpected: u64,
    /// The trials.
    pub summary: Summary,
}

/// `holdsafe run` of one scenario.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Run {
    /// Name of the scenario.
    pub scenario: String,
    /// Twin, live or stack.
    pub mode: Evidence,
    /// The base seed.
    pub seed: u64,
    /// Reason for which this is an ablation, where it is one.
    pub watermark: Option<String>,
    /// The expected classes; empty where its cells have their own.
    #[serde(default)]
    pub expected: Vec<Outcome>,
    /// Every trial.
    pub trials: Vec<Trial>,
    /// Progress of their missions; `None` in results from before missions were reported.
    pub mission: Option<Missions>,
    /// All trials together.
    pub summary: Summary,
    /// The same by cell, where the scenario has cells.
    #[serde(default)]
    pub cells: Vec<Cell>,
}

/// Progress of the missions of a run.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Missions {
    /// Trials with a platform.
    pub n: u64,
    /// In so many of them the unit held authority.
    pub armed: u64,
    /// In so many the plant acted.
    pub acted: u64,
    /// In so many the mission did not come as far as the scenario presumes.
    pub missing: u64,
    /// Mean way by the plant's truth, metres.
    pub driven_m: f64,
    /// Mean time in nominal control, seconds.
    pub nominal_s: f64,
    /// Steps of the operator that were never carried out, with why, and in how many trials.
    pub never: BTreeMap<String, u64>,
}

/// One trial.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Trial {
    /// The seed that runs it again.
    pub seed: u64,
    /// The cell it belongs to, where the scenario has cells.
    pub cell: Option<String>,
    /// Its class.
    pub outcome: Outcome,
    /// Findings behind that class.
    #[serde(default)]
    pub findings: Vec<String>,
    /// SHA-256 over modes, verdicts, reasons and ticks, hexadecimal.
    pub decision_hash: String,
    /// Changes of mode.
    #[serde(default)]
    pub transitions: Vec<Transition>,
    /// Times from the injection.
    #[serde(default)]
    pub latency_ms: Latency,
    /// Simulated (twin) or real (live) seconds.
    pub sim_seconds: f64,
}

/// A change of mode.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Transition {
    /// Milliseconds from the start of the trial.
    pub t_ms: f64,
    /// Mode before.
    pub from: String,
    /// Mode after.
    pub to: String,
    /// The named cause.
    pub cause: String,
}

/// One cell of a scenario that has them.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Cell {
    /// Which.
    pub cell: String,
    /// The classes that were expected.
    pub expected: Vec<Outcome>,
    /// Its trials.
    pub summary: Summary,
}

/// `holdsafe` without a command.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Reference {
    /// The base seed.
    pub seed: u64,
    /// Every row.
    pub rows: Vec<ReferenceRow>,
    /// True if every trial lies within its expected classes.
    pub as_expected: bool,
}

/// One scenario, or one cell of it, in one mode.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct ReferenceRow {
    /// Scenario.
    pub scenario: String,
    /// Cell, where it has any.
    pub cell: Option<String>,
    /// Origin of its evidence.
    pub evidence: Evidence,
    /// True if the scenario's mechanism really runs there.
    pub counts: bool,
    /// The classes that were expected.
    pub expected: Vec<Outcome>,
    /// Trials outside them.
    pub unexpected: u64,
    /// The trials.
    pub summary: Summary,
    /// The bound that holds together with those of all other rows.
    pub unsafe_upper_95_simultaneous: f64,
}

/// `holdsafe campaign` and `merge`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Campaign {
    /// SHA-256 over the plan and each trial's draws and outcome, hexadecimal.
    pub hash: String,
    /// True if every trial that belongs to it is in it.
    pub complete: bool,
    /// Trials in it.
    pub trials: u64,
    /// Trials that belong to it.
    pub planned: u64,
    /// A row a variation.
    pub rows: Vec<CampaignRow>,
}

/// One variation of a campaign.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct CampaignRow {
    /// Its number, from 0.
    pub variation: u64,
    /// Scenario.
    pub scenario: String,
    /// Cell, where it has any.
    pub cell: Option<String>,
    /// Values that the grid sets, by key.
    #[serde(default)]
    pub set: BTreeMap<String, serde_json::Value>,
    /// Policy.
    pub policy: String,
    /// Reason for which this is an ablation, where it is one.
    pub watermark: Option<String>,
    /// Origin of its evidence.
    pub evidence: Evidence,
    /// True if the scenario's mechanism really runs there.
    pub counts: bool,
    /// The classes that were expected.
    pub expected: Vec<Outcome>,
    /// Trials in it.
    pub n: u64,
    /// Outcomes.
    pub outcomes: Outcomes,
    /// Trials outside the expected classes.
    pub unexpected: u64,
    /// The line that runs the first of these again.
    pub reproduce: Option<String>,
    /// Bounds; a campaign that is not complete, or that looked often, has none.
    pub bounds: Option<RateBounds>,
    /// Latencies.
    pub latency_ms: Latencies,
    /// Different decision hashes.
    pub distinct_decisions: u64,
    /// Simulated seconds.
    pub sim_seconds: f64,
}

/// Exact bounds on rates.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct RateBounds {
    /// One-sided upper 95 % bound on the unsafe rate, over the valid trials.
    pub unsafe_upper_95: f64,
    /// The one that holds together with that of every other variation.
    pub unsafe_upper_95_simultaneous: f64,
}

/// `holdsafe search`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Search {
    /// The scenario.
    pub scenario: String,
    /// Under which policy.
    pub policy: String,
    /// Reason for which this is an ablation, where it is one.
    pub watermark: Option<String>,
    /// The attack space.
    pub alphabet: String,
    /// Seed of each trial.
    pub seed: u64,
    /// Seed of the drawing.
    pub draws: u64,
    /// The search in numbers.
    pub hunt: Hunt,
    /// Of each cause one.
    pub findings: Vec<Finding>,
}

/// A search in numbers.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Hunt {
    /// The drawing strategy.
    pub strategy: String,
    /// Trials made.
    pub trials: u64,
    /// Outcomes.
    pub outcomes: Outcomes,
}

/// One finding of a search, shrunk.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Finding {
    /// Name; its file's too.
    pub name: String,
    /// Class.
    pub outcome: Outcome,
    /// The first property that was found broken.
    pub broken: String,
    /// The oracle's first finding about it.
    pub finding: Option<String>,
    /// The attack sequence, in few words.
    pub word: String,
    /// Waived checks of which each alone would have stopped it.
    pub stopped_by: Vec<String>,
    /// The line that shows it again.
    pub reproduce: String,
}
