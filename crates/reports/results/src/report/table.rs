//! Tables for a person at a terminal; tables of the HTML report are in `report::page`. Numbers only: the oracle judged them.

use std::collections::{BTreeMap, BTreeSet};

use comfy_table::{ContentArrangement, presets::UTF8_FULL_CONDENSED};
use evidence::FateName;
use evidence::trial::{Outcome, Trial};
use stats::Sample;

use super::layout::{Table, WIDTH, folded};
use super::reference::{LiveLatency, Reference, ReferenceRow};
use super::run::{RunObject, Summary};

/// Legend of the columns of a table of trials.
const LEGEND: &str = "\
ms: mean / p95 / upper 95 % bound on p95 (needs n >= 59), from the injection's receipt.
unsafe below: exact one-sided 95 % bound. refused: records, by reason.";

/// The table of the reference evaluation, for a file: as wide as its cells, so that no word in it is broken.
pub fn reference_table(reference: &Reference) -> String {
    let mut table = new_table(&[
        "scenario",
        "evidence, n",
        "outcomes",
        "unsafe below",
        "to degraded ms",
        "to hold-safe ms",
        "to revoked ms",
        "false trips",
    ]);
    for row in &reference.rows {
        table.add_row(reference_row(row));
    }
    let spoilt = host_line(reference.rows.iter().map(|row| (row.scenario.as_str(), &row.summary)));
    let table = table.with_every_column();
    format!(
        "{table}\nms: mean / p95 / upper 95 % bound on p95 (needs n >= 59). unsafe below: exact one-sided 95 % bound.\n\
         * the real mechanism runs live only: this n is no evidence of it.\n{spoilt}"
    )
}

/// The rows of one scenario as a line; lines of several modes are to be given apart, for their n are never added.
pub fn scenario_line(scenario: &str, rows: &[&ReferenceRow]) -> String {
    let verdict = if rows.iter().any(|row| row.unexpected > 0) {
        "UNEXPECTED"
    } else if rows.iter().all(|row| row.is_as_expected()) {
        "ok"
    } else {
        "not judged"
    };
    let n: usize = rows.iter().map(|row| row.summary.n).sum();
    let mode = rows.first().map_or("", |row| row.mode.name());
    let platforms: BTreeSet<&str> = rows.iter().filter_map(|row| row.platform.as_deref()).collect();
    let platforms: String = platforms.iter().map(|platform| format!(", {platform}")).collect();
    let mut counts: BTreeMap<Outcome, u64> = BTreeMap::new();
    for (class, n) in rows.iter().flat_map(|row| &row.summary.outcomes) {
        *counts.entry(*class).or_default() += n;
    }
    format!("{verdict:10} {scenario:29} {:24} {}", format!("{mode} {n}{platforms}"), outcomes(&counts))
}

fn reference_row(row: &ReferenceRow) -> Vec<String> {
    let mut outcomes = outcomes(&row.summary.outcomes);
    if row.unexpected > 0 {
        outcomes.push_str(&format!(" ({} unexpected)", row.unexpected));
    }
    if !row.not_judged_ms.is_empty() {
        outcomes.push_str(&format!(" ({} not judged: the host stalled)", row.not_judged_ms.len()));
    }
    vec![
        row.name(),
        format!("{}, {}{}", row.evidence.name(), row.summary.n, if row.counts { "" } else { " *" }),
        outcomes,
        unsafe_below(&row.summary),
        sample(&row.summary.latency_ms.to_degraded),
        sample(&row.summary.latency_ms.to_hold_safe),
        sample(&row.summary.latency_ms.to_authority_revoked),
        format!("{:.2}/h", row.summary.false_trips_per_hour),
    ]
}

/// The cells of a run, and all of them together.
fn cells_table(run: &RunObject) -> Table {
    let columns = ["cell", "n", "outcomes", "accepted / refused", "unsafe below", "to degraded ms", "to hold-safe ms"];
    let mut table = new_table(&columns);
    for cell in &run.cells {
        let refused: Vec<String> = cell.dropped.iter().map(|(reason, n)| format!("{reason} {n}")).collect();
        let accounts =
            format!("{} / {}", cell.accepted, if refused.is_empty() { "0".into() } else { refused.join(", ") });
        table.add_row(run_row(&cell.cell, accounts, &cell.summary));
    }
    let accepted: u64 = run.trials.iter().map(|t| t.accepted).sum();
    let received: u64 = run.trials.iter().map(|t| t.received).sum();
    let accounts = format!("{accepted} / {}", received.saturating_sub(accepted));
    table.add_row(run_row("all", accounts, &run.summary));
    table
}

/// The table of one run.
pub fn run_table(run: &RunObject) -> String {
    let table = cells_table(run);
    let mark = run.watermark.as_ref().map(|w| format!("{w}\n")).unwrap_or_default();
    let detector = run.detector.as_ref().map(|sha256| format!("detector {sha256}\n")).unwrap_or_default();
    let host = host_line([(run.scenario.as_str(), &run.summary)]);
    let text =
        [run.mission.lines(), fates(run), outsiders(&run.trials), unconfined(&run.trials), lateness(&run.trials), host]
            .concat();
    let on = run.platform.as_ref().map(|platform| format!(" on {platform}")).unwrap_or_default();
    let title = format!("{}{on} ({}, seed {})", run.scenario, run.mode.name(), run.seed);
    folded(&format!("{mark}{detector}{title}\n{table}\n{LEGEND}\n{text}"))
}

/// Datagrams that no process of the runs sent, where any came.
fn outsiders(trials: &[Trial]) -> String {
    let mut map: BTreeMap<&str, u64> = BTreeMap::new();
    for (at, n) in trials.iter().flat_map(|trial| &trial.outsiders) {
        *map.entry(at).or_default() += n;
    }
    if map.is_empty() {
        return String::new();
    }
    let texts: Vec<String> = map.iter().map(|(name, n)| format!("{name} {n}")).collect();
    format!("datagrams from outside of the run, counted apart: {}\n", texts.join(", "))
}

/// Trials with services that were confined in part or not at all, and the reasons, where there are any.
fn unconfined(trials: &[Trial]) -> String {
    let levels = trials.iter().filter_map(|trial| trial.confinement.as_deref()).filter(|level| *level != "full");
    let levels: BTreeSet<&str> = levels.collect();
    levels.iter().map(|level| format!("confinement of services: {level}\n")).collect()
}

/// The most by which the host was late in a trial, where that was measured.
fn lateness(trials: &[Trial]) -> String {
    let most = trials.iter().filter_map(|trial| trial.host_late_ms).max_by(f64::total_cmp);
    most.map(|ms| format!("the host was late by {ms:.0} ms at most\n")).unwrap_or_default()
}

/// The attempts that were repeated because the host had spoilt them, where any were, by name and seed.
pub(super) fn host_line<'a>(rows: impl IntoIterator<Item = (&'a str, &'a Summary)>) -> String {
    let (mut n, mut texts) = (0, Vec::new());
    for (name, spoilt) in rows.into_iter().filter_map(|(name, summary)| Some((name, summary.host_spoilt.as_ref()?))) {
        n += spoilt.n;
        let seeds: Vec<String> = spoilt.seeds.iter().map(u64::to_string).collect();
        texts.push(format!("{name} seed {}", seeds.join(", ")));
    }
    let attempts = if n == 1 { "attempt" } else { "attempts" };
    if n == 0 {
        return String::new();
    }
    format!("repeated because the host overslept: {n} {attempts} ({})\n", texts.join("; "))
}

/// Fate of the planned injections, where one was not noticed.
fn fates(run: &RunObject) -> String {
    let mut counts: BTreeMap<(FateName, String), u64> = BTreeMap::new();
    for injection in run.trials.iter().flat_map(|t| &t.injections) {
        let values = injection.mask.as_ref().map(|value| format!(" ({})", plain(value))).unwrap_or_default();
        *counts.entry((injection.fate, values)).or_default() += 1;
    }
    if counts.keys().all(|(fate, _)| *fate == FateName::Noticed) {
        return String::new();
    }
    let texts: Vec<String> =
        counts.iter().map(|((fate, author), n)| format!("{n} {}{author}", fate.describe())).collect();
    format!("injections: {}\n", texts.join(", "))
}

/// Obstacle of an injection, without the marks of JSON.
fn plain(value: &serde_json::Value) -> String {
    value.to_string().replace(['"', '{', '}', '[', ']'], "").replace(['_', ':', ','], " ")
}

fn run_row(cell: &str, accounts: String, summary: &Summary) -> Vec<String> {
    vec![
        cell.to_owned(),
        summary.n.to_string(),
        outcomes(&summary.outcomes),
        accounts,
        unsafe_below(summary),
        sample(&summary.latency_ms.to_degraded),
        sample(&summary.latency_ms.to_hold_safe),
    ]
}

/// Live latencies to degraded beside the paper's.
pub fn latency_table(rows: &[LiveLatency]) -> String {
    let mut table = new_table(&["loss", "to degraded, live ms", "n", "paper: mean ms", "paper: p95", "paper: n"]);
    for row in rows {
        table.add_row(vec![
            format!("{} ({})", row.paper.loss, row.scenario),
            sample(row.to_degraded()),
            row.to_degraded().n.to_string(),
            format!("{:.0}", row.paper.mean_ms),
            format!("< {:.0} ms", row.paper.p95_below_ms),
            row.paper.n.to_string(),
        ]);
    }
    format!(
        "{table}\nOther hardware and topology; the latency is mostly a chosen timeout: read it with the false trips.\n"
    )
}

/// An empty table of the measurements, which puts its own headings in.
pub fn started() -> comfy_table::Table {
    let mut table = comfy_table::Table::new();
    let table_of_a_page = table.load_style(UTF8_FULL_CONDENSED).set_content_arrangement(ContentArrangement::Dynamic);
    table_of_a_page.set_width(WIDTH as u16);
    table
}

/// An empty table with these headings.
pub fn new_table(columns: &[&str]) -> Table {
    Table::new(columns)
}

pub(super) fn outcomes(map: &BTreeMap<Outcome, u64>) -> String {
    let parts: Vec<String> = map.iter().map(|(class, n)| format!("{} {n}", class.name())).collect();
    parts.join(", ")
}

pub(super) fn percent(rate: f64) -> String {
    format!("{:.2} %", rate * 100.0)
}

/// The bound on the unsafe rate, where any trial bears on it.
fn unsafe_below(summary: &Summary) -> String {
    let bears = summary.outcomes.keys().any(|class| *class != Outcome::Invalid);
    if bears { percent(summary.unsafe_upper_95) } else { "-".to_owned() }
}

pub(super) fn sample(sample: &Sample) -> String {
    let whole = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| format!("{v:.0}"));
    if sample.n == 0 {
        return "-".to_owned();
    }
    format!("{} / {} / {}", whole(sample.mean), whole(sample.p95), whole(sample.p95_upper_95))
}

#[cfg(test)]
mod tests {
    use super::super::RunObject;
    use super::*;
    use crate::mode::Mode;

    #[test]
    fn words_of_a_run_stand_whole_at_80_columns() {
        let cells = ["verbatim/present/session-only", "relabelled/silent/origin-signed"];
        let mut trials: Vec<_> = (0..60).map(|s| Trial::example(s, Outcome::HoldSafe)).collect();
        for (trial, cell) in trials.iter_mut().zip(cells.iter().cycle()) {
            trial.cell = Some((*cell).to_owned());
        }
        for reason in ["not-current", "stale", "wrong-origin", "bad-signature"] {
            trials[0].dropped.insert(reason.to_owned(), 100_000);
        }
        let expected = cells.map(|cell| (cell.to_owned(), vec![Outcome::HoldSafe]));
        let run = RunObject::new("teammate", Mode::Twin, 7, trials, &expected);
        let text = cells_table(&run).fitted(80);
        assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
        for word in cells.into_iter().chain(["HOLD_SAFE", "not-current", "wrong-origin", "bad-signature", "100000"]) {
            assert!(text.contains(word), "{word}: {text}");
        }
        assert!(run_table(&run).contains("from the injection's receipt"));
    }

    fn reference_rows(trials: &[Trial]) -> Vec<ReferenceRow> {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..");
        let scenario = scenario::load(&root.join("scenarios/telemetry/loss.toml")).unwrap();
        let trials: Vec<&Trial> = trials.iter().collect();
        let places = [(None, None), (Some("air".to_owned()), Some("verbatim/present/session-only".to_owned()))];
        places.into_iter().map(|place| ReferenceRow::new(&scenario, place, (Mode::Twin, false), &trials)).collect()
    }

    #[test]
    fn no_word_of_the_reference_table_is_broken() {
        let mut trials: Vec<_> = (0..59).map(|s| Trial::example(s, Outcome::HoldSafe)).collect();
        trials.extend((0..3).map(|s| Trial::example(s, Outcome::FalseTrip)));
        let reference = Reference::new(7, reference_rows(&trials));
        let table = reference_table(&reference);
        for cell in reference.rows.iter().flat_map(reference_row) {
            assert!(table.lines().any(|line| line.contains(&cell)), "{cell} is broken: {table}");
        }
        let lines = table.lines().filter(|line| line.starts_with('│')).count();
        assert_eq!(lines, reference.rows.len() + 1, "a line a row, and the headings");
    }

    #[test]
    fn spoilt_trials_are_no_failures_of_the_platform() {
        let rows = |trial: Trial| reference_rows(&[trial]);
        let spoilt = Trial { host_stall_ms: Some(312.0), ..Trial::example(1, Outcome::Invalid) };
        for (trial, verdict) in [
            (Trial::example(1, Outcome::HoldSafe), "ok"),
            (Trial::example(1, Outcome::Invalid), "UNEXPECTED"),
            (spoilt, "not judged"),
        ] {
            let rows = rows(trial);
            let line = scenario_line("loss", &rows.iter().collect::<Vec<_>>());
            assert!(line.starts_with(verdict) && line.contains("twin 2, air"), "{line}");
            assert_eq!(Reference::new(1, rows).as_expected, verdict == "ok");
        }
    }

    #[test]
    fn trials_that_show_nothing_have_no_bound() {
        let trials = (0..2).map(|s| Trial::example(s, Outcome::Invalid)).collect();
        let text = run_table(&RunObject::new("delay", Mode::Twin, 7, trials, &[]));
        assert!(text.contains("INVALID 2") && !text.contains("100.00 %"), "{text}");
    }

    #[test]
    fn a_run_shows_its_counts_and_its_bound() {
        let trials = (0..59).map(|s| Trial::example(s, Outcome::HoldSafe)).collect();
        let text = run_table(&RunObject::new("delay", Mode::Twin, 7, trials, &[]));
        assert!(text.contains("HOLD_SAFE 59") && text.contains("4.95 %"), "{text}");
    }
}
