//! The verdict, first of all: of each result how many trials ended as was expected beforehand, and the worst that was not.

use std::collections::BTreeMap;

use maud::{Markup, html};

use super::{key, table};
use crate::Dossier;
use crate::figure::{Table, class_of_outcome};
use crate::objects::{Evidence, Outcome, Outcomes, Run};
use crate::results::Found;

/// Trials of one place of evidence under a full policy, in one result.
#[derive(Clone, Debug, Default)]
pub(super) struct Counted {
    /// Trials.
    n: u64,
    /// Outside their expected classes; nothing where none were stated.
    unexpected: Option<u64>,
    /// Outcomes.
    outcomes: Outcomes,
    /// The worst of the exact upper 95 % bounds on the unsafe rate.
    unsafe_upper: Option<f64>,
}

/// A result's trials, by place of evidence and whether a check was waived.
type ByPlace = BTreeMap<(Evidence, bool), Counted>;

/// The verdict.
pub(super) fn verdict(dossier: &Dossier) -> Markup {
    let all: Vec<(&str, ByPlace)> = dossier
        .results
        .given()
        .iter()
        .map(|g| (g.file.as_str(), counted(&g.found)))
        .filter(|(_, c)| !c.is_empty())
        .collect();
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
    html! {
        div class=(if off + findings as u64 > 0 { "verdict bad" } else { "verdict" }) {
            p { strong { (sentence(&places)) } }
            @if let Some(harm) = stated_harm(dossier) { p { (harm) } }
            @if findings > 0 {
                p { "Searches found " (findings) " smallest " (if findings == 1 { "word" } else { "words" }) " that the platform did not stand; see below." }
            }
            @if dossier.stories.iter().any(|s| s.flaw.is_some()) {
                p { strong class="bad-word" { "A recording does not verify" } "; it is evidence of nothing." }
            }
        }
        @if waived {
            p class="watermark" { "ABLATION: some rows were run with a check waived. They stand apart, and none of them counts in the verdict." }
        }
        @if !all.is_empty() { (outcomes(&all)) }
    }
}

/// What is said of trials and of how many of them lay outside their expected classes, by place of evidence.
fn sentence(places: &[(Evidence, u64, u64)]) -> String {
    let tried = || places.iter().filter(|(_, n, _)| *n > 0);
    let each = |told: fn(u64, u64) -> String| {
        let one = |(place, n, off): &(Evidence, u64, u64)| format!("{} {}", told(*n, *off), whereabouts(*place));
        tried().map(one).collect::<Vec<_>>().join(", ")
    };
    if tried().count() == 0 {
        "No trials whose classes were stated beforehand are among the results.".to_owned()
    } else if tried().all(|(_, _, off)| *off == 0) {
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
    let matrices =
        dossier.results.given().iter().filter_map(|g| if let Found::Matrix(m) = &g.found { Some(m) } else { None });
    let mut harm: BTreeMap<(Outcome, Evidence), (u64, Vec<&str>)> = BTreeMap::new();
    for row in matrices.flat_map(|m| &m.rows) {
        for kind in row.kinds.iter().filter(|k| !k.ablation) {
            for (class, n) in kind.outcomes.iter().filter(|(class, _)| **class <= Outcome::Late) {
                let (all, rows) = harm.entry((*class, kind.evidence)).or_default();
                *all += n;
                if rows.last() != Some(&row.id.as_str()) {
                    rows.push(&row.id);
                }
            }
        }
    }
    let one = |((class, place), (n, rows)): (&(Outcome, Evidence), &(u64, Vec<&str>))| {
        format!("{} {n} {} ({})", class.name(), whereabouts(*place), rows.join(", "))
    };
    let told: Vec<String> = harm.iter().map(one).collect();
    (!told.is_empty()).then(|| {
        format!("Stated beforehand is not the same as harmless. Of the threats ended so: {}.", told.join("; "))
    })
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

fn counted(found: &Found) -> ByPlace {
    let mut all = ByPlace::new();
    let mut put = |place, waived: bool, n, unexpected: Option<u64>, outcomes: &Outcomes, upper: Option<f64>| {
        let to: &mut Counted = all.entry((place, waived)).or_default();
        to.unexpected = match (to.n, unexpected) {
            (0, stated) => stated,
            (_, stated) => to.unexpected.and_then(|before| Some(before + stated?)),
        };
        to.n += n;
        outcomes.iter().for_each(|(class, n)| *to.outcomes.entry(*class).or_default() += n);
        to.unsafe_upper = [to.unsafe_upper, upper].into_iter().flatten().reduce(f64::max);
    };
    match found {
        Found::Matrix(m) => m.rows.iter().flat_map(|r| &r.kinds).for_each(|k| {
            put(k.evidence, k.ablation, k.n, Some(k.unexpected), &k.outcomes, Some(k.unsafe_upper_95));
        }),
        Found::Reference(r) => r.rows.iter().for_each(|r| {
            put(
                r.evidence,
                false,
                r.summary.n,
                Some(r.unexpected),
                &r.summary.outcomes,
                Some(r.summary.unsafe_upper_95),
            );
        }),
        Found::Campaign(c) => c.rows.iter().for_each(|r| {
            let upper = r.bounds.map(|b| b.unsafe_upper_95);
            put(r.evidence, r.watermark.is_some(), r.n, Some(r.unexpected), &r.outcomes, upper);
        }),
        Found::Runs(runs) => runs.iter().for_each(|r| put_run(&mut put, r)),
        Found::BenchLive(bench) => bench.losses.iter().for_each(|r| put_run(&mut put, r)),
        Found::Search(_) | Found::Curve(_) | Found::Ablation(_) | Found::TwinCost(_) => {}
    }
    all
}

fn put_run(put: &mut impl FnMut(Evidence, bool, u64, Option<u64>, &Outcomes, Option<f64>), r: &Run) {
    let off = |expected: &[Outcome], outcomes: &Outcomes| {
        outcomes.iter().filter(|(class, _)| !expected.contains(class)).map(|(_, n)| n).sum::<u64>()
    };
    // A soak states none.
    let stated = match (r.cells.as_slice(), r.expected.as_slice()) {
        ([], []) => None,
        ([], expected) => Some(off(expected, &r.summary.outcomes)),
        (cells, _) => Some(cells.iter().map(|c| off(&c.expected, &c.summary.outcomes)).sum()),
    };
    let summary = &r.summary;
    put(r.mode, r.watermark.is_some(), summary.n, stated, &summary.outcomes, Some(summary.unsafe_upper_95));
}

/// `HOLD_SAFE 58, DEGRADED 1`, the worst first.
pub(super) fn told(outcomes: &Outcomes) -> String {
    outcomes.iter().map(|(class, n)| format!("{} {n}", class.name())).collect::<Vec<_>>().join(", ")
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
    fn trials_of_several_places_are_told_apart_and_the_worst_is_said_first() {
        let places = |off| [(Evidence::Model, 9, off), (Evidence::Stack, 0, 0), (Evidence::Live, 5, 0)];
        assert!(sentence(&[(Evidence::Model, 0, 0)]).starts_with("No trials"));
        assert_eq!(sentence(&places(0)).matches("9 in the twin, 5 live").count(), 1);
        assert!(sentence(&places(2)).ends_with("2 of 9 in the twin, 0 of 5 live."), "{}", sentence(&places(2)));
    }
}
