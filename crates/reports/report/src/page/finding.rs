//! The finding, first of all: one sentence on the results, one of numbers, and four numbers with n and bound.
//!
//! `trials` finds it among trials with classes, `comparison` among guests, `others` in searches and measurements. No trial is judged again: the worst
//! class that results have leads. Of several results the worst finding stands first, the others follow as sentences.

mod comparison;
mod others;
mod trials;

use maud::{Markup, html};

use super::words;
use crate::{Dossier, Recording};

/// Recordings that are named before the finding.
const NAMED: usize = 8;

/// How much a finding asks for a reader, the most first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Rank {
    /// Something that was not stated beforehand.
    NotStated,
    /// Harm that was stated beforehand.
    Harm,
    /// Accepted and not noticed.
    Unnoticed,
    /// Missing trials, or a claim that is open.
    Open,
    /// None of these.
    Fine,
}

/// A part of a sentence.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// Words.
    Plain(String),
    /// Words in the one colour of the page.
    Marked(String),
}

/// A number with its meaning.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Fact {
    /// The number, with its unit.
    pub value: String,
    /// Its meaning, its n and its bound.
    pub said: String,
}

impl Fact {
    fn new(value: impl Into<String>, said: impl Into<String>) -> Self {
        Self { value: value.into(), said: said.into() }
    }
}

/// The statement of a result.
#[derive(Clone, Debug)]
pub(super) struct Finding {
    /// Its weight.
    pub rank: Rank,
    /// The sentence.
    pub sentence: Vec<Part>,
    /// Sentences of numbers.
    pub lead: String,
    /// Four numbers at most.
    pub facts: Vec<Fact>,
    /// Variations that it is about, by their names.
    pub about: Vec<String>,
}

impl Finding {
    /// The sentence as words.
    pub(super) fn text(&self) -> String {
        let word = |part: &Part| match part {
            Part::Plain(words) | Part::Marked(words) => words.clone(),
        };
        self.sentence.iter().map(word).collect()
    }
}

/// Every finding, the one that asks most for a reader first.
pub(super) fn findings(dossier: &Dossier) -> Vec<Finding> {
    let each = dossier.results.files().iter();
    let mut all: Vec<Finding> =
        each.filter_map(|given| trials::found(dossier, given).or_else(|| others::found(given))).collect();
    if all.is_empty() {
        all.extend(others::of_runs(&dossier.stories));
    }
    all.sort_by_key(|finding| finding.rank);
    all
}

/// The first screen.
pub(super) fn markup(dossier: &Dossier, findings: &[Finding]) -> Markup {
    let invalid: Vec<&Recording> = dossier.recordings.iter().filter(|of| of.invalid.is_some()).collect();
    html! {
        @if !invalid.is_empty() { (broken(&invalid, dossier.recordings.len())) }
        @if let Some(first) = findings.first() {
            @if invalid.is_empty() { h1 { (sentence(first)) } } @else { p class="lead" { b { "The results say: " } (sentence(first)) } }
            p class="lead" { (first.lead) }
            @for other in findings.iter().skip(1) { p class="lead" { b { (other.text()) } " " (other.lead) } }
            div class="facts" { @for fact in &first.facts { div { b { (fact.value) } span { (fact.said) } } } }
        } @else if invalid.is_empty() {
            h1 { "There is nothing to report on." }
            p class="lead" { "Neither results nor recorded runs were given." }
        }
    }
}

fn sentence(of: &Finding) -> Markup {
    html! { @for part in &of.sentence { @match part {
        Part::Plain(words) => (words),
        Part::Marked(words) => em { (words) },
    } } }
}

/// INVALID first of all: a recording that does not verify is no evidence.
fn broken(invalid: &[&Recording], n: usize) -> Markup {
    let count = invalid.len();
    let subject = if count == n && n == 1 {
        "This recording is INVALID".to_owned()
    } else {
        format!("{count} of {n} recordings {} INVALID", if count == 1 { "is" } else { "are" })
    };
    html! {
        h1 { em { (subject) } ": no evidence of anything." }
        div class="note bad" role="note" {
            b { "What follows is no better than that." } " No INVALID recording supports a result."
            ul {
                @for of in invalid.iter().take(NAMED) { li { code { (of.name) } ": " (of.invalid.as_deref().unwrap_or_default()) } }
                @if count > NAMED { li { (count - NAMED) " more, listed under “Evidence”" } }
            }
        }
    }
}

/// `Two lies` or `One lie`.
fn subject(n: u64, noun: &str) -> String {
    let plural = if noun.ends_with("ie") || !noun.ends_with('y') {
        format!("{noun}s")
    } else {
        format!("{}ies", noun.trim_end_matches('y'))
    };
    format!("{} {}", words::capital(&words::count(n)), if n == 1 { noun.to_owned() } else { plural })
}
