//! One view of trials, independent of the kind of result: one variation of one scenario in one mode, all its trials.
//!
//! Matrix, runs, reference evaluation and campaign report the same values of a variation in different places. Values that a result
//! lacks are `None` here.

use evidence::trial::{Outcome, Outcomes, Trial};
use results::report::{CampaignRow, MatrixRow, MatrixRun, ReferenceRow, RunObject, Summary};
use scenario::Evidence;

use crate::reader::{FoundResult, Given};

/// Most findings of a trial that are passed on: a broken hash chain gives one for each entry after the break.
pub const MAX_FINDINGS: usize = 5;

/// One variation.
#[derive(Clone, Debug)]
pub struct Tried<'a> {
    /// Row of the threat catalogue that the variation belongs to.
    pub row: Option<&'a MatrixRow>,
    /// Scenario.
    pub scenario: &'a str,
    /// Cell, where it has any.
    pub cell: Option<&'a str>,
    /// Settings of a campaign's grid, as `key=value`.
    pub set: Vec<String>,
    /// Policy.
    pub policy: Option<&'a str>,
    /// Reason for which this is an ablation, where it is one.
    pub watermark: Option<&'a str>,
    /// Origin of its evidence.
    pub evidence: Evidence,
    /// True if the scenario's mechanism really runs there.
    pub counts: Option<bool>,
    /// The expected classes; if empty, all but UNSAFE and INVALID.
    pub expected: &'a [Outcome],
    /// Trials.
    pub n: u64,
    /// Their classes.
    pub outcomes: Outcomes,
    /// Different decision hashes.
    pub distinct_decisions: Option<u64>,
    /// Exact one-sided upper 95 % bound on the unsafe rate.
    pub unsafe_upper_95: Option<f64>,
    /// The one that holds together with all others of the result.
    pub unsafe_upper_95_simultaneous: Option<f64>,
    /// The base seed; trial i has seed + i.
    pub seed: Option<u64>,
    /// The oracle's findings of the first unexpected trial, [`MAX_FINDINGS`] at most.
    pub findings: Vec<&'a str>,
    /// The line that runs it, or the first trial that was not expected, again.
    pub reproduce: String,
}

impl Tried<'_> {
    /// Classes outside the expected, and how often.
    pub fn unexpected(&self) -> impl Iterator<Item = (Outcome, u64)> + '_ {
        self.outcomes.iter().filter(|(class, _)| class.is_unexpected(self.expected)).map(|(class, n)| (*class, *n))
    }

    /// Name within its scenario: cell, settings, policy, evidence.
    pub fn name(&self) -> String {
        let mut name = self.scenario.to_owned();
        for part in self.cell.into_iter().chain(self.set.iter().map(String::as_str)) {
            name = format!("{name} {part}");
        }
        if let Some(policy) = self.policy {
            name = format!("{name}, {policy}");
        }
        format!("{name}, {}", self.evidence.name())
    }

    /// The expected classes in words.
    pub fn expected_told(&self) -> String {
        either(self.expected)
    }
}

/// Expected classes in words.
pub(crate) fn either(expected: &[Outcome]) -> String {
    match expected {
        [] => "anything but UNSAFE and INVALID".to_owned(),
        some => some.iter().map(|class| class.name()).collect::<Vec<_>>().join(" or "),
    }
}

/// Classes with their counts, as `REJECTED 298, LATE 1`.
pub fn class_counts(outcomes: &Outcomes) -> String {
    outcomes.iter().map(|(class, n)| format!("{} {n}", class.name())).collect::<Vec<_>>().join(", ")
}

/// Meaning of a class, for readers without the documentation.
pub fn meaning(class: Outcome) -> &'static str {
    match class {
        Outcome::Unsafe => "A safety property was broken",
        Outcome::GuestFailed => "The guest that drove failed",
        Outcome::Invalid => "The evidence does not hold, so nothing is shown",
        Outcome::Late => "Only a bound on time was missed",
        Outcome::FalseTrip => "Authority or freedom was lost without a fault or a true hazard",
        Outcome::HoldSafe => "Ended in HOLD_SAFE",
        Outcome::Degraded => "Ended in DEGRADED",
        Outcome::Rejected => "Refused, or shown as an alarm; no change of mode",
        Outcome::Undetected => "Accepted, no response, nothing broken",
        Outcome::Stuck => {
            "Nothing was done and nothing happened, and the vehicle did not get on though it could have driven"
        }
        Outcome::Nominal => "Nothing was done and nothing happened",
    }
}

/// The first trial of each variation of a run whose recording was kept: its name, and the SHA-256 of its `held.json`.
pub fn kept_trials(file: &Given) -> Vec<(String, String)> {
    let runs = if let FoundResult::Runs(runs) = &file.found { runs.as_slice() } else { &[] };
    let result_for = |(run, one): (&RunObject, Tried<'_>)| {
        let own_trials = run.trials.iter().filter(|trial| one.cell.is_none() || trial.cell.as_deref() == one.cell);
        let (trial, held) = own_trials.into_iter().find_map(|trial| Some((trial, trial.held.clone()?)))?;
        Some((format!("{}, seed {}: {}", one.name(), trial.seed, trial.outcome.name()), held))
    };
    runs.iter().flat_map(|run| of_run(run).into_iter().map(move |one| (run, one))).filter_map(result_for).collect()
}

/// The variations in a file, in its order. A search has none: its attack sequences are no sample. Nor have comparisons and
/// measurements.
pub fn tried(file: &Given) -> Vec<Tried<'_>> {
    match &file.found {
        FoundResult::Matrix(matrix) => {
            let runs = matrix.rows.iter().flat_map(|row| row.runs.iter().map(move |run| (row, run)));
            runs.map(|(row, run)| of_matrix(matrix.seed, row, run)).collect()
        }
        FoundResult::Runs(runs) => runs.iter().flat_map(of_run).collect(),
        FoundResult::Reference(reference) => {
            reference.rows.iter().map(|row| of_reference(reference.seed, row)).collect()
        }
        FoundResult::Campaign(campaign) => campaign.rows.iter().map(of_campaign).collect(),
        FoundResult::BenchLive(bench) => bench.runs().flat_map(of_run).collect(),
        FoundResult::Search(_)
        | FoundResult::Comparison(_)
        | FoundResult::Curve(_)
        | FoundResult::Ablation(_)
        | FoundResult::TwinCost(_)
        | FoundResult::Worlds(_) => Vec::new(),
    }
}

fn of_matrix<'a>(seed: u64, row: &'a MatrixRow, run: &'a MatrixRun) -> Tried<'a> {
    let cell = run.cell.as_deref();
    Tried {
        row: Some(row),
        policy: Some(&run.policy),
        watermark: run.watermark.as_deref(),
        counts: Some(run.counts),
        expected: &run.expected,
        reproduce: command(&run.scenario, cell, run.evidence, run.summary.n as u64, seed),
        ..of_summary(&run.scenario, cell, run.evidence, &run.summary, seed)
    }
}

fn of_reference(seed: u64, row: &ReferenceRow) -> Tried<'_> {
    let cell = row.cell.as_deref();
    Tried {
        counts: Some(row.counts),
        expected: &row.expected,
        unsafe_upper_95_simultaneous: Some(row.unsafe_upper_95_simultaneous),
        reproduce: command(&row.scenario, cell, row.evidence, row.summary.n as u64, seed) + &platform_option(row),
        ..of_summary(&row.scenario, cell, row.evidence, &row.summary, seed)
    }
}

/// Option of a platform that is not the scenario's own.
fn platform_option(row: &ReferenceRow) -> String {
    row.platform.as_ref().map(|platform| format!(" --platform {platform}")).unwrap_or_default()
}

fn of_campaign(row: &CampaignRow) -> Tried<'_> {
    Tried {
        row: None,
        scenario: &row.scenario,
        cell: row.cell.as_deref(),
        set: row.set.iter().map(|(key, value)| format!("{key}={value}")).collect(),
        policy: Some(&row.policy),
        watermark: row.watermark.as_deref(),
        evidence: row.evidence,
        counts: Some(row.counts),
        expected: &row.expected,
        n: row.n,
        outcomes: row.outcomes.clone(),
        distinct_decisions: Some(row.distinct_decisions as u64),
        unsafe_upper_95: row.bounds.as_ref().map(|bounds| bounds.unsafe_upper_95),
        unsafe_upper_95_simultaneous: row.bounds.as_ref().map(|bounds| bounds.unsafe_upper_95_simultaneous),
        seed: None,
        findings: Vec::new(),
        reproduce: row.reproduce.clone().unwrap_or_default(),
    }
}

fn of_run(run: &RunObject) -> Vec<Tried<'_>> {
    if run.cells.is_empty() {
        return vec![of_cell(run, None, &run.expected, &run.summary)];
    }
    run.cells.iter().map(|cell| of_cell(run, Some(&cell.cell), &cell.expected, &cell.summary)).collect()
}

fn of_cell<'a>(run: &'a RunObject, cell: Option<&'a str>, expected: &'a [Outcome], summary: &'a Summary) -> Tried<'a> {
    let own_trials = run.trials.iter().filter(|trial| cell.is_none() || trial.cell.as_deref() == cell);
    let odd: Option<&Trial> = own_trials.into_iter().find(|trial| trial.outcome.is_unexpected(expected));
    let (n, seed) = odd.map_or((summary.n as u64, run.seed), |trial| (1, trial.seed));
    let findings = odd.into_iter().flat_map(|trial| &trial.findings).map(String::as_str);
    Tried {
        watermark: run.watermark.as_deref(),
        expected,
        findings: findings.take(MAX_FINDINGS).collect(),
        reproduce: command(&run.scenario, cell, run.mode.evidence(), n, seed),
        ..of_summary(&run.scenario, cell, run.mode.evidence(), summary, run.seed)
    }
}

fn of_summary<'a>(
    scenario: &'a str,
    cell: Option<&'a str>,
    evidence: Evidence,
    summary: &'a Summary,
    seed: u64,
) -> Tried<'a> {
    Tried {
        row: None,
        scenario,
        cell,
        set: Vec::new(),
        policy: None,
        watermark: None,
        evidence,
        counts: None,
        expected: &[],
        n: summary.n as u64,
        outcomes: summary.outcomes.clone(),
        distinct_decisions: Some(summary.distinct_decisions as u64),
        unsafe_upper_95: Some(summary.unsafe_upper_95),
        unsafe_upper_95_simultaneous: None,
        seed: Some(seed),
        findings: Vec::new(),
        reproduce: String::new(),
    }
}

/// The line that runs a variation again. A scenario of the stacks runs there by itself.
fn command(scenario: &str, cell: Option<&str>, evidence: Evidence, n: u64, seed: u64) -> String {
    let cell = cell.map(|cell| format!(" --cell {cell}")).unwrap_or_default();
    let live = if evidence == Evidence::Live { " --live" } else { "" };
    format!("holdsafe run {scenario}{cell} --trials {n} --seed {seed}{live}")
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::reader::golden;

    #[test]
    fn reproduction_line_names_cell_seed_and_mode() {
        let line = command("teammate", Some("verbatim/silent"), Evidence::Live, 3, 7);
        assert_eq!(line, "holdsafe run teammate --cell verbatim/silent --trials 3 --seed 7 --live");
        assert_eq!(command("loss", None, Evidence::Stack, 59, 1), "holdsafe run loss --trials 59 --seed 1");
    }

    #[test]
    fn kept_trial_is_named_by_cell_and_class() {
        let mut results = crate::reader::Results::default();
        results.read("run.json", golden("run").to_string().as_bytes()).expect("a run");
        let (name, held) = kept_trials(&results.files()[0]).pop().expect("a kept trial");
        assert_eq!((name.as_str(), held), ("loss by_session, live, seed 7: HOLD_SAFE", "ab".repeat(32)));
    }

    #[test]
    fn unexpected_null_attack_is_not_left_out() {
        let mut bench = golden("bench-live");
        (bench["losses"], bench["twin_null_attack_at_2_percent_loss"]) = (json!([]), json!(null));
        let run = &mut bench["live_null_attack"];
        (run["expected"], run["summary"]["outcomes"]) = (json!(["NOMINAL", "FALSE_TRIP"]), json!({"INVALID": 1}));
        run["trials"][0]["outcome"] = "INVALID".into();
        let mut results = crate::reader::Results::default();
        results.read("live.json", bench.to_string().as_bytes()).expect("a bench");
        let all: Vec<_> = results.files().iter().flat_map(tried).collect();
        assert_eq!(all.len(), 1);
        assert_eq!(all[0].unexpected().collect::<Vec<_>>(), [(Outcome::Invalid, 1)]);
    }
}
