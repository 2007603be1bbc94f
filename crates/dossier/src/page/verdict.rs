//! The verdict, first of all: of each result how many trials ended as was expected beforehand, and the worst that was not.

use std::collections::{BTreeMap, BTreeSet};

use evidence::trial::{Outcome, Outcomes};
use maud::{Markup, html};
use scenario::Evidence;

use super::{key, table};
use crate::Dossier;
use crate::figure::{Table, class_of_outcome};
use crate::reader::{Found, Given};
use crate::tried::{told, tried};

/// Trials of one place of evidence under a full policy, in one result.
#[derive(Clone, Debug, Default)]
pub(super) struct Counted {
    /// Trials.
    n: u64,
    /// Outside their expected classes; `None` where none were stated.
    unexpected: Option<u64>,
    /// Outcomes.
    outcomes: Outcomes,
    /// The worst of the exact upper 95 % bounds on the unsafe rate.
    unsafe_upper: Option<f64>,
}

/// A result's trials, by place of evidence and whether a check was waived.
type ByPlace = BTreeMap<(Evidence, bool), Counted>;

/// Recordings that are INVALID and named in the verdict.
const NAMED: usize = 8;

/// Note beside the results when one of their recordings is INVALID.
const UNSUPPORTED: &str = "That is what the results say; no INVALID recording supports it.";

/// The verdict.
pub(super) fn verdict(dossier: &Dossier) -> Markup {
    let all: Vec<(&str, ByPlace)> =
        dossier.results.given().iter().map(|g| (g.file.as_str(), counted(g))).filter(|(_, c)| !c.is_empty()).collect();
    let each = || all.iter().flat_map(|(_, by)| by.iter().map(|((place, waived), c)| (*place, *waived, c)));
    let judged = || each().filter(|(_, waived, c)| !*waived && c.unexpected.is_some());
    let by_place = |place| {
        let of = || judged().filter(move |(p, ..)| *p == place);
        (place, of().map(|(_, _, c)| c.n).sum::<u64>(), of().filter_map(|(_, _, c)| c.unexpected).sum::<u64>())
    };
    let places = [Evidence::Model, Evidence::Stack, Evidence::Live].map(by_place);
    let off: u64 = places.iter().map(|(_, _, off)| off).sum();
    let findings: usize = dossier.results.given().iter().map(|g| found(&g.found)).sum();
    let waived = each().any(|(_, waived, _)| waived);
    let invalid: Vec<(&str, &str)> = invalid(dossier).collect();
    html! {
        div class=(if off + (findings + invalid.len()) as u64 > 0 { "verdict bad" } else { "verdict" }) {
            (recordings(&invalid, dossier.recordings.len()))
            p { strong { (sentence(&places)) } @if !invalid.is_empty() { " " (UNSUPPORTED) } }
            @for told in incomplete(dossier) { p { (told) } }
            @if let Some(harm) = stated_harm(dossier) { p { (harm) } }
            @if findings > 0 {
                p { "Searches found " (findings) " smallest " (if findings == 1 { "word" } else { "words" }) " that the platform did not stand; see below." }
            }
        }
        @if waived {
            p class="watermark" { "ABLATION: some rows were run with a check waived. They stand apart, and none of them counts in the verdict." }
        }
        @if !all.is_empty() { (outcomes(&all)) }
    }
}

/// The campaigns that lack trials.
fn incomplete(dossier: &Dossier) -> impl Iterator<Item = String> {
    dossier.results.given().iter().filter_map(|given| {
        let Found::Campaign(campaign) = &given.found else { return None };
        let (n, planned) = (campaign.trials, campaign.planned);
        let of = if campaign.terms.sequential { "trials up to the next look" } else { "trials" };
        (!campaign.complete).then(|| format!("{} is incomplete: {n} of {planned} {of}.", given.file))
    })
}

/// The recordings that are INVALID, and why.
fn invalid(dossier: &Dossier) -> impl Iterator<Item = (&str, &str)> {
    dossier.recordings.iter().filter_map(|of| Some((of.name.as_str(), of.invalid.as_deref()?)))
}

/// Number and names of INVALID recordings among `n`.
fn recordings(invalid: &[(&str, &str)], n: usize) -> Markup {
    let of = invalid.len();
    html! {
        @if of > 0 {
            p { strong class="bad-word" { (of) " of " (n) " recordings " (if of == 1 { "is" } else { "are" }) " INVALID" }
                " and evidence of nothing:" }
            ul {
                @for (name, why) in invalid.iter().take(NAMED) { li { code { (name) } ": " (why) } }
                @if of > NAMED { li { (of - NAMED) " more, listed under “Where it comes from”" } }
            }
        } @else if n > 0 {
            p { "All of the " (n) " recordings verify." }
        }
    }
}

/// Statement on trials and the number outside their expected classes, by place of evidence.
fn sentence(places: &[(Evidence, u64, u64)]) -> String {
    let ran = || places.iter().filter(|(_, n, _)| *n > 0);
    let each = |say: fn(u64, u64) -> String| {
        let one = |(place, n, off): &(Evidence, u64, u64)| format!("{} {}", say(*n, *off), whereabouts(*place));
        ran().map(one).collect::<Vec<_>>().join(", ")
    };
    if ran().count() == 0 {
        "No trials whose classes were stated beforehand are among the results.".to_owned()
    } else if ran().all(|(_, _, off)| *off == 0) {
        format!("Every trial ended in a class that was stated for it beforehand: {}.", each(|n, _| n.to_string()))
    } else {
        format!("Outside the classes that were stated beforehand ended {}.", each(|n, off| format!("{off} of {n}")))
    }
}

fn whereabouts(place: Evidence) -> &'static str {
    match place {
        Evidence::Model => "in the twin",
        Evidence::Stack => "on the real stacks in memory",
        Evidence::Live => "live",
    }
}

/// Harm that was stated beforehand is harm: which threats of a matrix the platform does not hold against.
fn stated_harm(dossier: &Dossier) -> Option<String> {
    let mut harm: BTreeMap<(Outcome, Evidence), (u64, BTreeSet<&str>)> = BTreeMap::new();
    for given in dossier.results.given() {
        let mut seen = BTreeSet::new();
        for one in tried(given).iter().filter(|one| one.watermark.is_none()) {
            let (Some(row), first) = (one.row, seen.insert(one.name())) else { continue };
            for (class, n) in one.outcomes.iter().filter(|(class, _)| **class <= Outcome::Late) {
                let (all, rows) = harm.entry((*class, one.evidence)).or_default();
                *all += if first { *n } else { 0 };
                rows.insert(&row.id);
            }
        }
    }
    let one = |((class, place), (n, rows)): (&(Outcome, Evidence), &(u64, BTreeSet<&str>))| {
        let rows: Vec<&str> = rows.iter().copied().collect();
        format!("{} {n} {} ({})", class.name(), whereabouts(*place), rows.join(", "))
    };
    let all: Vec<String> = harm.iter().map(one).collect();
    (!all.is_empty())
        .then(|| format!("Stated beforehand is not the same as harmless. Of the threats ended so: {}.", all.join("; ")))
}

fn outcomes(all: &[(&str, ByPlace)]) -> Markup {
    let mut rows =
        Table::new(&["result", "evidence", "n", "outcomes", "not expected", "unsafe below (95 %, worst row)"]);
    for (file, by) in all {
        for ((place, waived), c) in by {
            let place = if *waived { format!("{}, ABLATION", place.name()) } else { place.name().to_owned() };
            let off = c.unexpected.map_or_else(|| "not stated".to_owned(), |n| n.to_string());
            let upper = c.unsafe_upper.map_or_else(|| "-".to_owned(), percent);
            rows.rows.push(vec![(*file).to_owned(), place, c.n.to_string(), told(&c.outcomes), off, upper]);
        }
    }
    let mut seen: Vec<Outcome> =
        all.iter().flat_map(|(_, by)| by.values().flat_map(|c| c.outcomes.keys().copied())).collect();
    seen.sort_unstable();
    seen.dedup();
    let keys: Vec<(&str, &str)> = seen.iter().map(|o| (class_of_outcome(o.name()), o.name())).collect();
    html! { (table(&rows, "Outcomes by result and place of evidence")) (key(&keys)) }
}

fn found(found: &Found) -> usize {
    if let Found::Search(search) = found
        && search.watermark.is_none()
    {
        search.findings.len()
    } else {
        0
    }
}

fn counted(given: &Given) -> ByPlace {
    let (mut all, mut seen) = (ByPlace::new(), BTreeSet::new());
    for one in tried(given) {
        // A variation may stand in several rows of a matrix, with the same trials. With a guest, bare or guarded, it has others.
        if !seen.insert((one.name(), one.watermark)) {
            continue;
        }
        let to = all.entry((one.evidence, one.watermark.is_some())).or_default();
        // Of a soak no class was stated.
        let stated = (!one.expected.is_empty()).then(|| one.unexpected().map(|(_, n)| n).sum::<u64>());
        to.unexpected = if to.n == 0 { stated } else { to.unexpected.zip(stated).map(|(before, more)| before + more) };
        to.n += one.n;
        one.outcomes.iter().for_each(|(class, n)| *to.outcomes.entry(*class).or_default() += n);
        to.unsafe_upper = [to.unsafe_upper, one.unsafe_upper_95].into_iter().flatten().reduce(f64::max);
    }
    all
}

/// A rate as a percentage, to three digits.
pub(super) fn percent(rate: f64) -> String {
    let of = rate * 100.0;
    if of >= 10.0 {
        format!("{of:.1} %")
    } else if of >= 1.0 {
        format!("{of:.2} %")
    } else {
        format!("{of:.3} %")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_of_evidence_are_separate_worst_first() {
        let places = |off| [(Evidence::Model, 9, off), (Evidence::Stack, 0, 0), (Evidence::Live, 5, 0)];
        assert!(sentence(&[(Evidence::Model, 0, 0)]).starts_with("No trials"));
        assert_eq!(sentence(&places(0)).matches("9 in the twin, 5 live").count(), 1);
        assert!(sentence(&places(2)).ends_with("2 of 9 in the twin, 0 of 5 live."), "{}", sentence(&places(2)));
    }

    #[test]
    fn trial_in_several_rows_counts_once() {
        let text = include_str!("../../tests/results/matrix.json");
        let read = |text: &str| {
            let mut results = crate::reader::Results::default();
            results.read("m.json", text.as_bytes()).expect("a matrix");
            let all: Vec<(u64, u64)> =
                counted(&results.given()[0]).values().map(|c| (c.n, c.outcomes.values().sum())).collect();
            all
        };
        let mut twice: serde_json::Value = serde_json::from_str(text).expect("JSON");
        let rows = twice["rows"].as_array_mut().expect("rows");
        let again = rows.clone();
        rows.extend(again);
        assert!(!read(text).is_empty());
        assert_eq!(read(text), read(&twice.to_string()));
    }
}
