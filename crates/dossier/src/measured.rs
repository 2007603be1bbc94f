//! The objects of measurements (`bench`, `curve`, `ablate`), with the fields that are read here and no others; see [`objects`](crate::objects).

use serde::Deserialize;

use crate::objects::{Outcome, Outcomes, Run, Sample};

/// `lab live`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct BenchLive {
    /// Live runs of each loss.
    pub losses: Vec<Run>,
    /// Beside the paper's.
    pub live_latency_ms: Vec<LiveLatency>,
    /// The relay in the path without an attack, live.
    pub live_null_attack: Option<Run>,
    /// The same for hours in the twin, at 2 % loss.
    pub twin_null_attack_at_2_percent_loss: Option<Run>,
}

impl BenchLive {
    /// Everything that was run.
    pub fn runs(&self) -> impl Iterator<Item = &Run> {
        self.losses.iter().chain(&self.live_null_attack).chain(&self.twin_null_attack_at_2_percent_loss)
    }
}

/// Latencies of one loss, and the paper's.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct LiveLatency {
    /// Scenario.
    pub scenario: String,
    /// Ours.
    pub live: LiveSample,
    /// The paper's.
    pub paper: Paper,
}

/// Ours.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct LiveSample {
    /// To DEGRADED.
    pub to_degraded: Sample,
}

/// The paper's.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Paper {
    /// The loss, in the paper's words.
    pub loss: String,
    /// Runs.
    pub n: u64,
    /// Mean time to degraded, milliseconds.
    pub mean_ms: f64,
}

/// `holdsafe campaign curve`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Curve {
    /// Scenario.
    pub scenario: String,
    /// Title.
    pub title: String,
    /// Unit of the values.
    pub unit: String,
    /// The base seed of each point.
    pub seed: u64,
    /// Reasons for which a line is an ablation.
    #[serde(default)]
    pub watermarks: Vec<String>,
    /// The detector that took the shipped one's place, by its SHA-256.
    #[serde(default)]
    pub detector: Option<String>,
    /// One line a cell.
    pub lines: Vec<CurveLine>,
}

/// One line.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct CurveLine {
    /// The cell, where there are any.
    pub cell: Option<String>,
    /// The policy.
    pub policy: String,
    /// Its points.
    pub points: Vec<CurvePoint>,
    /// Values read off it.
    pub reading: Reading,
}

/// One point.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct CurvePoint {
    /// The value.
    pub value: f64,
    /// Noticed or refused, and no harm.
    pub detected: Share,
    /// Harm.
    pub harmed: Share,
}

/// Values read off a line.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct Reading {
    /// The smallest value at which every trial was noticed and none was harmed.
    pub smallest_detected_before_harm: Option<f64>,
    /// The smallest value at which some trial was harmed.
    pub smallest_harmful: Option<f64>,
}

/// A share with its exact two-sided 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct Share {
    /// Number of hits.
    pub hits: u64,
    /// Of how many.
    pub n: u64,
    /// The observed share; `None` without trials.
    pub share: Option<f64>,
    /// Lower end.
    pub lower_95: f64,
    /// Upper end.
    pub upper_95: f64,
}

/// `holdsafe ablate`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Ablation {
    /// Watermark of every run of it.
    pub watermark: String,
    /// The base seed.
    pub seed: u64,
    /// Attacks.
    pub attacks: u64,
    /// Pairs of each check and attack.
    pub trials: u64,
    /// Each check.
    pub checks: Vec<Check>,
    /// Number of disabled checks that were noticed.
    pub defects: Defects,
}

/// One check.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Check {
    /// Its place in a policy file.
    pub check: String,
    /// `alone`, `pair` or `none`.
    pub worth: String,
    /// Attacks in which anything differs without it.
    pub attacks: Vec<Attacked>,
    /// Its cost without an attack.
    pub quiet: Option<Quiet>,
}

/// One attack without one check.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Attacked {
    /// Scenario.
    pub scenario: String,
    /// Cell.
    pub cell: Option<String>,
    /// The classes that were expected.
    pub expected: Vec<Outcome>,
    /// Outcomes with the check.
    pub with: Outcomes,
    /// Outcomes without it.
    pub without: Outcomes,
}

/// The null attack on a lossy link, with a check and without.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct Quiet {
    /// Simulated hours of each.
    pub hours: f64,
    /// False trips an hour, with and without.
    pub false_trips_per_hour: [f64; 2],
    /// CPU seconds a simulated hour, with and without.
    pub cpu_seconds_per_hour: [f64; 2],
}

/// Each check disabled in turn.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Defects {
    /// Checks disabled.
    pub n: u64,
    /// Of these noticed.
    pub found: u64,
}

/// `lab twin`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct TwinCost {
    /// The scenario.
    pub scenario: String,
    /// True if sensors were rendered.
    pub rendered: bool,
    /// First seed.
    pub seed: u64,
    /// Repetitions.
    pub rounds: u64,
    /// Trials in each.
    pub trials: u64,
    /// Simulated seconds a CPU second.
    pub per_cpu_second: Spread,
    /// CPU of the twin over CPU of bare rapier.
    pub ratio: Spread,
    /// By stage, CPU microseconds a simulated second.
    pub stages: Vec<Stage>,
}

/// Least, middle and greatest.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct Spread {
    /// Least.
    pub min: f64,
    /// Middle.
    pub median: f64,
    /// Greatest.
    pub max: f64,
}

/// One stage.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Stage {
    /// Its name.
    pub stage: String,
    /// CPU microseconds a simulated second.
    pub us: f64,
    /// Share of the twin's.
    pub share: f64,
}
