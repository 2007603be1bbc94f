//! The files that the page was made from, by digest, and the findings of searches in them.

use maud::{Markup, html};
use results::report::SearchObject;

use super::table;
use crate::Dossier;
use crate::figure::Table;
use crate::reader::FoundResult;

pub(super) fn section(dossier: &Dossier) -> Markup {
    let mut rows = Table::new(&["file", "kind", "SHA-256"]);
    for given in dossier.results.files() {
        rows.rows.push(vec![given.file.clone(), given.found.kind().to_owned(), given.sha256.clone()]);
    }
    html! {
        @for file in dossier.results.files() { @if let FoundResult::Search(search) = &file.found { (searched(search)) } }
        @if !rows.rows.is_empty() { (table(&rows, "Files")) }
        @if !dossier.recordings.is_empty() { (folded(dossier)) }
        p { "The page holds nothing that is not in these files and, for runs over time, in the recordings above. A recording's digest is over its files "
            code { "recording/*.mcap" } ", one behind the other; each was checked when the page was made, and is again with " code { "holdsafe inspect verify DIR" } "." }
    }
}

/// The recordings, in one line while all of them verify.
fn folded(dossier: &Dossier) -> Markup {
    let (n, sound) = (dossier.recordings.len(), dossier.recordings.iter().all(|recording| recording.invalid.is_none()));
    html! { details open[!sound] {
        summary { (n) " recordings" @if sound { ", all verify" } @else { ", not all of which verify" } }
        (table(&recordings(dossier), "Recordings"))
    } }
}

fn recordings(dossier: &Dossier) -> Table {
    let mut rows = Table::new(&["recording", "SHA-256", "verification", "class of its trial", "INVALID because"]);
    for of in &dossier.recordings {
        let verification = if of.holds { "holds" } else { "does not hold" };
        let class = of.outcome.clone().unwrap_or_else(|| "not told".to_owned());
        let reason = of.invalid.clone().unwrap_or_default();
        rows.rows.push(vec![of.name.clone(), of.sha256.clone(), verification.to_owned(), class, reason]);
    }
    rows
}

fn searched(search: &SearchObject) -> Markup {
    let mut rows = Table::new(&["class", "broken", "shortest sequence", "stopped by", "again"]);
    for f in &search.findings {
        let cells = [
            f.outcome.name().to_owned(),
            f.broken.clone(),
            f.word.clone(),
            f.stopped_by.join(", "),
            f.reproduce.clone(),
        ];
        rows.rows.push(cells.to_vec());
    }
    html! {
        h3 { "A search of " (search.hunt.trials) " trials of attack space " (search.alphabet) " on scenario " (search.scenario) }
        @if let Some(mark) = &search.watermark { p class="watermark" { (mark) } }
        @if search.findings.is_empty() { p { "Nothing was found; that is no proof that there is nothing." } } @else { (table(&rows, "Findings")) }
    }
}
