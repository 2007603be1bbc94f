//! The finding of results without classed trials of their own: searches, comparisons of guests, curves, measurements of checks and of
//! cost; and of runs that were given without a result.

use evidence::trial::Outcome;
use results::report::{Ablation, Comparison, ComparisonTotal, CurveObject, SearchObject, TwinCost};
use results::summary::RunSummary;

use super::{Fact, Finding, Part, Rank};
use crate::page::words;
use crate::reader::{FoundResult, Given};

/// The finding of such a result.
pub(super) fn found(given: &Given) -> Option<Finding> {
    match &given.found {
        FoundResult::Search(search) => Some(of_search(search)),
        FoundResult::Comparison(comparison) => of_comparison(comparison),
        FoundResult::Curve(curve) => Some(of_curve(curve)),
        FoundResult::Ablation(ablation) => Some(of_ablation(ablation)),
        FoundResult::TwinCost(cost) => Some(of_cost(cost)),
        FoundResult::Matrix(_)
        | FoundResult::Runs(_)
        | FoundResult::Reference(_)
        | FoundResult::Campaign(_)
        | FoundResult::BenchLive(_) => None,
    }
}

fn finding(rank: Rank, sentence: Vec<Part>, lead: String, facts: Vec<Fact>) -> Finding {
    Finding { rank, sentence, lead, facts, about: Vec::new() }
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
        None => (Rank::Fine, vec![Part::Plain(format!("A search of {sequences} finds nothing; that is no proof that there is nothing."))]),
    };
    let outcomes = crate::tried::class_counts(&hunt.outcomes);
    let lead = format!("{sequences} of attack space {} on {}, under policy {}: {outcomes}.", search.alphabet, search.scenario, search.policy);
    let mut facts = vec![
        Fact::new(words::grouped(hunt.trials), "sequences tried"),
        Fact::new(n.to_string(), if n == 1 { "finding, shrunk to its least" } else { "findings, each shrunk to its least" }),
    ];
    let nearest = hunt.nearest.iter().max_by_key(|row| row.thousandths);
    facts.extend(nearest.map(|row| {
        Fact::new(format!("{:.1} %", f64::from(row.thousandths) / 10.0), format!("of the way to a limit, the nearest: {}", row.limit.name()))
    }));
    facts.push(Fact::new(format!("{} CPU s", words::three_digits(hunt.cpu_seconds)), "for all of them"));
    finding(rank, sentence, lead, facts)
}

fn of_comparison(comparison: &Comparison) -> Option<Finding> {
    let total = |conduct: &'static str| move |of: &&ComparisonTotal| of.conduct == conduct;
    let pairs: Vec<(&ComparisonTotal, &ComparisonTotal)> = comparison
        .totals
        .iter()
        .filter(total("bare"))
        .filter_map(|bare| Some((bare, comparison.totals.iter().filter(total("guarded")).find(|of| of.guest == bare.guest)?)))
        .collect();
    // The guest that is harmed most inside the guards leads.
    let (bare, guarded) = pairs.iter().max_by_key(|(bare, guarded)| (guarded.harmful, bare.harmful))?;
    let unnoticed = |of: &ComparisonTotal| {
        let own = comparison.rows.iter().filter(|row| row.guest == of.guest && row.conduct == of.conduct && !row.quiet);
        own.filter(|row| row.outcomes.contains_key(&Outcome::Undetected)).count() as u64
    };
    let quiet = [unnoticed(bare), unnoticed(guarded)];
    let rank = match (guarded.harmful, quiet[1]) {
        (0, 0) => Rank::Fine,
        (0, _) => Rank::Unnoticed,
        _ => Rank::Harm,
    };
    let others: Vec<String> = pairs
        .iter()
        .filter(|(of, _)| of.guest != bare.guest)
        .map(|(bare, guarded)| format!("{}: {} of {} bare, {} of {} guarded.", bare.guest, bare.harmful, bare.n, guarded.harmful, guarded.n))
        .collect();
    let lead = format!(
        "Under {} with {} each: bare {} of {} trials harmful, inside the guards {} of {}. {}",
        words::number(bare.variations, "attack"),
        words::number(comparison.trials, "trial"),
        bare.harmful,
        bare.n,
        guarded.harmful,
        guarded.n,
        others.join(" ")
    );
    let share = |of: &ComparisonTotal| of.completed.map(|share| format!("{:.0} %", share * 100.0));
    let mut facts = vec![
        Fact::new(format!("{} of {}", bare.harmful, bare.n), format!("harmful bare, in {} of {} attacks", bare.harmed, bare.variations)),
        Fact::new(
            format!("{} of {}", guarded.harmful, guarded.n),
            format!("harmful inside the guards, in {} of {} attacks", guarded.harmed, guarded.variations),
        ),
    ];
    facts.extend(share(guarded).zip(share(bare)).map(|(guarded, bare)| {
        Fact::new(guarded, format!("of the way points passed without an attack inside the guards, {bare} bare"))
    }));
    let trips: u64 = comparison.rows.iter().filter(|row| row.quiet && row.conduct == "guarded").map(|row| row.false_trips).sum();
    facts.push(Fact::new(trips.to_string(), "false stops without an attack inside the guards"));
    facts.insert(2, Fact::new(format!("{} of {}", quiet[1], guarded.variations), format!("attacks unnoticed inside the guards, {} bare", quiet[0])));
    facts.truncate(4);
    Some(finding(rank, compared(bare, guarded, quiet), lead.trim_end().to_owned(), facts))
}

/// What the guards make of a guest.
fn compared(bare: &ComparisonTotal, guarded: &ComparisonTotal, unnoticed: [u64; 2]) -> Vec<Part> {
    let guest = &bare.guest;
    let plain = |text: String| vec![Part::Plain(text)];
    match (bare.harmful, guarded.harmful) {
        (0, 0) if unnoticed == [0, 0] => plain(format!("No attack harms {guest}, bare or inside the guards.")),
        (0, 0) => vec![
            Part::Plain(format!("Inside the guards {guest} leaves ")),
            Part::Marked(format!("{} of {} unnoticed", unnoticed[1], words::number(guarded.variations, "attack"))),
            Part::Plain(format!(", bare {}; none does harm.", unnoticed[0])),
        ],
        (_, 0) => plain(format!("Inside the guards nothing harms {guest}; bare it is harmed by {} of {}.", bare.harmed, words::number(bare.variations, "attack"))),
        (before, after) => {
            let than = if after < before { "less often than bare" } else { "no less often than bare" };
            vec![
                Part::Plain(format!("Inside the guards {guest} ")),
                Part::Marked(format!("is still harmed by {} of {}", guarded.harmed, words::number(guarded.variations, "attack"))),
                Part::Plain(format!(", {than}.")),
            ]
        }
    }
}

fn of_curve(curve: &CurveObject) -> Finding {
    let value = |value: f64| format!("{value} {}", curve.unit);
    let reading = curve.lines.iter().map(|line| &line.reading);
    let harmful = reading.clone().filter_map(|reading| reading.smallest_harmful).reduce(f64::min);
    let noticed = reading.filter_map(|reading| reading.smallest_detected_before_harm).reduce(f64::min);
    let (rank, sentence) = match (noticed, harmful) {
        (_, None) => (Rank::Fine, vec![Part::Plain(format!("{}: no strength that was tried does harm.", curve.title))]),
        (noticed, Some(harm)) => {
            let seen = noticed.map_or("it is never noticed before harm".to_owned(), |v| format!("it is noticed before harm from {} on", value(v)));
            let parts = [Part::Plain(format!("{}: {seen}, and it ", curve.title)), Part::Marked(format!("does harm from {} on", value(harm))), Part::Plain(".".to_owned())];
            (Rank::Harm, parts.to_vec())
        }
    };
    let n = curve.lines.iter().flat_map(|line| &line.points).map(|point| point.detected.n).max().unwrap_or_default();
    let points: usize = curve.lines.iter().map(|line| line.points.len()).sum();
    let lead = format!("{points} points in {}, {n} trials each.", words::number(curve.lines.len() as u64, "line"));
    let mut facts = vec![Fact::new(points.to_string(), format!("points, n {n} each"))];
    facts.extend(noticed.map(|v| Fact::new(value(v), "smallest that is noticed before harm")));
    facts.extend(harmful.map(|v| Fact::new(value(v), "smallest that does harm")));
    finding(rank, sentence, lead, facts)
}

fn of_ablation(ablation: &Ablation) -> Finding {
    let (found, n) = (ablation.defects.found, ablation.defects.n);
    let sentence = format!("{found} of {n} checks are missed as soon as each is waived alone.");
    let lead = format!(
        "{} attacks with up to {} pairs each, with a check and without it, under the same seeds.",
        ablation.attacks, ablation.trials
    );
    let facts = vec![Fact::new(format!("{found} of {n}"), "checks whose absence lets an attack through"), Fact::new(ablation.attacks.to_string(), "attacks")];
    finding(Rank::Fine, vec![Part::Plain(sentence)], lead, facts)
}

fn of_cost(cost: &TwinCost) -> Finding {
    let second = &cost.per_cpu_second;
    let sentence = format!("A CPU second simulates {:.0} seconds of {}.", second.median, cost.scenario);
    let lead = format!(
        "Median of {} rounds of {} trials; between {:.0} and {:.0}. CPU over that of bare rapier on the same course: {:.2}.",
        cost.rounds, cost.trials, second.min, second.max, cost.ratio.median
    );
    finding(Rank::Fine, vec![Part::Plain(sentence)], lead, vec![Fact::new(format!("{:.0}", second.median), "simulated seconds a CPU second")])
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
    let lead = format!("{}, {:.1} s. No class was stated of it beforehand: a recording alone has none.", words::number(n, "run"), first.seconds);
    let facts = first.distances.iter().take(4);
    let facts = facts.map(|of| {
        let bound = if of.least { "least" } else { "limit" };
        Fact::new(format!("{} {}", words::three_digits(of.value), of.unit), format!("{}; {bound} {} {}", of.what, words::three_digits(of.limit), of.unit))
    });
    Some(finding(Rank::Fine, vec![Part::Plain(sentence)], lead, facts.collect()))
}

/// `PREPARE_TO_ACT to HOLD_SAFE` as a sentence's beginning.
fn mode_words(change: &str) -> String {
    format!("The unit goes from {change}")
}
