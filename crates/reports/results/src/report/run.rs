//! The object that `holdsafe run --json` prints for one scenario.

use std::collections::{BTreeMap, BTreeSet};

use evidence::SCHEMA_VERSION;
use evidence::trial::{Latency, Outcome, Outcomes, Trial};
use serde::{Deserialize, Serialize};
use stats::{LEVEL, Sample, events_upper, rate_upper};

use super::mission::MissionSummary;
use crate::mode::Mode;

/// All trials of one scenario in one mode.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunObject {
    /// Version of this object.
    pub schema_version: u32,
    /// Name of the scenario.
    pub scenario: String,
    /// Twin, live or stack.
    pub mode: Mode,
    /// The base seed; trial i has seed + i.
    pub seed: u64,
    /// The platform in place of the scenario's own, as it was named.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub platform: Option<String>,
    /// Reason for which this is an ablation, where it is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub watermark: Option<String>,
    /// SHA-256 of the detector in place of the shipped one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub detector: Option<String>,
    /// The expected classes; empty where the cells have their own.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub expected: Vec<Outcome>,
    /// Every trial, in order of cell and seed.
    pub trials: Vec<Trial>,
    /// Progress of their missions.
    #[serde(default)]
    pub mission: MissionSummary,
    /// All trials together.
    pub summary: Summary,
    /// Summaries by cell, where the scenario has cells.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cells: Vec<CellSummary>,
}

/// Runs of several scenarios, as one object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunsObject {
    /// Version of this object.
    pub schema_version: u32,
    /// Twin or live.
    pub mode: Mode,
    /// The base seed.
    pub seed: u64,
    /// A run a scenario.
    pub runs: Vec<RunObject>,
}

/// Trials folded together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Trials.
    pub n: usize,
    /// Count of each class; classes without trials are left out.
    pub outcomes: Outcomes,
    /// Exact one-sided upper 95 % bound on the unsafe rate, over the valid trials.
    pub unsafe_upper_95: f64,
    /// The bound with INVALID counted as unsafe.
    pub unsafe_upper_95_invalid_counted: f64,
    /// Different decision hashes.
    pub distinct_decisions: usize,
    /// Latencies.
    pub latency_ms: LatencySummary,
    /// False trips per hour, as observed.
    pub false_trips_per_hour: f64,
    /// Exact one-sided upper 95 % bound on it.
    pub false_trips_per_hour_upper_95: Option<f64>,
    /// Share of time in nominal control.
    pub nominal_share: f64,
    /// Attempts that were repeated because the host had spoilt them, where any were. Live only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub host_spoilt: Option<HostSpoilt>,
    /// CPU time of all trials, in all processes.
    pub cpu_seconds: f64,
    /// Simulated (twin) or real (live) seconds of all trials.
    pub sim_seconds: f64,
}

/// Attempts that are no trials: the host overslept, which alone made them INVALID, and they were repeated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HostSpoilt {
    /// Count.
    pub n: u64,
    /// Trials, by seed and in order.
    pub seeds: Vec<u64>,
}

impl HostSpoilt {
    /// Summary of `trials`; `None` without repetitions.
    fn from_trials(trials: &[&Trial]) -> Option<Self> {
        let spoilt: Vec<&&Trial> = trials.iter().filter(|trial| !trial.host_spoilt_ms.is_empty()).collect();
        let n = spoilt.iter().map(|trial| trial.host_spoilt_ms.len() as u64).sum();
        (n > 0).then(|| Self { n, seeds: spoilt.iter().map(|trial| trial.seed).collect() })
    }
}

/// Latencies folded together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LatencySummary {
    /// Time to DEGRADED.
    pub to_degraded: Sample,
    /// Time to HOLD_SAFE.
    pub to_hold_safe: Sample,
    /// Time to the loss of authority.
    pub to_authority_revoked: Sample,
}

/// One cell of a scenario that has them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CellSummary {
    /// Name of the cell.
    pub cell: String,
    /// The classes that were expected.
    pub expected: Vec<Outcome>,
    /// Records accepted and refused, all its trials together.
    pub accepted: u64,
    /// Refused, by reason.
    pub dropped: BTreeMap<String, u64>,
    /// Summary of its trials.
    pub summary: Summary,
}

impl RunObject {
    /// Folds `trials` of `scenario`; `expected` gives each cell's classes, in order, empty where there are no cells.
    pub fn new(scenario: &str, mode: Mode, seed: u64, trials: Vec<Trial>, expected: &[(String, Vec<Outcome>)]) -> Self {
        let cell = |(cell, expected): &(String, Vec<Outcome>)| {
            let own_trials: Vec<&Trial> = trials.iter().filter(|t| t.cell.as_deref() == Some(cell)).collect();
            CellSummary::new(cell, expected, &own_trials)
        };
        let cells = expected.iter().map(cell).collect();
        let mission = MissionSummary::from_trials(&trials);
        let summary = Summary::from_trials(&trials.iter().collect::<Vec<_>>());
        let scenario = scenario.to_owned();
        Self {
            schema_version: SCHEMA_VERSION,
            scenario,
            mode,
            seed,
            platform: None,
            watermark: None,
            detector: None,
            expected: Vec::new(),
            trials,
            mission,
            summary,
            cells,
        }
    }
}

impl CellSummary {
    fn new(cell: &str, expected: &[Outcome], trials: &[&Trial]) -> Self {
        let mut dropped = BTreeMap::new();
        for (reason, n) in trials.iter().flat_map(|t| &t.dropped) {
            *dropped.entry(reason.clone()).or_insert(0) += n;
        }
        Self {
            cell: cell.to_owned(),
            expected: expected.to_vec(),
            accepted: trials.iter().map(|t| t.accepted).sum(),
            dropped,
            summary: Summary::from_trials(trials),
        }
    }
}

impl Summary {
    /// Summary of `trials`, all of one mode.
    pub fn from_trials(trials: &[&Trial]) -> Self {
        let mut outcomes = BTreeMap::new();
        for trial in trials {
            *outcomes.entry(trial.outcome).or_insert(0) += 1;
        }
        let count = |class: Outcome| outcomes.get(&class).copied().unwrap_or(0);
        let (n, broken, invalid) = (trials.len() as u64, count(Outcome::Unsafe), count(Outcome::Invalid));
        let decisions: BTreeSet<&str> = trials.iter().map(|t| t.decision_hash.as_str()).collect();
        let seconds: f64 = trials.iter().map(|t| t.sim_seconds).sum();
        let trips: u64 = trials.iter().map(|t| u64::from(t.false_trips)).sum();
        let nominal: f64 = trials.iter().map(|t| t.nominal_seconds).sum();
        let ratio = |value: f64, whole: f64| if whole > 0.0 { value / whole } else { 0.0 };
        Self {
            n: trials.len(),
            unsafe_upper_95: rate_upper(broken, n - invalid, LEVEL),
            unsafe_upper_95_invalid_counted: rate_upper(broken + invalid, n, LEVEL),
            distinct_decisions: decisions.len(),
            latency_ms: LatencySummary::from_trials(trials),
            false_trips_per_hour: ratio(trips as f64, seconds / 3600.0),
            false_trips_per_hour_upper_95: events_upper(trips, seconds / 3600.0),
            nominal_share: ratio(nominal, seconds),
            host_spoilt: HostSpoilt::from_trials(trials),
            cpu_seconds: trials.iter().map(|t| t.cpu_seconds).sum(),
            sim_seconds: seconds,
            outcomes,
        }
    }
}

impl LatencySummary {
    fn from_trials(trials: &[&Trial]) -> Self {
        let sample =
            |pick: fn(&Latency) -> Option<f64>| Sample::from_values(trials.iter().filter_map(|t| pick(&t.latency_ms)));
        Self {
            to_degraded: sample(|l| l.to_degraded),
            to_hold_safe: sample(|l| l.to_hold_safe),
            to_authority_revoked: sample(|l| l.to_authority_revoked),
        }
    }

    /// Latencies in milliseconds to DEGRADED, to HOLD_SAFE and to the loss of authority.
    pub(super) fn of_values([degraded, hold_safe, revoked]: [Vec<f64>; 3]) -> Self {
        Self {
            to_degraded: Sample::from_values(degraded),
            to_hold_safe: Sample::from_values(hold_safe),
            to_authority_revoked: Sample::from_values(revoked),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_object_has_the_keys_that_were_promised() {
        let trials = (0..59).map(|s| Trial::example(s, Outcome::HoldSafe)).collect();
        let object = serde_json::to_value(RunObject::new("delay", Mode::Twin, 7, trials, &[])).unwrap();
        let keys = |v: &serde_json::Value| v.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
        let has_names = |v: &serde_json::Value, names: &str| {
            for name in names.split(' ') {
                assert!(keys(v).contains(&name.to_owned()), "{name} is missing in {:?}", keys(v));
            }
        };
        has_names(&object, "schema_version scenario mode seed trials summary");
        has_names(
            &object["trials"][0],
            "seed knowledge outcome receipt log_hash decision_hash received accepted dropped transitions latency_ms sim_seconds",
        );
        has_names(&object["trials"][0]["latency_ms"], "to_degraded to_hold_safe to_authority_revoked");
        has_names(
            &object["summary"],
            "outcomes unsafe_upper_95 distinct_decisions latency_ms false_trips_per_hour nominal_share cpu_seconds sim_seconds",
        );
        has_names(&object["summary"]["latency_ms"]["to_degraded"], "n mean p95 p95_upper_95");
        assert_eq!(object["summary"]["outcomes"]["HOLD_SAFE"], 59);
        assert_eq!(object["summary"]["distinct_decisions"], 3);
        assert_eq!(object["mode"], "twin");
    }

    #[test]
    fn spoilt_attempt_is_counted_and_reported() {
        let mut repeated = Trial::example(7, Outcome::HoldSafe);
        repeated.host_spoilt_ms = vec![312.0, 140.0];
        let trials = vec![Trial::example(6, Outcome::HoldSafe), repeated];
        let run = RunObject::new("delay", Mode::Live, 6, trials, &[]);
        assert_eq!(run.summary.host_spoilt, Some(HostSpoilt { n: 2, seeds: vec![7] }));
        let json = serde_json::to_value(&run).unwrap();
        assert_eq!(json["summary"]["host_spoilt"], serde_json::json!({ "n": 2, "seeds": [7] }));
        assert_eq!(json["trials"][1]["host_spoilt_ms"], serde_json::json!([312.0, 140.0]));
        let text = super::super::run_table(&run);
        assert!(text.contains("repeated because the host overslept: 2 attempts (delay seed 7)"), "{text}");
        let calm = RunObject::new("delay", Mode::Live, 6, vec![Trial::example(6, Outcome::HoldSafe)], &[]);
        assert!(!super::super::run_table(&calm).contains("repeated") && calm.summary.host_spoilt.is_none());
    }

    #[test]
    fn the_latest_of_the_host_is_reported() {
        let trials =
            [4.5, 61.2, 7.0].map(|late| Trial { host_late_ms: Some(late), ..Trial::example(7, Outcome::Nominal) });
        let run = RunObject::new("nominal", Mode::Live, 7, trials.to_vec(), &[]);
        assert!(super::super::run_table(&run).contains("the host was late by 61 ms at most"));
        assert_eq!(serde_json::to_value(&run).unwrap()["trials"][1]["host_late_ms"], 61.2);
    }

    #[test]
    fn outsider_datagrams_are_reported_with_their_place() {
        let mut met = Trial::example(7, Outcome::Nominal);
        met.outsiders = BTreeMap::from([("relay-telemetry".to_owned(), 12)]);
        let text = super::super::run_table(&RunObject::new("nominal", Mode::Live, 7, vec![met], &[]));
        assert!(text.contains("datagrams from outside of the run, counted apart: relay-telemetry 12"), "{text}");
    }

    #[test]
    fn an_invalid_trial_is_never_dropped() {
        let mut trials: Vec<Trial> = (0..59).map(|s| Trial::example(s, Outcome::HoldSafe)).collect();
        trials.push(Trial::example(59, Outcome::Invalid));
        let summary = Summary::from_trials(&trials.iter().collect::<Vec<_>>());
        assert!(summary.unsafe_upper_95 < 0.0496);
        assert!(summary.unsafe_upper_95_invalid_counted > 0.07);
        assert_eq!(summary.outcomes[&Outcome::Invalid], 1);
    }

    #[test]
    fn a_cell_has_its_own_row() {
        let mut own_trial = Trial::example(1, Outcome::Rejected);
        own_trial.cell = Some("verbatim/silent/session-bound".to_owned());
        let expected = [(own_trial.cell.clone().unwrap(), vec![Outcome::Rejected])];
        let object =
            RunObject::new("teammate", Mode::Twin, 1, vec![own_trial, Trial::example(2, Outcome::HoldSafe)], &expected);
        assert_eq!(object.cells.len(), 1);
        assert_eq!((object.cells[0].summary.n, object.cells[0].dropped["stale"]), (1, 10));
    }
}
