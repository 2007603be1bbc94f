//! Guests: what `holdsafe guest check --json` prints, and the comparison of each guest bare and inside the guards.

use evidence::SCHEMA_VERSION;
use evidence::trial::{Outcome, Outcomes, Trial};
use serde::{Deserialize, Serialize};
use stats::{Sample, Share};

use super::layout::folded;
use super::mission::ProgressSummary;
use super::new_table;
use super::table::{outcomes, sample};
use crate::mode::Mode;

/// An exercise of a guest without a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GuestChecked {
    /// Version of this object.
    pub schema_version: u32,
    /// How far the guest was confined: `full`, or `partial` with every refusal.
    pub confinement: String,
    /// Findings.
    #[serde(flatten)]
    pub checked: guest::check::Checked,
}

impl GuestChecked {
    /// The object of an exercise.
    pub fn new(checked: guest::check::Checked, confinement: String) -> Self {
        Self { schema_version: SCHEMA_VERSION, confinement, checked }
    }
}

/// Guests over scenarios, each bare and inside the guards.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Version of this object.
    pub schema_version: u32,
    /// The base seed; trial i of every row has seed + i.
    pub seed: u64,
    /// Mode of the trials: twin or live.
    pub mode: Mode,
    /// Trials of each row.
    pub trials: u64,
    /// A row a guest, conduct and variation; the two conducts have the same seeds.
    pub rows: Vec<ComparisonRow>,
    /// All attacks of a guest and conduct together.
    pub totals: Vec<ComparisonTotal>,
}

/// One guest in one conduct under one variation of a scenario.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ComparisonRow {
    /// Guest.
    pub guest: String,
    /// `bare` or `guarded`.
    pub conduct: String,
    /// The words that the run carries.
    pub watermark: Option<String>,
    /// Scenario.
    pub scenario: String,
    /// Cell, where it has any.
    pub cell: Option<String>,
    /// True for the scenario without an attack.
    pub quiet: bool,
    /// Count of each class.
    pub outcomes: Outcomes,
    /// UNSAFE and LATE trials of those with evidence: neither INVALID nor GUEST_FAILED.
    pub harmful: Share,
    /// Trials in which the guest failed.
    pub guest_failed: u64,
    /// Trials without evidence.
    pub invalid: u64,
    /// Time from the injection to standing (bare) or to HOLD_SAFE (guarded), ms.
    pub to_safe_ms: Sample,
    /// Way driven, m.
    pub driven_m: Sample,
    /// Progress along the route; none where no trial has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub progress: Option<ProgressSummary>,
    /// Share of the guest's set-points that the guards limited.
    pub limited: f64,
    /// Losses of authority or freedom without a fault.
    pub false_trips: u64,
    /// The first finding of the first harmful trial, with its seed.
    pub example: Option<String>,
}

/// All attacks of one guest in one conduct.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ComparisonTotal {
    /// Guest.
    pub guest: String,
    /// `bare` or `guarded`.
    pub conduct: String,
    /// Variations with an attack.
    pub variations: u64,
    /// Number of these with at least one harmful trial.
    pub harmed: u64,
    /// Harmful trials of all with evidence. Rows share seeds, so that no bound on a rate is drawn from them together.
    pub harmful: u64,
    /// Trials with evidence.
    pub n: u64,
    /// Mean share of the way points passed in quiet runs, 0 to 1: harm is avoided by standing still, too.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub completed: Option<f64>,
    /// Quiet trials with a route in which it was stuck.
    #[serde(default)]
    pub stuck: u64,
    /// Quiet trials with a route.
    #[serde(default)]
    pub quiet: u64,
}

impl ComparisonRow {
    /// The row of these trials; `marks` are conduct and watermark, `of` scenario and cell.
    pub fn new(
        guest: &str,
        (conduct, watermark): (String, Option<String>),
        (scenario, cell): (&str, Option<String>),
        quiet: bool,
        trials: &[Trial],
    ) -> Self {
        let mut outcomes = Outcomes::new();
        trials.iter().for_each(|trial| *outcomes.entry(trial.outcome).or_default() += 1);
        let count = |class: Outcome| outcomes.get(&class).copied().unwrap_or_default();
        let (failed, invalid) = (count(Outcome::GuestFailed), count(Outcome::Invalid));
        let harmful = Share::new(count(Outcome::Unsafe) + count(Outcome::Late), trials.len() as u64 - failed - invalid);
        let guests = || trials.iter().filter_map(|trial| trial.guest.as_ref());
        let steps: u64 = guests().map(|row| u64::from(row.steps)).sum();
        let limited: u64 = guests().map(|row| u64::from(row.limited)).sum();
        let to_safe: Vec<f64> = trials.iter().filter_map(|trial| trial.latency_ms.to_hold_safe).collect();
        let driven: Vec<f64> = trials.iter().filter_map(|trial| Some(trial.mission.as_ref()?.driven_m)).collect();
        let example = trials.iter().find(|trial| is_harmful(trial.outcome)).map(trial_line);
        Self {
            guest: guest.to_owned(),
            conduct,
            watermark,
            scenario: scenario.to_owned(),
            cell,
            quiet,
            harmful,
            guest_failed: failed,
            invalid,
            to_safe_ms: Sample::from_values(to_safe),
            driven_m: Sample::from_values(driven),
            progress: ProgressSummary::from_trials(trials),
            limited: if steps == 0 { 0.0 } else { limited as f64 / steps as f64 },
            false_trips: trials.iter().map(|trial| u64::from(trial.false_trips)).sum(),
            example,
            outcomes,
        }
    }

    fn is_of(&self, guest: &str, conduct: &str) -> bool {
        self.guest == guest && self.conduct == conduct
    }
}

fn is_harmful(outcome: Outcome) -> bool {
    matches!(outcome, Outcome::Unsafe | Outcome::Late)
}

fn trial_line(trial: &Trial) -> String {
    format!("seed {}: {}", trial.seed, trial.findings.first().map_or("no finding", String::as_str))
}

impl Comparison {
    /// The comparison of these rows.
    pub fn new(seed: u64, mode: Mode, trials: u64, rows: Vec<ComparisonRow>) -> Self {
        let mut totals: Vec<ComparisonTotal> = Vec::new();
        for row in &rows {
            if totals.iter().any(|total| row.is_of(&total.guest, &total.conduct)) {
                continue;
            }
            let of_both = rows.iter().filter(|other| other.is_of(&row.guest, &row.conduct));
            let (quiet, own_rows): (Vec<&ComparisonRow>, Vec<&ComparisonRow>) = of_both.partition(|other| other.quiet);
            let routed: Vec<&ProgressSummary> = quiet.iter().filter_map(|row| row.progress.as_ref()).collect();
            let routed_n: u64 = routed.iter().map(|summary| summary.n).sum();
            let passed: f64 = routed.iter().map(|summary| summary.completed * summary.n as f64).sum();
            totals.push(ComparisonTotal {
                completed: (routed_n > 0).then(|| passed / routed_n as f64),
                stuck: routed.iter().map(|summary| summary.stuck).sum(),
                quiet: routed_n,
                guest: row.guest.clone(),
                conduct: row.conduct.clone(),
                variations: own_rows.len() as u64,
                harmed: own_rows.iter().filter(|row| row.harmful.hits > 0).count() as u64,
                harmful: own_rows.iter().map(|row| row.harmful.hits).sum(),
                n: own_rows.iter().map(|row| row.harmful.n).sum(),
            });
        }
        Self { schema_version: SCHEMA_VERSION, seed, mode, trials, rows, totals }
    }
}

/// The comparison as a table: an attack a line, bare and guarded side by side, then the cost in quiet hours and the totals.
pub fn comparison_table(comparison: &Comparison) -> String {
    let mut text = String::new();
    let mut guests: Vec<&str> = comparison.rows.iter().map(|row| row.guest.as_str()).collect();
    guests.dedup();
    guests.sort_unstable();
    guests.dedup();
    for guest in guests {
        text.push_str(&of_guest(comparison, guest));
    }
    let totals = totals_table(&comparison.totals);
    folded(&format!(
        "{text}{totals}\nharmed: UNSAFE or LATE under attacks. completed: way points passed without an attack, by truth. stuck: did not get on \
         there.\n"
    ))
}

/// Harm and availability side by side: a guest that never moves is harmed least.
fn totals_table(totals: &[ComparisonTotal]) -> super::layout::Table {
    let mut table = new_table(&["guest", "conduct", "harmed", "in attacks", "completed", "stuck"]);
    for total in totals {
        let of_quiet = |text: String| if total.quiet > 0 { text } else { "-".to_owned() };
        table.add_row(vec![
            total.guest.clone(),
            total.conduct.clone(),
            format!("{} of {}", total.harmful, total.n),
            format!("{} of {}", total.harmed, total.variations),
            total.completed.map_or("-".to_owned(), |share| format!("{:.0} %", share * 100.0)),
            of_quiet(format!("{} of {}", total.stuck, total.quiet)),
        ]);
    }
    table
}

fn of_guest(comparison: &Comparison, guest: &str) -> String {
    let columns = [
        "attack",
        "bare: harmful",
        "bare: outcomes",
        "bare: to safe, ms",
        "guarded: harmful",
        "guarded: outcomes",
        "guarded: to safe, ms",
    ];
    let mut table = new_table(&columns);
    let row_of = |conduct: &'static str| comparison.rows.iter().filter(move |row| row.is_of(guest, conduct));
    for bare in row_of("bare") {
        let same = |other: &&ComparisonRow| other.scenario == bare.scenario && other.cell == bare.cell;
        let Some(guarded) = row_of("guarded").find(same) else { continue };
        let name = bare.cell.as_ref().map_or(bare.scenario.clone(), |cell| format!("{} {cell}", bare.scenario));
        let half = |row: &ComparisonRow| {
            let Share { hits, n, .. } = row.harmful;
            [format!("{hits} of {n}"), outcomes(&row.outcomes), sample(&row.to_safe_ms)]
        };
        table.add_row([vec![name], half(bare).to_vec(), half(guarded).to_vec()].concat());
    }
    let quiet = |row: &ComparisonRow| {
        format!(
            "{guest} {} without an attack: {} m driven on average, {} false trips, {:.1} % of set-points limited\n",
            row.conduct,
            row.driven_m.mean.map_or("-".to_owned(), |m| format!("{m:.1}")),
            row.false_trips,
            row.limited * 100.0
        )
    };
    let quiet: String = comparison.rows.iter().filter(|row| row.guest == guest && row.quiet).map(quiet).collect();
    format!("{guest}\n{table}\n{quiet}")
}
