//! Outcomes by cell, expected beside got, as a picture that fits the kind of result: a matrix of cells, bars with intervals for a
//! campaign, bare beside guarded for guests, and findings of a search with the distances to the limits.

mod campaign;
mod cells;
mod search;

use std::collections::BTreeSet;

use evidence::trial::{Outcome, Outcomes};
use maud::{Markup, html};
use results::report::{Comparison, ComparisonRow, InWorlds, Matrix, MatrixRow, Reference};
use stats::{LEVEL, rate_lower};

use super::ablation;
use super::grid::{Cell, Grid, Row, leading, off};
use super::words;
use super::{curves, figure, latency};
use crate::Dossier;
use crate::reader::{FoundResult, Given};
use crate::tried::class_counts;

/// Most columns of a picture.
const COLUMNS: usize = 4;

pub(super) fn section(dossier: &Dossier) -> Markup {
    html! { @for given in dossier.results.files() { (picture(dossier, given)) } }
}

fn picture(dossier: &Dossier, given: &Given) -> Markup {
    match &given.found {
        FoundResult::Runs(runs) => cells::pictures(dossier, runs),
        FoundResult::BenchLive(bench) => {
            let runs: Vec<_> = bench.runs().cloned().collect();
            html! { (cells::pictures(dossier, &runs)) @if let Some(f) = latency::of_bench(bench) { (figure(&f)) } }
        }
        FoundResult::Matrix(matrix) => of_matrix(matrix),
        FoundResult::Reference(reference) => of_reference(reference),
        FoundResult::Campaign(campaign) => campaign::bars(campaign),
        FoundResult::Comparison(comparison) => of_comparison(comparison),
        FoundResult::Search(search) => search::found(search),
        FoundResult::Curve(curve) => {
            html! { h2 { "How strong an attack may be" } @for f in curves::of_curve(curve) { (figure(&f)) } }
        }
        FoundResult::Ablation(checks) => ablation::picture(checks),
        FoundResult::TwinCost(_) => html! {},
        FoundResult::Worlds(worlds) => of_worlds(worlds),
    }
}

/// The share at least, where all trials ended so: exact, one-sided.
fn at_least(outcomes: &Outcomes, class: Outcome, n: u64) -> String {
    let hits = outcomes.get(&class).copied().unwrap_or_default();
    format!("≥ {:.0} %", (rate_lower(hits, n, LEVEL) * 100.0).floor())
}

fn said(name: &str, words: &str) -> Markup {
    html! { h2 { (name) } p class="say" { (words) } }
}

fn of_matrix(matrix: &Matrix) -> Markup {
    let kinds: BTreeSet<_> =
        matrix.rows.iter().flat_map(|row| &row.kinds).map(|kind| (kind.evidence, kind.ablation)).collect();
    let columns = kinds.iter().map(|(evidence, ablation)| {
        let note = if *ablation { "a check waived (ABLATION)" } else { "every check" };
        (words::capital(words::place(*evidence)), note.to_owned())
    });
    let row = |row: &'_ MatrixRow| Row {
        name: row.id.clone(),
        note: super::matrix::unmarked(&row.threat),
        aside: row.interface.clone(),
        cells: Vec::new(),
    };
    let rows =
        matrix.rows.iter().map(|of| Row { cells: kinds.iter().map(|kind| threat(of, *kind)).collect(), ..row(of) });
    let grid = Grid {
        label: "Threats by place of evidence".to_owned(),
        columns: columns.collect(),
        rows_are: "threat".to_owned(),
        rows: rows.collect(),
    };
    html! {
        (said("Which threat comes to what", "Rows: threats of the catalogue. Columns: where the trials ran; n of one place are never added to those of another. A cell leads with what was not stated, then with harm."))
        (grid.markup())
    }
}

fn threat(row: &MatrixRow, (evidence, ablation): (scenario::Evidence, bool)) -> Option<Cell<'_>> {
    let kind = row.kinds.iter().find(|kind| (kind.evidence, kind.ablation) == (evidence, ablation))?;
    let reason = match (kind.unexpected, kind.counts) {
        (0, true) => "as stated".to_owned(),
        (_, true) => String::new(),
        (_, false) => "its mechanism does not run there".to_owned(),
    };
    let bound = format!("unsafe < {}", words::percent(kind.unsafe_upper_95));
    Some(Cell { outcomes: &kind.outcomes, n: kind.n, expected: &[], off: kind.unexpected, reason, bound, run: None })
}

/// Each scenario in its own scene and in drawn worlds.
fn of_worlds(worlds: &InWorlds) -> Markup {
    html! {
        h2 { "In drawn worlds" }
        table {
            tr { th { "scenario" } th { "own scene" } th { "drawn worlds" } th { "holds" } }
            @for row in &worlds.rows {
                tr {
                    td { (row.scenario) @if let Some(cell) = &row.cell { " (" (cell) ")" } }
                    td { (class_counts(&row.own.outcomes)) }
                    td { (class_counts(&row.drawn.outcomes)) }
                    td { (row.holds.words()) }
                }
            }
        }
    }
}

fn of_reference(reference: &Reference) -> Markup {
    let places: BTreeSet<_> = reference.rows.iter().map(|row| row.evidence).collect();
    let names: Vec<(String, String)> = reference.rows.iter().fold(Vec::new(), |mut all, row| {
        let name = (row.scenario.clone(), row.cell.clone().unwrap_or_default());
        if !all.contains(&name) {
            all.push(name);
        }
        all
    });
    let cell = |name: &(String, String), place| {
        let is_meant = |row: &&results::report::ReferenceRow| {
            row.scenario == name.0 && row.cell.clone().unwrap_or_default() == name.1 && row.evidence == place
        };
        let row = reference.rows.iter().find(is_meant)?;
        let (outcomes, n) = (&row.summary.outcomes, row.summary.n as u64);
        let bound = leading(outcomes, &row.expected).map(|class| at_least(outcomes, class, n)).unwrap_or_default();
        Some(Cell {
            outcomes,
            n,
            expected: &row.expected,
            off: off(outcomes, &row.expected),
            reason: cells::reason_of(&row.summary, &row.expected),
            bound,
            run: None,
        })
    };
    let rows = names.iter().map(|name| Row {
        name: name.0.clone(),
        note: name.1.replace('/', ", "),
        aside: String::new(),
        cells: places.iter().map(|place| cell(name, *place)).collect(),
    });
    let grid = Grid {
        label: "Scenarios by place of evidence".to_owned(),
        columns: places.iter().map(|place| (words::capital(words::place(*place)), String::new())).collect(),
        rows_are: "scenario".to_owned(),
        rows: rows.collect(),
    };
    html! { (said("How each scenario ended", "Columns: where the trials ran.")) (grid.markup()) }
}

fn of_comparison(comparison: &Comparison) -> Markup {
    let mut guests: Vec<&str> = comparison.rows.iter().map(|row| row.guest.as_str()).collect();
    guests.sort_unstable();
    guests.dedup();
    html! {
        (said("Bare beside guarded", "Rows: what is done. Columns: the guest's set-points as they are, and inside the platform's guards, under the same seeds. Harmful: UNSAFE or LATE, of trials with evidence."))
        @for guest in guests {
            h3 { (guest) }
            (guest_grid(comparison, guest).markup())
        }
    }
}

fn guest_grid<'a>(comparison: &'a Comparison, guest: &str) -> Grid<'a> {
    let of = |conduct: &'static str| comparison.rows.iter().filter(move |row| row.conduct == conduct);
    let rows = of("bare").filter(|row| row.guest == guest).map(|bare| {
        let same = |other: &&ComparisonRow| {
            other.guest == bare.guest && other.scenario == bare.scenario && other.cell == bare.cell
        };
        Row {
            name: bare.scenario.clone(),
            note: bare.cell.as_ref().map(|cell| cell.replace('/', ", ")).unwrap_or_default(),
            aside: if bare.quiet { "no attack".to_owned() } else { String::new() },
            cells: vec![Some(guest_cell(bare)), of("guarded").find(same).map(guest_cell)],
        }
    });
    Grid {
        label: format!("{guest}, bare beside guarded"),
        columns: vec![
            ("Bare".to_owned(), "no guard".to_owned()),
            ("Guarded".to_owned(), "inside the guards".to_owned()),
        ],
        rows_are: "scenario".to_owned(),
        rows: rows.collect(),
    }
}

fn guest_cell(row: &ComparisonRow) -> Cell<'_> {
    let safe = row.to_safe_ms.mean.map(|ms| format!(", safe in {}", words::milliseconds(ms))).unwrap_or_default();
    let share = &row.harmful;
    Cell {
        outcomes: &row.outcomes,
        n: row.outcomes.values().sum(),
        expected: &[],
        off: 0,
        reason: format!("{} of {} harmful{safe}", share.hits, share.n),
        bound: format!("{:.0} to {:.0} %", share.lower_95 * 100.0, share.upper_95 * 100.0),
        run: None,
    }
}
