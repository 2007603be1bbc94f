//! How far measured values are from the limits that the platform is made for.

use evidence::trial::Outcome;
use maud::{Markup, html};
use results::report::RunObject;
use results::summary::{Distance, RunSummary};

use super::{runs, words};
use crate::Dossier;

/// A row.
struct Measured {
    what: String,
    value: f64,
    limit: f64,
    unit: &'static str,
    note: String,
    least: bool,
    /// True if the limit counts from a later time, so that the value does not tell about it.
    earlier: bool,
}

/// Rows of the results' latencies, then of the run that is told at length.
pub(super) fn section(dossier: &Dossier, told: &[&RunSummary]) -> Markup {
    let story = told.iter().find(|story| story.distances.len() > 1).or(told.first());
    let mut all: Vec<Measured> = story.map(|story| of_results(dossier, story)).unwrap_or_default();
    // A contradiction is found in the judgement that stops the unit: no time passes between.
    all.extend(story.iter().flat_map(|story| &story.distances).filter(|of| of.value != 0.0).map(of_run));
    html! { @if !all.is_empty() {
        h2 { "How far from the limits" }
        p class="say" {
            "The bar is the measured share of the limit, the black edge the limit; where the limit is a least, the share of it that is used."
            @if let Some(story) = story { " Single values: " (runs::named(story)) "." }
        }
        @for row in &all { (markup(row)) }
    } }
}

fn of_results(dossier: &Dossier, story: &RunSummary) -> Vec<Measured> {
    let runs = dossier.results.files().iter().flat_map(|given| given.found.runs());
    runs.filter(|run| story.name.starts_with(run.scenario.as_str())).flat_map(|run| of_summary(run, story)).collect()
}

fn of_summary(run: &RunObject, story: &RunSummary) -> Vec<Measured> {
    let latency = &run.summary.latency_ms;
    let [hold, degraded] = story.limits_ms;
    let each = [
        ("Arrival to HOLD_SAFE", &latency.to_hold_safe, hold),
        ("Arrival to DEGRADED", &latency.to_degraded, degraded),
        ("Arrival to loss of authority", &latency.to_authority_revoked, degraded),
    ];
    let row = |(what, sample, limit): (&str, &stats::Sample, u64)| {
        let upper = sample
            .p95_upper_95
            .map(|ms| format!(", at most {} ms (95 %)", words::three_digits(ms)))
            .unwrap_or_default();
        Some(Measured {
            what: what.to_owned(),
            value: sample.p95?,
            limit: limit as f64,
            unit: "ms",
            note: format!("p95{upper}, n {}; the limit counts from the loss", sample.n),
            least: false,
            earlier: sample.p95? > limit as f64 && !run.summary.outcomes.contains_key(&Outcome::Late),
        })
    };
    // Where every trial holds at once, DEGRADED is the same judgement.
    let same = latency.to_degraded == latency.to_hold_safe;
    each.into_iter().filter(|(what, ..)| !(same && what.ends_with("DEGRADED"))).filter_map(row).collect()
}

fn of_run(of: &Distance) -> Measured {
    Measured {
        what: of.what.to_owned(),
        value: of.value,
        limit: of.limit,
        unit: of.unit,
        note: of.from.to_owned(),
        least: of.least,
        earlier: false,
    }
}

fn markup(row: &Measured) -> Markup {
    let share = if row.least { row.limit / row.value } else { row.value / row.limit };
    let over = !(0.0..=1.0).contains(&share);
    let width = if over { 100.0 } else { (share * 100.0).max(0.4) };
    let bound = if row.least { "at least" } else { "limit" };
    html! { div class="drow" {
        span { (row.what) }
        b { (words::three_digits(row.value)) " " (row.unit) }
        @if row.earlier { span class="lim" { "the loss came later than the arrival" } } @else {
            div class=(if over { "dbar over" } else { "dbar" }) { i style=(format!("width:{width:.1}%")) {} }
        }
        span class="lim" { (bound) " " (words::three_digits(row.limit)) " " (row.unit) }
        small { (row.note) }
    } }
}
