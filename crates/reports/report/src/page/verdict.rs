//! The verdict, first of all: of each result how many trials ended as was expected beforehand, and the worst that was not.

use std::collections::{BTreeMap, BTreeSet};

use evidence::trial::{Outcome, Outcomes};
use maud::{Markup, html};
use scenario::Evidence;

use super::{key, table};
use crate::Dossier;
use crate::figure::{Table, class_of_outcome};
use crate::reader::{FoundResult, Given};
use crate::tried::{class_counts, tried};

/// Trials of one place of evidence under a full policy, in one result.
#[derive(Clone, Debug, Default)]
pub(super) struct Counted {
    /// Trials.
    n: u64,
    /// Cells, and scenarios without cells.
    cells: u64,
    /// Outside their expected classes; `None` where none were stated.
    unexpected: Option<u64>,
    /// Cells with such trials, with the classes.
    off: Vec<String>,
    /// Outcomes.
    outcomes: Outcomes,
    /// The worst of the exact upper 95 % bounds on the unsafe rate.
    unsafe_upper: Option<f64>,
}

/// A result's trials, by place of evidence and whether a check was waived.
type ByPlace = BTreeMap<(Evidence, bool), Counted>;

/// Recordings and cells of one kind that are named in the verdict.
const NAMED: usize = 8;

/// Verdict over results without stated classes.
const NONE_STATED: &str = "No trials whose classes were stated beforehand are among the results.";

/// Note beside the results when one of their recordings is INVALID.
const UNSUPPORTED: &str = "That is what the results say; no INVALID recording supports it.";

/// The verdict.
pub(super) fn verdict(dossier: &Dossier) -> Markup {
    let all: Vec<(&str, ByPlace)> =
        dossier.results.files().iter().map(|g| (g.file.as_str(), counted(g))).filter(|(_, c)| !c.is_empty()).collect();
    let each = || all.iter().flat_map(|(_, map)| map.iter().map(|((place, waived), c)| (*place, *waived, c)));
    let stated = |ablation: bool| each().filter(move |(_, waived, c)| *waived == ablation && c.unexpected.is_some());
    let sentence_for = |ablation: bool| sentence(ablation, stated(ablation).map(|(place, _, c)| (place, c)));
    let (full, ablated) = (sentence_for(false), sentence_for(true));
    let off: u64 = each().filter_map(|(_, _, c)| c.unexpected).sum();
    let findings: usize = dossier.results.files().iter().map(|g| found(&g.found)).sum();
    let waived = each().any(|(_, waived, _)| waived);
    let invalid: Vec<(&str, &str)> = invalid(dossier).collect();
    html! {
        div class=(if off + (findings + invalid.len()) as u64 > 0 { "verdict bad" } else { "verdict" }) {
            @if !invalid.is_empty() { (recordings(&invalid, dossier.recordings.len())) }
            @if full.is_some() || ablated.is_none() {
                p { strong { (full.as_deref().unwrap_or(NONE_STATED)) } @if !invalid.is_empty() { " " (UNSUPPORTED) } }
            }
            @if let Some(text) = &ablated { p { strong { (text) } } }
            @if let Some(text) = unnoticed(dossier) { p { (text) } }
            @for text in incomplete(dossier) { p { (text) } }
            @if let Some(harm) = stated_harm(dossier) { p { (harm) } }
            @if findings > 0 {
                p { "Searches found " (findings) " minimal attack " (if findings == 1 { "sequence" } else { "sequences" }) " that break a property; see below." }
            }
            @if invalid.is_empty() { (recordings(&invalid, dossier.recordings.len())) }
        }
        @if waived {
            p class="watermark" { "ABLATION: some rows were run with a check waived. They stand apart, and no claim about the platform rests on them." }
        }
        @if !all.is_empty() { (outcomes(&all)) }
    }
}

/// The campaigns that lack trials.
fn incomplete(dossier: &Dossier) -> impl Iterator<Item = String> {
    dossier.results.files().iter().filter_map(|file| {
        let FoundResult::Campaign(campaign) = &file.found else { return None };
        let (n, planned) = (campaign.trials, campaign.planned);
        let name = if campaign.terms.sequential { "trials up to the next look" } else { "trials" };
        (!campaign.complete).then(|| format!("{} is incomplete: {n} of {planned} {name}.", file.file))
    })
}

/// The recordings that are INVALID, and why.
fn invalid(dossier: &Dossier) -> impl Iterator<Item = (&str, &str)> {
    dossier.recordings.iter().filter_map(|recording| Some((recording.name.as_str(), recording.invalid.as_deref()?)))
}

/// Number and names of INVALID recordings among `n`.
fn recordings(invalid: &[(&str, &str)], n: usize) -> Markup {
    let count = invalid.len();
    html! {
        @if count > 0 {
            p { strong class="bad-word" { (count) " of " (n) " recordings " (if count == 1 { "is" } else { "are" }) " INVALID" }
                " and evidence of nothing:" }
            ul {
                @for (name, why) in invalid.iter().take(NAMED) { li { code { (name) } ": " (why) } }
                @if count > NAMED { li { (count - NAMED) " more, listed under “Where it comes from”" } }
            }
        } @else if n > 0 {
            p { "All of the " (n) " recordings verify." }
        }
    }
}

/// Sentence on the number of trials and of those outside their stated classes, by place of evidence; none without
/// trials.
fn sentence<'c>(ablation: bool, counted: impl Iterator<Item = (Evidence, &'c Counted)>) -> Option<String> {
    let mut places: BTreeMap<Evidence, Counted> = BTreeMap::new();
    for (place, c) in counted {
        let to = places.entry(place).or_default();
        (to.n, to.cells) = (to.n + c.n, to.cells + c.cells);
        to.unexpected = Some(to.unexpected.unwrap_or_default() + c.unexpected.unwrap_or_default());
        to.off.extend(c.off.iter().cloned());
    }
    let mark = if ablation { " (ABLATION)" } else { "" };
    let each: Vec<String> =
        places.iter().map(|(place, c)| of_place(&format!("{}{mark}", whereabouts(*place)), c)).collect();
    (!each.is_empty()).then(|| format!("{}.", each.join("; ")))
}

fn of_place(place: &str, c: &Counted) -> String {
    let cells = if c.cells == 1 { "1 cell".to_owned() } else { format!("{} cells", c.cells) };
    let ran = format!("{cells}, {} trials {place}", c.n);
    let off = c.unexpected.unwrap_or_default();
    if off == 0 {
        return format!("{ran}: all in their stated class");
    }
    format!("{ran}: {off} outside their stated class, in {}", named(&c.off))
}

/// The first few of these, and how many more.
fn named(all: &[String]) -> String {
    let first = all.iter().take(NAMED).cloned().collect::<Vec<_>>().join(", ");
    if all.len() > NAMED { format!("{first} and {} more", all.len() - NAMED) } else { first }
}

/// Attacks on runs that nothing answered, as a reader of the stated classes alone would not see.
fn unnoticed(dossier: &Dossier) -> Option<String> {
    let runs = dossier.results.files().iter().filter(|file| matches!(file.found, FoundResult::Runs(_)));
    let each = runs.flat_map(tried).filter_map(|one| {
        let n = one.outcomes.get(&Outcome::Undetected)?;
        Some(format!("{} ({n} of {})", one.name(), one.n))
    });
    let all: Vec<String> = each.collect();
    (!all.is_empty()).then(|| format!("Accepted and not noticed (UNDETECTED): {}.", named(&all)))
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
    for given in dossier.results.files() {
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
            rows.rows.push(vec![(*file).to_owned(), place, c.n.to_string(), class_counts(&c.outcomes), off, upper]);
        }
    }
    let mut seen: Vec<Outcome> =
        all.iter().flat_map(|(_, map)| map.values().flat_map(|c| c.outcomes.keys().copied())).collect();
    seen.sort_unstable();
    seen.dedup();
    let keys: Vec<(&str, &str)> = seen.iter().map(|o| (class_of_outcome(o.name()), o.name())).collect();
    html! { (table(&rows, "Outcomes by result and place of evidence")) (key(&keys)) }
}

fn found(found: &FoundResult) -> usize {
    if let FoundResult::Search(search) = found
        && search.watermark.is_none()
    {
        search.findings.len()
    } else {
        0
    }
}

fn counted(file: &Given) -> ByPlace {
    let (mut all, mut seen) = (ByPlace::new(), BTreeSet::new());
    for one in tried(file) {
        // A variation may be in several rows of a matrix, with the same trials. With a guest, bare or guarded, it has others.
        if !seen.insert((one.name(), one.watermark)) {
            continue;
        }
        let to = all.entry((one.evidence, one.watermark.is_some())).or_default();
        // No class was stated of a soak.
        let stated = (!one.expected.is_empty()).then(|| one.unexpected().map(|(_, n)| n).sum::<u64>());
        to.unexpected = if to.n == 0 { stated } else { to.unexpected.zip(stated).map(|(before, more)| before + more) };
        to.off.extend(stated.filter(|off| *off > 0).map(|_| {
            let classes: Vec<String> = one.unexpected().map(|(class, n)| format!("{} {n}", class.name())).collect();
            format!("{} ({} of {})", one.name(), classes.join(", "), one.n)
        }));
        (to.n, to.cells) = (to.n + one.n, to.cells + 1);
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
        let counted = |off: &[&str]| Counted {
            n: 9,
            cells: 3,
            unexpected: Some(off.len() as u64),
            off: off.iter().map(|&cell| cell.to_owned()).collect(),
            ..Counted::default()
        };
        let sentence_for = |of: &Counted| sentence(false, [(Evidence::Live, of), (Evidence::Model, of)].into_iter());
        assert_eq!(sentence(false, std::iter::empty()), None);
        let fine = sentence_for(&counted(&[])).expect("trials");
        assert_eq!(
            fine,
            "3 cells, 9 trials in the twin: all in their stated class; 3 cells, 9 trials live: all in their stated class."
        );
        let off = sentence_for(&counted(&["a (LATE 1 of 3)"])).expect("trials");
        assert!(off.ends_with("9 trials live: 1 outside their stated class, in a (LATE 1 of 3)."), "{off}");
    }

    #[test]
    fn run_with_waived_checks_has_a_finding() {
        let mut results = crate::reader::Results::default();
        results.read("run.json", crate::reader::golden("run").to_string().as_bytes()).expect("a run");
        let page = verdict(&Dossier { results, ..Dossier::default() }).into_string();
        let off = "1 cell, 2 trials live (ABLATION): 1 outside their stated class, in loss by_session, live (INVALID 1 of 2).";
        assert!(page.contains(off) && page.contains("verdict bad"), "{page}");
        assert!(!page.contains(NONE_STATED), "{page}");
    }

    #[test]
    fn trial_in_several_rows_counts_once() {
        let text = include_str!("../../tests/results/matrix.json");
        let read = |text: &str| {
            let mut results = crate::reader::Results::default();
            results.read("m.json", text.as_bytes()).expect("a matrix");
            let all: Vec<(u64, u64)> =
                counted(&results.files()[0]).values().map(|c| (c.n, c.outcomes.values().sum())).collect();
            all
        };
        let mut doubled: serde_json::Value = serde_json::from_str(text).expect("JSON");
        let rows = doubled["rows"].as_array_mut().expect("rows");
        let repeated = rows.clone();
        rows.extend(repeated);
        assert!(!read(text).is_empty());
        assert_eq!(read(text), read(&doubled.to_string()));
    }
}
