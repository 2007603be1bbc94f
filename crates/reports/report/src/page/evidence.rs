//! Evidence, folded while all of it verifies, open where one recording does not: recordings, digests of the files, and the same in numbers.

use std::collections::BTreeMap;

use evidence::trial::Outcomes;
use maud::{Markup, html};

use super::{claims, latency, matrix, missions, table, words};
use crate::Dossier;
use crate::figure::Table;
use crate::tried::{Tried, class_counts, tried};

pub(super) fn section(dossier: &Dossier) -> Markup {
    html! {
        h2 { "Evidence" }
        @if !dossier.recordings.is_empty() { (recordings(dossier)) }
        @if !dossier.results.files().is_empty() {
            details { summary { "Results and their digests" } (table(&files(dossier), "Files")) }
            (numbers(dossier))
        }
        p class="say" {
            "The page holds nothing that is not in these files and recordings. A recording's digest is over its files "
            code { "recording/*.mcap" } ", one behind the other; each was checked when the page was made, and is again with " code { "holdsafe inspect verify DIR" } "."
        }
    }
}

/// The recordings, in one line while all of them verify.
fn recordings(dossier: &Dossier) -> Markup {
    let (n, sound) =
        (dossier.recordings.len() as u64, dossier.recordings.iter().all(|recording| recording.invalid.is_none()));
    html! { details open[!sound] {
        summary { (words::number(n, "recording")) @if sound { ", all verify" } @else { ", not all of which verify" } }
        (table(&rows(dossier), "Recordings"))
    } }
}

fn rows(dossier: &Dossier) -> Table {
    let mut rows = Table::new(&["recording", "verification", "class of its trial", "INVALID because", "SHA-256"]);
    for of in &dossier.recordings {
        let verification = if of.holds { "holds" } else { "does not hold" };
        let class = of.outcome.clone().unwrap_or_else(|| "not told".to_owned());
        let reason = of.invalid.clone().unwrap_or_default();
        rows.rows.push(vec![of.name.clone(), verification.to_owned(), class, reason, of.sha256.clone()]);
    }
    rows
}

fn files(dossier: &Dossier) -> Table {
    let mut rows = Table::new(&["file", "kind", "SHA-256"]);
    for given in dossier.results.files() {
        rows.rows.push(vec![given.file.clone(), given.found.kind().to_owned(), given.sha256.clone()]);
    }
    rows
}

fn numbers(dossier: &Dossier) -> Markup {
    let named = [
        ("Outcomes by place of evidence", places(dossier)),
        ("Every variation", variations(dossier)),
        ("Threats in words", matrix::words_of(dossier)),
        ("Claims", claims::rows(dossier)),
        ("Missions", missions::rows(dossier)),
        ("Latencies", latency::rows(dossier)),
    ];
    html! { details {
        summary { "The same in numbers" }
        @for (name, rows) in named.iter().filter(|(_, rows)| !rows.rows.is_empty()) { h3 { (name) } (table(rows, name)) }
    } }
}

/// A row a variation.
fn variations(dossier: &Dossier) -> Table {
    let mut rows = Table::new(&["variation", "n", "stated", "got", "not stated", "unsafe below (95 %)", "again"]);
    for one in dossier.results.files().iter().flat_map(tried) {
        let off: u64 = one.unexpected().map(|(_, n)| n).sum();
        let upper = one.unsafe_upper_95.map_or_else(|| "-".to_owned(), words::percent);
        let cells = [
            one.name(),
            one.n.to_string(),
            one.expected_told(),
            class_counts(&one.outcomes),
            off.to_string(),
            upper,
            one.reproduce.clone(),
        ];
        rows.rows.push(cells.to_vec());
    }
    rows
}

/// Trials of one place of evidence in one result.
#[derive(Default)]
struct Counted {
    n: u64,
    outcomes: Outcomes,
    off: u64,
    unsafe_upper: Option<f64>,
}

fn places(dossier: &Dossier) -> Table {
    let mut rows = Table::new(&["result", "evidence", "n", "outcomes", "not stated", "unsafe below (95 %, worst row)"]);
    for given in dossier.results.files() {
        let mut by: BTreeMap<(&str, bool), Counted> = BTreeMap::new();
        // A variation may be in several rows of a matrix, with the same trials. With a guest, bare or guarded, it has others.
        let mut seen = std::collections::BTreeSet::new();
        let all = tried(given);
        for one in all.iter().filter(|one| seen.insert((one.name(), one.watermark))) {
            take(by.entry((one.evidence.name(), one.watermark.is_some())).or_default(), one);
        }
        for ((place, waived), c) in by {
            let place = if waived { format!("{place}, ABLATION") } else { place.to_owned() };
            let upper = c.unsafe_upper.map_or_else(|| "-".to_owned(), words::percent);
            rows.rows.push(vec![
                given.file.clone(),
                place,
                c.n.to_string(),
                class_counts(&c.outcomes),
                c.off.to_string(),
                upper,
            ]);
        }
    }
    rows
}

fn take(to: &mut Counted, one: &Tried) {
    to.n += one.n;
    to.off += one.unexpected().map(|(_, n)| n).sum::<u64>();
    one.outcomes.iter().for_each(|(class, n)| *to.outcomes.entry(*class).or_default() += n);
    to.unsafe_upper = [to.unsafe_upper, one.unsafe_upper_95].into_iter().flatten().reduce(f64::max);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reader::Results;

    #[test]
    fn trial_in_several_rows_counts_once() {
        let text = include_str!("../../tests/results/matrix.json");
        let read = |text: &str| {
            let mut results = Results::default();
            results.read("m.json", text.as_bytes()).expect("a matrix");
            places(&Dossier { results, ..Dossier::default() })
        };
        let mut doubled: serde_json::Value = serde_json::from_str(text).expect("JSON");
        let rows = doubled["rows"].as_array_mut().expect("rows");
        let repeated = rows.clone();
        rows.extend(repeated);
        assert!(!read(text).rows.is_empty());
        assert_eq!(read(text), read(&doubled.to_string()));
    }
}
