//! The threat matrix: one row a threat, beneath it one run a scenario, cell and mode. Counts and bounds only.
//!
//! Within a row n is added up over runs of the same kind alone: the same place of evidence, whether the row's mechanism
//! really runs there, and whether anything was waived. A bound is that of the kind's worst run: trial i of every run has the
//! same seed, so trials of several runs are not independent, and a bad cell must not be averaged away. Bounds *together*
//! hold for all runs of all rows at once (Bonferroni).

use std::collections::BTreeMap;

use evidence::SCHEMA_VERSION;
use evidence::trial::{Outcome, Outcomes, Trial};
use scenario::{Evidence, Requirement, Variation};
use serde::{Deserialize, Serialize};
use stats::{LEVEL, Sample, rate_upper, simultaneous_level};

use super::layout::folded;
use super::run::{LatencySummary, Summary};
use super::table::{host_line, outcomes, percent, sample};
use crate::catalogue::ThreatRow;
use crate::mode::Mode;
use crate::report::{AcceptedRate, new_table};

/// The whole matrix.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Matrix {
    /// Version of this object.
    pub schema_version: u32,
    /// The base seed; trial i of every run has seed + i.
    pub seed: u64,
    /// SHA-256 of the program that ran it.
    pub build: String,
    /// One row a threat, in the catalogue's order.
    pub rows: Vec<MatrixRow>,
    /// Number of bounds that hold together.
    pub bounds: usize,
    /// True if every trial of every run lies within its expected classes.
    pub as_expected: bool,
}

/// One threat.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MatrixRow {
    /// Its id.
    pub id: String,
    /// The threat.
    pub threat: String,
    /// The requirement under test.
    pub requirement: Requirement,
    /// The boundary that is attacked.
    pub interface: String,
    /// STRIDE by letter.
    pub stride: String,
    /// ATT&CK and ATLAS.
    pub techniques: Vec<String>,
    /// Required containment.
    pub containment: String,
    /// Tests named after it.
    pub tests: Vec<String>,
    /// Commands of holdsafe that run it beside its scenarios.
    pub commands: Vec<String>,
    /// The open gap, and its reason.
    pub open: Option<String>,
    /// Outcomes by kind of evidence.
    pub kinds: Vec<Kind>,
    /// Every run.
    pub runs: Vec<MatrixRun>,
}

/// One variation of one scenario in one mode.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
    /// Other classes that the scenario accepts below a rate, each held against the trials.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub accepted: Vec<AcceptedRate>,
    /// The trials.
    pub summary: Summary,
    #[serde(skip)]
    latencies: Vec<[Option<f64>; 3]>,
}

/// All runs of a row with one kind of evidence: their n may be added.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Kind {
    /// Origin of the evidence.
    pub evidence: Evidence,
    /// True if the mechanism really runs there; where not, n is no evidence of it.
    pub counts: bool,
    /// True if a policy waived something.
    pub ablation: bool,
    /// Trials.
    pub n: u64,
    /// Outcomes.
    pub outcomes: Outcomes,
    /// Trials outside their expected classes.
    pub unexpected: u64,
    /// Exact one-sided upper 95 % bound on the unsafe rate of its worst run, over the valid trials.
    pub unsafe_upper_95: f64,
    /// The bound with INVALID counted as unsafe.
    pub unsafe_upper_95_invalid_counted: f64,
    /// The bound that holds together with all others of the matrix.
    pub unsafe_upper_95_simultaneous: f64,
    /// Latencies.
    pub latency_ms: LatencySummary,
    /// Counts of each run: unsafe, INVALID, all.
    #[serde(skip)]
    each: Vec<[u64; 3]>,
}

impl MatrixRun {
    /// Row of `trials`, all of one variation and mode.
    pub fn new(variation: &Variation, watermark: Option<String>, mode: Mode, trials: &[&Trial]) -> Self {
        let scenario = &variation.scenario;
        let (expected, summary) = (scenario.expected.to_vec(), Summary::from_trials(trials));
        let latency = |t: &&Trial| {
            let l = &t.latency_ms;
            [l.to_degraded, l.to_hold_safe, l.to_authority_revoked]
        };
        Self {
            scenario: scenario.name.as_str().to_owned(),
            cell: variation.cell.clone(),
            policy: scenario.policy.as_str().to_owned(),
            watermark,
            evidence: mode.evidence(),
            counts: mode.counts_for(scenario.evidence),
            unexpected: trials.iter().filter(|t| !expected.contains(&t.outcome)).count() as u64,
            accepted: AcceptedRate::from_outcomes(scenario, &summary.outcomes),
            expected,
            summary,
            latencies: trials.iter().map(latency).collect(),
        }
    }

    /// True if every trial lies within the expected classes, or in one that is accepted at a rate which stands.
    pub fn is_as_expected(&self) -> bool {
        self.unexpected == AcceptedRate::trials(&self.accepted)
    }
}

impl MatrixRow {
    /// A row of the catalogue with its runs.
    pub fn new(row: &ThreatRow, mut runs: Vec<MatrixRun>) -> Self {
        for run in &mut runs {
            run.counts &= run.evidence == Evidence::Live || row.evidence.contains(&run.evidence);
        }
        let mut kinds: BTreeMap<_, Vec<&MatrixRun>> = BTreeMap::new();
        for run in &runs {
            let key = (run.watermark.is_some(), !run.counts, run.evidence.name());
            kinds.entry(key).or_default().push(run);
        }
        let owned = |ids: &[scenario::TechniqueId]| ids.iter().map(|t| t.as_str().to_owned()).collect();
        Self {
            id: row.id.as_str().to_owned(),
            threat: row.threat.clone(),
            requirement: row.requirement,
            interface: row.interface.clone(),
            stride: row.stride.iter().map(|s| s.letter()).collect(),
            techniques: owned(&row.techniques),
            containment: row.containment.clone(),
            tests: row.tests.clone(),
            commands: row.commands.clone(),
            open: row.open.clone(),
            kinds: kinds.values().filter_map(|runs| Kind::from_runs(runs)).collect(),
            runs,
        }
    }
}

impl Kind {
    fn from_runs(runs: &[&MatrixRun]) -> Option<Self> {
        let first = runs.first()?;
        let mut counted = BTreeMap::new();
        for (class, n) in runs.iter().flat_map(|run| &run.summary.outcomes) {
            *counted.entry(*class).or_insert(0) += n;
        }
        let latency = |which: usize| {
            Sample::from_values(runs.iter().flat_map(|r| r.latencies.iter().filter_map(move |l| l[which])))
        };
        let mut kind = Self {
            evidence: first.evidence,
            counts: first.counts,
            ablation: first.watermark.is_some(),
            n: counted.values().sum(),
            outcomes: counted,
            unexpected: runs.iter().map(|run| run.unexpected).sum(),
            unsafe_upper_95: 1.0,
            unsafe_upper_95_invalid_counted: 1.0,
            unsafe_upper_95_simultaneous: 1.0,
            latency_ms: LatencySummary {
                to_degraded: latency(0),
                to_hold_safe: latency(1),
                to_authority_revoked: latency(2),
            },
            each: runs.iter().map(|run| each(&run.summary)).collect(),
        };
        kind.unsafe_upper_95 = kind.worst(|[broken, invalid, n]| rate_upper(broken, n - invalid, LEVEL));
        kind.unsafe_upper_95_invalid_counted =
            kind.worst(|[broken, invalid, n]| rate_upper(broken + invalid, n, LEVEL));
        Some(kind)
    }

    fn worst(&self, bound: impl Fn([u64; 3]) -> f64) -> f64 {
        self.each.iter().map(|run| bound(*run)).fold(0.0, f64::max)
    }
}

impl Matrix {
    /// Puts the rows together and widens their bounds to hold at once.
    pub fn new(seed: u64, build: &str, mut rows: Vec<MatrixRow>) -> Self {
        let bounds = rows.iter().map(|row| row.runs.len()).sum();
        let level = simultaneous_level(bounds, LEVEL);
        for kind in rows.iter_mut().flat_map(|row| &mut row.kinds) {
            kind.unsafe_upper_95_simultaneous =
                kind.worst(|[broken, invalid, n]| rate_upper(broken, n - invalid, level));
        }
        let as_expected = rows.iter().flat_map(|row| &row.runs).all(MatrixRun::is_as_expected);
        Self { schema_version: SCHEMA_VERSION, seed, build: build.to_owned(), rows, bounds, as_expected }
    }
}

/// Numbers of a run's unsafe and INVALID trials, and of all.
fn each(summary: &Summary) -> [u64; 3] {
    let count = |class| summary.outcomes.get(&class).copied().unwrap_or(0);
    [count(Outcome::Unsafe), count(Outcome::Invalid), summary.outcomes.values().sum()]
}

/// The matrix for a terminal.
pub fn matrix_table(matrix: &Matrix) -> String {
    let mut table = new_table(&[
        "row",
        "threat",
        "evidence, n",
        "outcomes",
        "unsafe below (together)",
        "to degraded ms",
        "to hold-safe ms",
    ]);
    for row in &matrix.rows {
        for line in lines(row) {
            table.add_row(line);
        }
    }
    let odd: u64 = matrix.rows.iter().flat_map(|row| &row.kinds).map(|kind| kind.unexpected).sum();
    let bare: Vec<&str> = matrix.rows.iter().filter(|row| row.runs.is_empty()).map(|row| row.id.as_str()).collect();
    // A scenario may be in several rows; its attempts are listed once.
    let runs = matrix.rows.iter().flat_map(|row| &row.runs).filter(|run| run.summary.host_spoilt.is_some());
    let runs: BTreeMap<_, &MatrixRun> = runs.map(|run| ((&run.scenario, &run.cell, &run.policy), run)).collect();
    let spoilt = host_line(runs.values().map(|run| (run.scenario.as_str(), &run.summary)));
    folded(&format!(
        "{table}\nseed {}; {odd} trials outside their expected classes; rows without a run: {}.\n\
         ms: mean / p95 / upper 95 % bound on p95 (needs n >= 59). unsafe below: exact one-sided 95 % bound of the worst \
         run, in brackets the one that holds for all {} runs together (Bonferroni).\n\
         * the real mechanism does not run there: this n is no evidence of it. ablation: a policy waives something.\n\
         Scenarios, tests, requirement, interface, STRIDE and techniques of a row: docs/reference/threats.md, or --json.\n{spoilt}",
        matrix.seed,
        if bare.is_empty() { "none".to_owned() } else { bare.join(" ") },
        matrix.bounds,
    ))
}

fn lines(row: &MatrixRow) -> Vec<Vec<String>> {
    let texts = vec![row.id.clone(), row.threat.clone()];
    if row.kinds.is_empty() {
        let none = row.open.as_ref().map_or_else(|| "-".to_owned(), |reason| format!("none: {reason}"));
        return vec![texts.into_iter().chain([none]).chain((0..4).map(|_| "-".to_owned())).collect()];
    }
    let blank = || vec![String::new(); texts.len()];
    let kind = |(i, kind): (usize, &Kind)| {
        let head = if i == 0 { texts.clone() } else { blank() };
        head.into_iter().chain(kind_cells(kind)).collect()
    };
    row.kinds.iter().enumerate().map(kind).collect()
}

fn kind_cells(kind: &Kind) -> [String; 5] {
    let (mark, ablation) = (if kind.counts { "" } else { " *" }, if kind.ablation { ", ablation" } else { "" });
    let odd = if kind.unexpected > 0 { format!(" ({} unexpected)", kind.unexpected) } else { String::new() };
    [
        format!("{}, {}{mark}{ablation}", kind.evidence.name(), kind.n),
        outcomes(&kind.outcomes) + &odd,
        format!("{} ({})", percent(kind.unsafe_upper_95), percent(kind.unsafe_upper_95_simultaneous)),
        sample(&kind.latency_ms.to_degraded),
        sample(&kind.latency_ms.to_hold_safe),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::Catalogue;

    fn run(name: &str, mode: Mode, waived: bool, n: u64) -> MatrixRun {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..");
        let scenario = scenario::load(&scenario::find(&root, name).expect("a shipped scenario")).expect("it loads");
        let trials: Vec<Trial> = (0..n).map(|seed| Trial::example(seed, Outcome::Rejected)).collect();
        let watermark = waived.then(|| "ABLATION".to_owned());
        let variation = Variation { cell: None, scenario };
        MatrixRun::new(&variation, watermark, mode, &trials.iter().collect::<Vec<_>>())
    }

    fn matrix(runs: Vec<MatrixRun>) -> Matrix {
        let catalogue = Catalogue::load().expect("the catalogue");
        let row = catalogue.row("A01").expect("a row");
        Matrix::new(1, "", vec![MatrixRow::new(row, runs)])
    }

    #[test]
    fn counts_add_up_within_a_kind_only() {
        let runs = vec![
            run("replay", Mode::Twin, false, 59),
            run("replay", Mode::Twin, false, 40),
            run("replay", Mode::Twin, true, 7),
            run("replay", Mode::Live, false, 5),
        ];
        let matrix = matrix(runs);
        let n: Vec<u64> = matrix.rows[0].kinds.iter().map(|kind| kind.n).collect();
        assert_eq!(n, [5, 99, 7], "live, model, model under ablation");
        assert!(matrix.as_expected && matrix.bounds == 4);
        let kind = &matrix.rows[0].kinds[1];
        assert!(kind.unsafe_upper_95_simultaneous > kind.unsafe_upper_95);
        assert_eq!(kind.latency_ms.to_degraded.n, 99);
    }

    #[test]
    fn bad_cell_is_not_averaged_away() {
        let (good, mut bad) = (run("replay", Mode::Twin, false, 299), run("replay", Mode::Twin, false, 299));
        bad.summary.outcomes = [(Outcome::Rejected, 290), (Outcome::Unsafe, 9)].into();
        let single = matrix(vec![bad.clone()]).rows[0].kinds[0].unsafe_upper_95;
        let mixed = matrix(vec![good.clone(), bad, good]).rows[0].kinds[0].unsafe_upper_95;
        assert!(single > 0.04 && mixed == single, "{single} {mixed}");
    }

    #[test]
    fn model_trials_are_no_real_mechanism_evidence() {
        let catalogue = Catalogue::load().expect("the catalogue");
        let row_of = |id: &str| {
            let row = MatrixRow::new(catalogue.row(id).expect("a row"), vec![run("replay", Mode::Twin, false, 5)]);
            row.kinds[0].counts
        };
        assert!(row_of("A01") && !row_of("A38"));
    }

    #[test]
    fn unexpected_outcome_is_counted_and_shown() {
        let matrix = matrix(vec![run("loss", Mode::Twin, false, 3)]);
        assert!(!matrix.as_expected);
        let table = matrix_table(&matrix);
        // A narrow column breaks between words.
        let in_row = table.contains("(3") && table.contains("unexpected)");
        assert!(in_row && table.contains("3 trials outside their expected classes"), "{table}");
    }

    #[test]
    fn object_has_a_row_for_each_threat() {
        let object = serde_json::to_value(matrix(Vec::new())).expect("an object");
        assert_eq!((&object["schema_version"], &object["rows"][0]["id"]), (&1.into(), &"A01".into()));
        assert!(object["rows"][0]["kinds"].as_array().is_some_and(Vec::is_empty));
    }
}
