//! The reference evaluation: one row a scenario (or cell) and mode, and live latencies beside the paper's.

use std::borrow::Cow;

use evidence::SCHEMA_VERSION;
use evidence::trial::{Outcome, Trial};
use scenario::{Evidence, Scenario};
use serde::{Deserialize, Serialize};
use stats::{LEVEL, Sample, rate_upper, simultaneous_level};

use super::AcceptedRate;
use super::run::{LatencySummary, RunObject, Summary};
use crate::mode::Mode;

/// The paper's figures, five runs a row, on other hardware and another topology.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PaperRow {
    /// Our scenario.
    pub scenario: Cow<'static, str>,
    /// The lost part.
    pub loss: Cow<'static, str>,
    /// Runs.
    pub n: u32,
    /// Mean time to degraded.
    pub mean_ms: f64,
    /// Stated bound of the 95th percentile.
    pub p95_below_ms: f64,
}

/// The paper's rows.
pub const PAPER: [PaperRow; 2] = [
    PaperRow {
        scenario: Cow::Borrowed("thermal_loss"),
        loss: Cow::Borrowed("thermal processing"),
        n: 5,
        mean_ms: 511.0,
        p95_below_ms: 1700.0,
    },
    PaperRow {
        scenario: Cow::Borrowed("rgb_loss"),
        loss: Cow::Borrowed("RGB detector"),
        n: 5,
        mean_ms: 957.0,
        p95_below_ms: 1700.0,
    },
];

/// The whole evaluation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// Version of this object.
    pub schema_version: u32,
    /// The base seed.
    pub seed: u64,
    /// Every row.
    pub rows: Vec<ReferenceRow>,
    /// Live latencies beside the paper's.
    pub live_latency_ms: Vec<LiveLatency>,
    /// True if every trial of every row lies within its expected classes; a trial that is not judged does not.
    pub as_expected: bool,
}

/// One scenario, or one cell of it, in one mode.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReferenceRow {
    /// Scenario.
    pub scenario: String,
    /// Platform, where it is not the scenario's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub platform: Option<String>,
    /// Cell, where it has any.
    pub cell: Option<String>,
    /// Origin of this row's evidence.
    pub evidence: Evidence,
    /// True if that is where the scenario's mechanism runs; where not, its n is no evidence of the mechanism.
    pub counts: bool,
    /// Twin or live.
    pub mode: Mode,
    /// True if the sensors were rendered and the detector ran.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub rendered: bool,
    /// The classes that were expected.
    pub expected: Vec<Outcome>,
    /// Judged trials outside them.
    pub unexpected: u64,
    /// Other classes that the scenario accepts below a rate, each held against the trials.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub accepted: Vec<AcceptedRate>,
    /// Stalls by the host in each trial that it spoilt, milliseconds: these are INVALID, not judged, and no evidence about the
    /// platform. Live only.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub not_judged_ms: Vec<f64>,
    /// The trials.
    pub summary: Summary,
    /// Upper bound on the unsafe rate that holds together with the bounds of all other rows.
    pub unsafe_upper_95_simultaneous: f64,
}

/// Live latencies to degraded, beside the paper's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LiveLatency {
    /// Scenario.
    pub scenario: String,
    /// Ours.
    pub live: LatencySummary,
    /// The paper's.
    pub paper: PaperRow,
}

impl ReferenceRow {
    /// One row of `trials`, all of the same scenario, cell, mode and sensing, on its own platform or another one.
    pub fn new(
        scenario: &Scenario,
        (platform, cell): (Option<String>, Option<String>),
        (mode, rendered): (Mode, bool),
        trials: &[&Trial],
    ) -> Self {
        let expected = scenario.expected.to_vec();
        let judged = trials.iter().filter(|t| t.host_stall_ms.is_none());
        let unexpected = judged.filter(|t| t.outcome.is_unexpected(&expected)).count() as u64;
        let not_judged_ms = trials.iter().filter_map(|t| t.host_stall_ms).collect();
        let (evidence, counts) = (mode.evidence(), mode.counts_for(scenario.evidence));
        let summary = Summary::from_trials(trials);
        let accepted = AcceptedRate::from_outcomes(scenario, &summary.outcomes);
        let bound = summary.unsafe_upper_95;
        let name = scenario.name.as_str().to_owned();
        Self {
            scenario: name,
            platform,
            cell,
            evidence,
            counts,
            mode,
            rendered,
            expected,
            unexpected,
            accepted,
            not_judged_ms,
            summary,
            unsafe_upper_95_simultaneous: bound,
        }
    }

    /// True if every trial was judged and lies within the expected classes, or in one that is accepted at a rate which stands.
    pub fn is_as_expected(&self) -> bool {
        self.unexpected == AcceptedRate::trials(&self.accepted) && self.not_judged_ms.is_empty()
    }

    /// Scenario, platform and cell.
    pub fn name(&self) -> String {
        let parts = [Some(&self.scenario), self.platform.as_ref(), self.cell.as_ref()];
        parts.into_iter().flatten().map(String::as_str).collect::<Vec<_>>().join(" ")
    }
}

impl Reference {
    /// Puts the rows together and widens their bounds to hold at once.
    pub fn new(seed: u64, mut rows: Vec<ReferenceRow>) -> Self {
        let level = simultaneous_level(rows.len(), LEVEL);
        for row in &mut rows {
            let count = |class: Outcome| row.summary.outcomes.get(&class).copied().unwrap_or(0);
            let valid = row.summary.n as u64 - count(Outcome::Invalid);
            row.unsafe_upper_95_simultaneous = rate_upper(count(Outcome::Unsafe), valid, level);
        }
        let as_expected = rows.iter().all(ReferenceRow::is_as_expected);
        let live_latency_ms = PAPER.iter().filter_map(|paper| LiveLatency::from_rows(paper, &rows)).collect();
        Self { schema_version: SCHEMA_VERSION, seed, rows, live_latency_ms, as_expected }
    }
}

impl LiveLatency {
    fn from_rows(paper: &PaperRow, rows: &[ReferenceRow]) -> Option<Self> {
        let row = rows
            .iter()
            .find(|row| row.mode == Mode::Live && row.scenario == paper.scenario && row.platform.is_none())?;
        Some(Self { scenario: row.scenario.clone(), live: row.summary.latency_ms, paper: paper.clone() })
    }

    /// Latency from a live run of one of the paper's scenarios, such as `bench live` makes.
    pub fn of_run(run: &RunObject) -> Option<Self> {
        let paper = PAPER.iter().find(|paper| run.mode == Mode::Live && paper.scenario == run.scenario)?;
        Some(Self { scenario: run.scenario.clone(), live: run.summary.latency_ms, paper: paper.clone() })
    }

    /// Ours to degraded.
    pub fn to_degraded(&self) -> &Sample {
        &self.live.to_degraded
    }
}
