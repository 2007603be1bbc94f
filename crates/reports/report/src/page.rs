//! The reviewer's page: one self-contained HTML file, no script, dark and light, printable. It tells a story.
//!
//! | module | part, in the order of the page |
//! |---|---|
//! | `finding` | the finding in a sentence, numbers in another, four numbers; INVALID first of all |
//! | `waived` | ablations in words |
//! | `outcomes` | outcomes by cell, expected beside got, as a picture for each kind of result (`grid`, `shape`) |
//! | `runs` | the kept runs that the finding names, on one axis, and the chain of why |
//! | `distances`, `cost` | distances to the limits; cost of the checks |
//! | `evidence`, `next` | recordings, digests and every number, folded; two commands that lead on |
//!
//! `words` has the words and numbers. Results are not judged again.

mod ablation;
mod claims;
mod cost;
mod curves;
mod distances;
mod evidence;
mod finding;
mod grid;
mod latency;
mod matrix;
mod missions;
mod next;
mod outcomes;
mod runs;
mod shape;
mod waived;
mod words;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::Dossier;
use crate::figure::{Figure, Table, palette_sheet};
use crate::reader::FoundResult;
use crate::tried::tried;

/// Background of the page, light.
pub(crate) const PAPER_LIGHT: &str = "#ffffff";
/// Background of the page, dark.
pub(crate) const PAPER_DARK: &str = "#161412";

/// The whole page.
pub fn page(dossier: &Dossier) -> String {
    let findings = finding::findings(dossier);
    let (told, rest) = runs::chosen(dossier, &findings);
    let broken = dossier.recordings.iter().any(|of| of.invalid.is_some());
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                @if let Some(seconds) = dossier.renew_s { meta http-equiv="refresh" content=(seconds); }
                title { (title(dossier, &findings)) }
                style { (PreEscaped(style())) }
            }
            body {
                header {
                    p class="crumb" { (crumb(dossier)) }
                    (finding::markup(dossier, &findings))
                    (waived::note(dossier))
                }
                main {
                    @if broken { section id="evidence" { (evidence::section(dossier)) } }
                    section id="outcomes" { (outcomes::section(dossier)) }
                    section id="runs" { (runs::section(&told, &rest)) }
                    section id="distances" { (distances::section(dossier, &told)) }
                    section id="cost" { (cost::section(dossier)) }
                    @if !broken { section id="evidence" { (evidence::section(dossier)) } }
                    (next::section(dossier, &told))
                }
                footer { p {
                    "A simulation on one machine’s loopback; the adversary attacks the twin and nothing else. Trials of the twin, of the real stacks and of "
                    "live runs are never added. Made by holdsafe " (dossier.version) "."
                } }
            }
        }
    };
    page.into_string()
}

fn style() -> String {
    let (rules, light, dark) = palette_sheet();
    format!(
        ":root{{--paper:{PAPER_LIGHT};{light}}}\
         @media (prefers-color-scheme:dark){{:root{{--paper:{PAPER_DARK};{dark}}}}}\
         @media print{{:root{{--paper:{PAPER_LIGHT};{light}}}}}{rules}{}",
        include_str!("page/style.css")
    )
}

fn title(dossier: &Dossier, findings: &[finding::Finding]) -> String {
    match (dossier.title.as_str(), findings.first()) {
        ("", Some(first)) => first.text(),
        ("", None) => "holdsafe report".to_owned(),
        (title, _) => title.to_owned(),
    }
}

/// Subject of the page, in a line of parts.
fn crumb(dossier: &Dossier) -> String {
    let mut parts = vec!["holdsafe report".to_owned()];
    parts.extend((!dossier.title.is_empty()).then(|| dossier.title.clone()));
    for given in dossier.results.files().iter().take(4) {
        let all = tried(given);
        let scenarios: std::collections::BTreeSet<&str> = all.iter().map(|one| one.scenario).collect();
        let scenario = if let FoundResult::Search(search) = &given.found {
            search.scenario.as_str()
        } else if let FoundResult::Curve(curve) = &given.found {
            curve.scenario.as_str()
        } else {
            scenarios
                .into_iter()
                .next()
                .filter(|first| all.iter().all(|one| one.scenario == *first))
                .unwrap_or_default()
        };
        parts.push(format!("{} {scenario}", given.found.kind()).trim_end().to_owned());
        let places: std::collections::BTreeSet<&str> = all.iter().map(|one| words::place(one.evidence)).collect();
        parts.extend(places.into_iter().map(str::to_owned));
        parts.extend(all.first().and_then(|one| one.seed).map(|seed| format!("seed {seed}")));
        if let (true, Some(first)) = (all.len() > 1, all.first()) {
            let same = all.iter().all(|one| one.n == first.n);
            let each = if same { format!(" × {}", words::number(first.n, "trial")) } else { String::new() };
            parts.push(format!(
                "{}{each}",
                words::number(all.len() as u64, if first.cell.is_some() { "cell" } else { "variation" })
            ));
        }
    }
    parts.extend((!dossier.stories.is_empty()).then(|| words::number(dossier.stories.len() as u64, "kept run")));
    parts.join(" · ")
}

/// Every figure of the page that goes into a file, in its order.
pub fn figures(dossier: &Dossier) -> Vec<Figure> {
    let mut all = matrix::figures(dossier);
    all.extend(dossier.stories.iter().map(runs::drawn));
    all.extend(latency::figures(dossier));
    all.extend(curves::figures(dossier));
    all.extend(cost::figures(dossier));
    all
}

/// A figure: the drawing, its caption, and the numbers.
fn figure(figure: &Figure) -> Markup {
    html! {
        figure id=(figure.name) {
            div class="scroll" tabindex="0" role="region" aria-label={ (figure.title) ", drawing" } {
                (PreEscaped(figure.drawing.inline(&figure.title)))
            }
            figcaption { strong { (figure.title) "." } " " (figure.caption) }
            details { summary { "The same in numbers" } (table(&figure.table, &figure.title)) }
        }
    }
}

/// A table that scrolls by itself where the page is narrow.
fn table(table: &Table, label: &str) -> Markup {
    html! {
        div class="scroll" tabindex="0" role="region" aria-label={ (label) ", table" } {
            table {
                thead { tr { @for cell in &table.head { th scope="col" { (cell) } } } }
                tbody { @for row in &table.rows { tr { @for cell in row { (data(cell)) } } } }
            }
        }
    }
}

fn data(cell: &str) -> Markup {
    let is_digest = cell.len() == 64 && cell.bytes().all(|b| b.is_ascii_hexdigit());
    html! { td class=[is_digest.then_some("hash")] { (cell) } }
}

/// Lower case, digits and hyphens: for anchors and names of files.
fn slug(name: &str) -> String {
    let mut slug = String::new();
    for c in name.chars() {
        if c.is_ascii_alphanumeric() {
            slug.push(c.to_ascii_lowercase());
        } else if !slug.is_empty() && !slug.ends_with('-') {
            slug.push('-');
        }
    }
    slug.trim_end_matches('-').to_owned()
}

#[cfg(test)]
mod tests;
