//! A search as a picture: each finding with its least sequence and its edge, and how near to each limit any sequence came.

use maud::{Markup, html};
use results::report::{FindingRow, SearchObject};

use super::said;
use crate::page::shape::shape;
use crate::page::words;

/// Findings and approaches.
pub(super) fn found(search: &SearchObject) -> Markup {
    html! {
        @if !search.findings.is_empty() {
            (said("What was found", "Each finding is shrunk: nothing less of it does the same. Edges are the twin's."))
            @for finding in &search.findings { (one(finding)) }
        }
        @if !search.hunt.nearest.is_empty() {
            (said("How near any sequence came to each limit", "The bar is the way to the limit that the platform's bounds state, the black edge the limit. Beyond it the judge still allows for clocks and periods."))
            @for row in &search.hunt.nearest {
                @let share = f64::from(row.thousandths) / 10.0;
                div class="drow" {
                    span { (row.limit.name()) }
                    b { (format!("{share:.1} %")) }
                    div class=(if row.thousandths > 1000 { "dbar over" } else { "dbar" }) { i style=(format!("width:{:.1}%", share.min(100.0))) {} }
                    span class="lim" { "limit 100 %" }
                    small { (if row.sequence.is_empty() { "no sequence" } else { row.sequence.as_str() }) }
                }
            }
        }
    }
}

fn one(finding: &FindingRow) -> Markup {
    let edges = finding.margins.iter().map(|m| match m.fails {
        Some(fails) => format!("{} {}: {} is enough, {} is not", m.of, m.number, m.holds, fails),
        None => format!("{} {}: {} is enough", m.of, m.number, m.holds),
    });
    html! {
        h3 { (shape(finding.outcome)) (finding.outcome.name()) ": " (finding.word) }
        p { (finding.finding.as_deref().unwrap_or("no property broken")) ". Found in sequence " (finding.trial) ", after "
            (words::three_digits(finding.cpu_seconds)) " CPU s; " (finding.executions) " trials to shrink it." }
        ul {
            @for edge in edges { li { (edge) } }
            @if !finding.stopped_by.is_empty() { li { "Stopped by: " (finding.stopped_by.join(", ")) } }
            li { code { (finding.reproduce) } }
        }
    }
}
