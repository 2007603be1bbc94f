//! A run on the page: its lanes over time, and the chain of each loss.

use maud::{Markup, html};
use results::summary::{Lasted, Refusals, RunSummary, Why};

use super::{figure, table};
use crate::figure::{Figure, Lane, Span, Table, class_of_mode, lanes};

/// The lanes of refusals that are drawn; more are in the table alone.
const LANES: usize = 6;

/// The section of one run.
pub(super) fn section(story: &RunSummary) -> Markup {
    html! {
        h3 { "Run " (story.name) }
        @if let Some(flaw) = &story.flaw {
            p { strong class="bad-word" { "INVALID" } ": " (flaw) ". What is told of this run is no better than that." }
        }
        (figure(&drawn(story)))
        @for why in &story.why { (reason_markup(why)) }
    }
}

fn reason_markup(reason: &Why) -> Markup {
    let mut chain = Table::new(&["stage", "at (s)", "log of", "what"]);
    let row =
        |l: &results::summary::ChainLink| vec![l.stage.clone(), format!("{:.3}", l.at), l.by.clone(), l.what.clone()];
    chain.rows = reason.chain.iter().map(row).collect();
    let title = format!("Why {} at {:.3} s ({})", reason.change, reason.at, reason.cause);
    html! {
        details {
            summary { (title) }
            p class="quiet" { "From what the services logged alone; no receipt and no word of the adversary." }
            (table(&chain, &title))
        }
    }
}

/// The figure of one run.
pub(crate) fn drawn(story: &RunSummary) -> Figure {
    let plain = |class: &'static str| move |l: &Lasted| Span { name: l.what.clone(), class, from: l.from, to: l.to };
    let modes = story.modes.iter().map(|l| Span { class: class_of_mode(&l.what), ..plain("other")(l) }).collect();
    let mut all = vec![
        Lane { name: "done to it".to_owned(), spans: story.done.iter().map(plain("attack")).collect(), named: true },
        Lane { name: "mode".to_owned(), spans: modes, named: true },
        Lane {
            name: "authority".to_owned(),
            spans: story.authority.iter().map(plain("authority")).collect(),
            named: false,
        },
    ];
    let lane =
        |r: &Refusals| Lane { name: r.by.clone(), spans: r.at.iter().map(plain("refusal")).collect(), named: true };
    all.extend(story.refused.iter().take(LANES).map(lane));
    let more = story.refused.len().saturating_sub(LANES);
    let more =
        if more > 0 { format!(" {more} more kinds of refusals stand in the table alone.") } else { String::new() };
    let (mark, reason) = story.flaw.as_ref().map_or_else(Default::default, |flaw| {
        (" (INVALID)".to_owned(), format!("INVALID, evidence of nothing: {flaw}. "))
    });
    Figure {
        name: format!("run-{}", super::slug(&story.name)),
        title: format!("Run {}{mark}", story.name),
        caption: format!(
            "{reason}What was done to the run (ground truth, which no service knew), the mode and the authority of the unit under test, and \
             what boundaries refused, by who refused it. n = 1 run of {:.1} s.{more}",
            story.seconds
        ),
        drawing: lanes(&all, story.seconds),
        table: rows(story),
    }
}

fn rows(story: &RunSummary) -> Table {
    let mut table = Table::new(&["kind", "what", "from (s)", "to (s)"]);
    let mut put = |kind: &str, name: &str, l: &Lasted| {
        table.rows.push(vec![kind.to_owned(), name.to_owned(), format!("{:.3}", l.from), format!("{:.3}", l.to)]);
    };
    story.done.iter().for_each(|l| put("done to it", &l.what, l));
    story.modes.iter().for_each(|l| put("mode", &l.what, l));
    story.authority.iter().for_each(|l| put("authority", &l.what, l));
    for refused in &story.refused {
        let name = format!("{} (n {})", refused.reason, refused.n);
        refused.at.iter().for_each(|l| put(&refused.by, &name, l));
    }
    table
}
