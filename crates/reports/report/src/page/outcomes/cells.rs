//! Runs as a picture: the cells of a scenario by the parts of their names, the policy across; scenarios without cells one below the other.

use evidence::trial::{Outcome, Trial};
use maud::{Markup, html};
use results::report::{RunObject, Summary};

use super::{COLUMNS, at_least, said};
use crate::Dossier;
use crate::page::grid::{Cell, Grid, Row, leading, off};
use crate::page::{slug, words};

/// Letters of a finding that a cell has room for.
const LETTERS: usize = 90;

/// The pictures of these runs.
pub(super) fn pictures(dossier: &Dossier, runs: &[RunObject]) -> Markup {
    let (with, without): (Vec<&RunObject>, Vec<&RunObject>) = runs.iter().partition(|run| !run.cells.is_empty());
    html! {
        @for run in with { (of_cells(dossier, run)) }
        @if !without.is_empty() { (of_runs(dossier, &without)) }
    }
}

fn of_cells(dossier: &Dossier, run: &RunObject) -> Markup {
    let (grid, across) = crossed(dossier, run).map_or_else(|| (listed(dossier, run), false), |grid| (grid, true));
    let words = if across {
        format!(
            "{}, {}, from seed {}. Rows: what is done. Columns: what the policy checks. A cell has how its trials ended and why, times on average; what was \
             stated beforehand where that is not the same; ≥: the true share at least (95 %).",
            words::capital(&run.scenario),
            words::place(run.mode.evidence()),
            run.seed
        )
    } else {
        format!(
            "{}, {}, from seed {}. A row a cell. ≥: true share at least (95 %).",
            words::capital(&run.scenario),
            words::place(run.mode.evidence()),
            run.seed
        )
    };
    html! { (said(if across { "Which check stops what" } else { "How each cell ended" }, &words)) (grid.markup()) }
}

/// Cells whose names are all parts of one length, the last across; `None` where they are not.
fn crossed<'a>(dossier: &Dossier, run: &'a RunObject) -> Option<Grid<'a>> {
    let split: Option<Vec<(&str, &str)>> = run.cells.iter().map(|cell| cell.cell.rsplit_once('/')).collect();
    let (mut columns, mut rows): (Vec<&str>, Vec<&str>) = (Vec::new(), Vec::new());
    for (row, column) in split? {
        if !columns.contains(&column) {
            columns.push(column);
        }
        if !rows.contains(&row) {
            rows.push(row);
        }
    }
    if columns.len() < 2 || columns.len() > COLUMNS {
        return None;
    }
    let row = |name: &&str| {
        let (first, rest) = name.split_once('/').unwrap_or((*name, ""));
        let aside: Vec<&str> =
            rest.split('/').filter(|part| !part.is_empty()).map(|part| words::note(part).unwrap_or(part)).collect();
        Row {
            name: words::capital(first),
            note: words::note(first).unwrap_or_default().to_owned(),
            aside: aside.join(", "),
            cells: columns.iter().map(|column| cell(dossier, run, &format!("{name}/{column}"))).collect(),
        }
    };
    Some(Grid {
        label: format!("Cells of {}", run.scenario),
        columns: columns
            .iter()
            .map(|name| (words::capital(&name.replace('-', " ")), words::note(name).unwrap_or_default().to_owned()))
            .collect(),
        rows_are: "what is done".to_owned(),
        rows: rows.iter().map(row).collect(),
    })
}

/// Cells one below the other.
fn listed<'a>(dossier: &Dossier, run: &'a RunObject) -> Grid<'a> {
    let row = |of: &'a results::report::CellSummary| Row {
        name: of.cell.replace('/', ", "),
        note: words::sentence(&of.cell).unwrap_or_default(),
        aside: String::new(),
        cells: vec![cell(dossier, run, &of.cell)],
    };
    Grid {
        label: format!("Cells of {}", run.scenario),
        columns: vec![("How its trials ended".to_owned(), String::new())],
        rows_are: "cell".to_owned(),
        rows: run.cells.iter().map(row).collect(),
    }
}

fn cell<'a>(dossier: &Dossier, run: &'a RunObject, name: &str) -> Option<Cell<'a>> {
    let of = run.cells.iter().find(|cell| cell.cell == name)?;
    let own: Vec<&Trial> = run.trials.iter().filter(|trial| trial.cell.as_deref() == Some(name)).collect();
    let class = leading(&of.summary.outcomes, &of.expected)?;
    let refused = of.dropped.iter().max_by_key(|(_, n)| **n).filter(|_| class == Outcome::Rejected);
    let reason = match refused {
        Some((reason, _)) => format!("refused: {}", words::refusal(reason)),
        None => reason(&of.summary, class, &own),
    };
    Some(Cell {
        outcomes: &of.summary.outcomes,
        n: of.summary.n as u64,
        expected: &of.expected,
        off: off(&of.summary.outcomes, &of.expected),
        reason,
        bound: at_least(&of.summary.outcomes, class, of.summary.n as u64),
        run: told(dossier, &own),
    })
}

fn of_runs(dossier: &Dossier, runs: &[&RunObject]) -> Markup {
    let rows = runs.iter().map(|run| {
        let own: Vec<&Trial> = run.trials.iter().collect();
        let class = leading(&run.summary.outcomes, &run.expected);
        Row {
            name: run.scenario.clone(),
            note: format!("{}, from seed {}", words::place(run.mode.evidence()), run.seed),
            aside: run
                .watermark
                .as_deref()
                .and_then(|mark| mark.strip_prefix("GUEST: "))
                .map(|of| of.replace('`', ""))
                .or(run.platform.clone())
                .unwrap_or_default(),
            cells: vec![class.map(|class| Cell {
                outcomes: &run.summary.outcomes,
                n: run.summary.n as u64,
                expected: &run.expected,
                off: off(&run.summary.outcomes, &run.expected),
                reason: reason(&run.summary, class, &own),
                bound: at_least(&run.summary.outcomes, class, run.summary.n as u64),
                run: told(dossier, &own),
            })],
        }
    });
    let grid = Grid {
        label: "Outcomes by scenario".to_owned(),
        columns: vec![("How its trials ended".to_owned(), "and what was stated, where that was more".to_owned())],
        rows_are: "scenario".to_owned(),
        rows: rows.collect(),
    };
    html! { (said("How it ended", "≥: true share at least (95 %).")) (grid.markup()) }
}

/// How trials of this class came to it, without their findings.
pub(super) fn reason_of(summary: &Summary, expected: &[Outcome]) -> String {
    leading(&summary.outcomes, expected).map(|class| reason(summary, class, &[])).unwrap_or_default()
}

fn reason(summary: &Summary, class: Outcome, own: &[&Trial]) -> String {
    let latency = &summary.latency_ms;
    let latency = [(Outcome::HoldSafe, latency.to_hold_safe.mean), (Outcome::Degraded, latency.to_degraded.mean)];
    if let Some(ms) = latency.into_iter().find(|(of, _)| *of == class).and_then(|(_, mean)| mean) {
        return format!("in {}", words::milliseconds(ms));
    }
    let finding = own.iter().filter(|trial| trial.outcome == class).find_map(|trial| trial.findings.first());
    match (class, finding) {
        (Outcome::Undetected, _) => "accepted, no response".to_owned(),
        (Outcome::Rejected, _) => "refused at the boundary".to_owned(),
        (_, Some(finding)) => shortened(finding),
        (_, None) => String::new(),
    }
}

fn shortened(finding: &str) -> String {
    match finding.char_indices().nth(LETTERS) {
        None => finding.to_owned(),
        Some((at, _)) => format!("{}…", finding.get(..at).unwrap_or_default()),
    }
}

/// Anchor of the run of one of these trials that is told below.
fn told(dossier: &Dossier, own: &[&Trial]) -> Option<String> {
    let name = own.iter().find_map(|trial| dossier.kept.get(trial.held.as_ref()?))?;
    Some(format!("run-{}", slug(name)))
}
