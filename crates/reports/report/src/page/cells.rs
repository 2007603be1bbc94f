//! The cells of a scenario that has them: a row a cell, its expected classes beside its outcomes.

use evidence::trial::{Outcome, Trial};
use maud::{Markup, html};
use results::report::{CellSummary, RunObject};

use super::verdict::percent;
use crate::Dossier;
use crate::figure::class_of_outcome;
use crate::reader::FoundResult;
use crate::tried::either;

pub(super) fn section(dossier: &Dossier) -> Markup {
    html! { @for file in dossier.results.files() { @if let FoundResult::Runs(runs) = &file.found {
        @for run in runs.iter().filter(|run| !run.cells.is_empty()) { (table(dossier, run)) }
    } } }
}

fn table(dossier: &Dossier, run: &RunObject) -> Markup {
    let label = format!("{}, {}, cell by cell", run.scenario, run.mode.evidence().name());
    let late = run.cells.iter().any(|cell| cell.summary.latency_ms.to_hold_safe.n > 0);
    html! {
        h3 { (run.scenario) ", " (run.mode.evidence().name()) ", from seed " (run.seed) }
        @if let Some(mark) = &run.watermark { p class="watermark" { (mark) } }
        div class="scroll" tabindex="0" role="region" aria-label={ (label) ", table" } { table {
            thead { tr {
                @for head in ["cell", "n", "expected", "got", "not expected"] { th scope="col" { (head) } }
                @if late { th scope="col" { "to HOLD_SAFE (ms, mean)" } }
                @for head in ["unsafe below (95 %)", "over time"] { th scope="col" { (head) } }
            } }
            tbody { @for cell in &run.cells { (row(dossier, run, cell, late)) } }
        } }
    }
}

fn row(dossier: &Dossier, run: &RunObject, cell: &CellSummary, late: bool) -> Markup {
    let outcomes = &cell.summary.outcomes;
    let off: u64 = outcomes.iter().filter(|(class, _)| class.is_unexpected(&cell.expected)).map(|(_, n)| n).sum();
    let trials = run.trials.iter().filter(|trial| trial.cell.as_deref() == Some(&cell.cell));
    let mean = cell.summary.latency_ms.to_hold_safe.mean.map_or_else(String::new, |ms| format!("{ms:.1}"));
    html! { tr {
        td { (cell.cell) }
        td { (cell.summary.n) }
        td { (either(&cell.expected)) }
        td { @for (class, n) in outcomes { (word(*class)) " " (n) " " } }
        td { @if off > 0 { strong class="bad-word" { (off) } } @else { "0" } }
        @if late { td { (mean) } }
        td { (percent(cell.summary.unsafe_upper_95)) }
        td { @if let Some((story, seed)) = trials.into_iter().find_map(|trial| run_and_seed(dossier, trial)) {
            a href={ "#run-" (super::slug(story)) } { "seed " (seed) }
        } }
    } }
}

/// The run of a trial, where it is reported, and its seed.
fn run_and_seed<'a>(dossier: &'a Dossier, trial: &Trial) -> Option<(&'a str, u64)> {
    Some((dossier.kept.get(trial.held.as_ref()?)?.as_str(), trial.seed))
}

/// A class with its colour.
fn word(class: Outcome) -> Markup {
    html! {
        svg width="12" height="12" aria-hidden="true" { rect class=(class_of_outcome(class.name())) width="12" height="12" {} }
        " " (class.name())
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::reader::{Results, golden};

    /// Row of a cell with these outcomes, HOLD_SAFE expected, on a page that tells its run.
    fn rows(outcomes: &serde_json::Value) -> String {
        let mut run = golden("run");
        let mut cell = json!({"cell": "silent/<x>", "expected": ["HOLD_SAFE"], "accepted": 1, "dropped": {}});
        cell["summary"] = run["summary"].clone();
        cell["summary"]["outcomes"] = outcomes.clone();
        run["cells"] = json!([cell]);
        (run["trials"][0]["cell"], run["trials"][0]["held"]) = (json!("silent/<x>"), json!("ab"));
        let mut results = Results::default();
        results.read("run.json", run.to_string().as_bytes()).expect("a run");
        let kept = [("ab".to_owned(), "teammate silent, twin".to_owned())].into();
        section(&Dossier { results, kept, ..Dossier::default() }).into_string()
    }

    #[test]
    fn cell_has_expected_class_beside_its_outcome() {
        let page = rows(&json!({"HOLD_SAFE": 3}));
        let (head, rest) = page.split_once("<td>HOLD_SAFE</td>").expect("the expected class");
        assert!(head.ends_with("<td>silent/&lt;x&gt;</td><td>2</td>"), "{head}");
        assert!(rest.contains("HOLD_SAFE 3") && rest.contains("<td>0</td>"), "{rest}");
        assert!(rest.contains("href=\"#run-teammate-silent-twin\""), "{rest}");
    }

    #[test]
    fn unexpected_trials_of_a_cell_stand_out() {
        let page = rows(&json!({"HOLD_SAFE": 3, "LATE": 2}));
        assert!(page.contains("<strong class=\"bad-word\">2</strong>"), "{page}");
    }
}
