//! The finding of results without classed trials of their own: searches, curves, measurements of checks and of
//! cost; and of runs that were given without a result.

use results::report::{Ablation, CurveObject, Holds, InWorlds, SearchObject, TwinCost};
use results::summary::RunSummary;

use super::{Fact, Finding, Part, Rank, comparison};
use crate::page::words;
use crate::reader::{FoundResult, Given};

/// The finding of such a result.
pub(super) fn found(given: &Given) -> Option<Finding> {
    match &given.found {
        FoundResult::Search(search) => Some(of_search(search)),
        FoundResult::Comparison(compared) => comparison::found(compared),
        FoundResult::Curve(curve) => Some(of_curve(curve)),
        FoundResult::Ablation(ablation) => Some(of_ablation(ablation)),
        FoundResult::TwinCost(cost) => Some(of_cost(cost)),
        FoundResult::Worlds(worlds) => Some(of_worlds(worlds)),
        FoundResult::Matrix(_)
        | FoundResult::Runs(_)
        | FoundResult::Reference(_)
        | FoundResult::Campaign(_)
        | FoundResult::BenchLive(_) => None,
    }
}

pub(super) fn finding(rank: Rank, sentence: Vec<Part>, lead: String, facts: Vec<Fact>) -> Finding {
    Finding { rank, sentence, lead, facts, about: Vec::new() }
}

/// Rows that hold in their own scene and not in drawn worlds lead.
fn of_worlds(worlds: &InWorlds) -> Finding {
    let lost = worlds.rows.iter().filter(|row| row.holds == Holds::OwnScene).count() as u64;
    let rows = words::number(worlds.rows.len() as u64, "row");
    let lead = format!("{rows}, each in its own scene and in drawn worlds of {} families.", worlds.families.len());
    let (rank, sentence) = match lost {
        0 => (Rank::Fine, Part::Plain("No row holds in its own scene alone.".to_owned())),
        lost => {
            (Rank::NotStated, Part::Marked(format!("{} of {rows} hold in the own scene alone.", words::count(lost))))
        }
    };
    finding(rank, vec![sentence], lead, Vec::new())
}

fn of_search(search: &SearchObject) -> Finding {
    let hunt = &search.hunt;
    let n = search.findings.len() as u64;
    let sequences = words::number(hunt.trials, "sequence");
    let (rank, sentence) = match search.findings.first() {
        Some(first) => {
            let ways = if n == 1 { "one way".to_owned() } else { format!("{} ways", words::count(n)) };
            let to = if first.outcome.name() == first.broken || first.broken.is_empty() || first.finding.is_none() {
                format!("to end in {}", first.outcome.name())
            } else {
                format!("to break {}", first.broken)
            };
            let parts = [
                Part::Plain("A search finds ".to_owned()),
                Part::Marked(format!("{ways} {to}")),
                Part::Plain(format!(": {}.", first.word)),
            ];
            (Rank::NotStated, parts.to_vec())
        }
        None => (
            Rank::Fine,
            vec![Part::Plain(format!(
                "A search of {sequences} finds nothing; that is no proof that there is nothing."
            ))],
        ),
    };
    let outcomes = crate::tried::class_counts(&hunt.outcomes);
    let lead = format!(
        "{sequences} of attack space {} on {}, under policy {}: {outcomes}.",
        search.alphabet, search.scenario, search.policy
    );
    let mut facts = vec![
        Fact::new(words::grouped(hunt.trials), "sequences tried"),
        Fact::new(
            n.to_string(),
            if n == 1 { "finding, shrunk to its least" } else { "findings, each shrunk to its least" },
        ),
    ];
    let nearest = hunt.nearest.iter().max_by_key(|row| row.thousandths);
    facts.extend(nearest.map(|row| {
        Fact::new(
            format!("{:.1} %", f64::from(row.thousandths) / 10.0),
            format!("of the way to a limit, the nearest: {}", row.limit.name()),
        )
    }));
    facts.push(Fact::new(format!("{} CPU s", words::three_digits(hunt.cpu_seconds)), "for all of them"));
    finding(rank, sentence, lead, facts)
}

fn of_curve(curve: &CurveObject) -> Finding {
    let value = |value: f64| format!("{value} {}", curve.unit);
    let reading = curve.lines.iter().map(|line| &line.reading);
    let harmful = reading.clone().filter_map(|reading| reading.smallest_harmful).reduce(f64::min);
    let noticed = reading.filter_map(|reading| reading.smallest_detected_before_harm).reduce(f64::min);
    let (rank, sentence) = match (noticed, harmful) {
        (_, None) => (Rank::Fine, vec![Part::Plain(format!("{}: no strength that was tried does harm.", curve.title))]),
        (noticed, Some(harm)) => {
            let seen = noticed.map_or("it is never noticed before harm".to_owned(), |v| {
                format!("it is noticed before harm from {} on", value(v))
            });
            let parts = [
                Part::Plain(format!("{}: {seen}, and it ", curve.title)),
                Part::Marked(format!("does harm from {} on", value(harm))),
                Part::Plain(".".to_owned()),
            ];
            (Rank::Harm, parts.to_vec())
        }
    };
    let n = curve.lines.iter().flat_map(|line| &line.points).map(|point| point.detected.n).max().unwrap_or_default();
    let points: usize = curve.lines.iter().map(|line| line.points.len()).sum();
    let lead = format!(
        "{} in {}, {n} trials each.",
        words::number(points as u64, "point"),
        words::number(curve.lines.len() as u64, "line")
    );
    let mut facts = vec![Fact::new(points.to_string(), format!("points, n {n} each"))];
    facts.extend(noticed.map(|v| Fact::new(value(v), "smallest that is noticed before harm")));
    facts.extend(harmful.map(|v| Fact::new(value(v), "smallest that does harm")));
    finding(rank, sentence, lead, facts)
}

fn of_ablation(ablation: &Ablation) -> Finding {
    let (found, n) = (ablation.defects.found, ablation.defects.n);
    let sentence = format!("{found} of {n} checks are missed as soon as each is waived alone.");
    let lead = format!(
        "{} with up to {} pairs each, with a check and without it, under the same seeds.",
        words::number(ablation.attacks as u64, "attack"),
        ablation.trials
    );
    let facts = vec![
        Fact::new(format!("{found} of {n}"), "checks whose absence lets an attack through"),
        Fact::new(ablation.attacks.to_string(), "attacks"),
    ];
    finding(Rank::Fine, vec![Part::Plain(sentence)], lead, facts)
}

fn of_cost(cost: &TwinCost) -> Finding {
    let second = &cost.per_cpu_second;
    let sentence = format!("A CPU second simulates {:.0} seconds of {}.", second.median, cost.scenario);
    let lead = format!(
        "Median of {} rounds of {} trials; between {:.0} and {:.0}. CPU over that of bare rapier on the same course: {:.2}.",
        cost.rounds, cost.trials, second.min, second.max, cost.ratio.median
    );
    finding(
        Rank::Fine,
        vec![Part::Plain(sentence)],
        lead,
        vec![Fact::new(format!("{:.0}", second.median), "simulated seconds a CPU second")],
    )
}

/// The finding of runs by themselves, of which no class is known: the first restriction of each.
pub(super) fn of_runs(stories: &[RunSummary]) -> Option<Finding> {
    let first = stories.first()?;
    let restricted: Vec<(&RunSummary, &results::summary::Why)> =
        stories.iter().filter_map(|story| Some((story, story.why.first()?))).collect();
    let n = stories.len() as u64;
    let sentence = match restricted.first() {
        Some((_, why)) if n == 1 => format!("{} at {:.2} s: {}.", mode_words(&why.change), why.at, why.cause),
        None if n == 1 => "The unit is never restricted in this run.".to_owned(),
        _ => format!("{} of {} restrict the unit.", restricted.len(), words::number(n, "run")),
    };
    let lead = format!(
        "{}, {:.1} s. No class was stated of it beforehand: a recording alone has none.",
        words::number(n, "run"),
        first.seconds
    );
    let facts = first.distances.iter().take(4);
    let facts = facts.map(|of| {
        let bound = if of.least { "least" } else { "limit" };
        Fact::new(
            format!("{} {}", words::three_digits(of.value), of.unit),
            format!("{}; {bound} {} {}", of.what, words::three_digits(of.limit), of.unit),
        )
    });
    Some(finding(Rank::Fine, vec![Part::Plain(sentence)], lead, facts.collect()))
}

/// `PREPARE_TO_ACT to HOLD_SAFE` as a sentence's beginning.
fn mode_words(change: &str) -> String {
    format!("The unit goes from {change}")
}
