//! The finding of a comparison of guests: harm and attacks unnoticed, bare beside inside the guards.

use evidence::trial::Outcome;
use results::report::{Comparison, ComparisonTotal};

use super::others::finding;
use super::{Fact, Finding, Part, Rank};
use crate::page::words;

/// All attacks of one guest in one conduct, and how many of them it left unnoticed.
#[derive(Clone, Copy)]
struct Conduct<'a> {
    total: &'a ComparisonTotal,
    unnoticed: u64,
}

/// The finding: of the guest that is harmed most inside the guards; `None` without a guest.
pub(super) fn found(comparison: &Comparison) -> Option<Finding> {
    let of = |conduct: &'static str| comparison.totals.iter().filter(move |total| total.conduct == conduct);
    let worst = of("guarded").max_by_key(|total| total.harmful).or(comparison.totals.first())?;
    let conduct = |name| of(name).find(|total| total.guest == worst.guest).map(|total| conduct(comparison, total));
    let (rank, sentence) = match (conduct("bare"), conduct("guarded")) {
        (Some(bare), Some(guarded)) => both(bare, guarded),
        (Some(only), None) | (None, Some(only)) => one(only),
        (None, None) => return None,
    };
    let trials = words::number(comparison.trials, "trial");
    let each: Vec<String> = comparison.totals.iter().map(told).collect();
    let lead = format!("{trials} of each attack. Harmful (UNSAFE or LATE): {}.", each.join("; "));
    Some(finding(rank, sentence, lead, facts(conduct("bare"), conduct("guarded"))))
}

fn conduct<'a>(comparison: &Comparison, total: &'a ComparisonTotal) -> Conduct<'a> {
    let own =
        comparison.rows.iter().filter(|row| row.guest == total.guest && row.conduct == total.conduct && !row.quiet);
    Conduct { total, unnoticed: own.filter(|row| row.outcomes.contains_key(&Outcome::Undetected)).count() as u64 }
}

fn told(total: &ComparisonTotal) -> String {
    format!("{} {} {} of {}", total.guest, total.conduct, total.harmful, words::number(total.n, "trial"))
}

fn attacks(n: u64, total: &ComparisonTotal) -> String {
    format!("{n} of {}", words::number(total.variations, "attack"))
}

fn one(Conduct { total, .. }: Conduct) -> (Rank, Vec<Part>) {
    let rank = if total.harmful > 0 { Rank::Harm } else { Rank::Fine };
    (
        rank,
        vec![Part::Plain(format!(
            "{} {} is harmed by {}.",
            words::capital(&total.guest),
            total.conduct,
            attacks(total.harmed, total)
        ))],
    )
}

/// Difference that the guards make to a guest.
fn both(bare: Conduct, guarded: Conduct) -> (Rank, Vec<Part>) {
    let guest = &bare.total.guest;
    let marked = |before: String, marked: String, after: String| {
        vec![Part::Plain(before), Part::Marked(marked), Part::Plain(after)]
    };
    match (bare.total.harmful, guarded.total.harmful) {
        (0, 0) if guarded.unnoticed == 0 => {
            (Rank::Fine, vec![Part::Plain(format!("No attack harms {guest}, bare or inside the guards."))])
        }
        (0, 0) => {
            let unnoticed = format!("{} unnoticed", attacks(guarded.unnoticed, guarded.total));
            (
                Rank::Unnoticed,
                marked(
                    format!("Inside the guards {guest} leaves "),
                    unnoticed,
                    format!(", bare {}; none does harm.", bare.unnoticed),
                ),
            )
        }
        (_, 0) => {
            let text = format!(
                "Inside the guards nothing harms {guest}; bare it is harmed by {}.",
                attacks(bare.total.harmed, bare.total)
            );
            (Rank::Fine, vec![Part::Plain(text)])
        }
        (before, after) => {
            let than = if after < before { ", less often than bare." } else { ", no less often than bare." };
            let still = format!("is still harmed by {}", attacks(guarded.total.harmed, guarded.total));
            (Rank::Harm, marked(format!("Inside the guards {guest} "), still, than.to_owned()))
        }
    }
}

fn facts(bare: Option<Conduct>, guarded: Option<Conduct>) -> Vec<Fact> {
    let harmful = |of: Option<Conduct>, name: &str| {
        of.map(|of| {
            Fact::new(
                format!("{} of {}", of.total.harmful, of.total.n),
                format!("harmful {name}, in {}", attacks(of.total.harmed, of.total)),
            )
        })
    };
    let mut all: Vec<Fact> = harmful(bare, "bare").into_iter().chain(harmful(guarded, "inside the guards")).collect();
    let Some(of) = guarded.or(bare) else { return all };
    let name = if guarded.is_some() { "inside the guards" } else { "bare" };
    let besides = bare.filter(|_| guarded.is_some());
    let than = besides.map(|bare| format!(", {} bare", bare.unnoticed)).unwrap_or_default();
    all.push(Fact::new(
        format!("{} of {}", of.unnoticed, of.total.variations),
        format!("attacks unnoticed {name}{than}"),
    ));
    let percent = |of: Conduct| of.total.completed.map(|share| format!("{:.0} %", share * 100.0));
    let than = besides.and_then(percent).map(|bare| format!(", {bare} bare")).unwrap_or_default();
    all.extend(
        percent(of).map(|share| Fact::new(share, format!("of the way points passed without an attack {name}{than}"))),
    );
    all
}
