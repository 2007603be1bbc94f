//! Cost of a simulated second, by stage.

use maud::{Markup, html};
use results::report::TwinCost;

use super::figure;
use crate::Dossier;
use crate::figure::{Bar, Figure, Segment, bar_table, bars};
use crate::reader::FoundResult;

pub(super) fn section(dossier: &Dossier) -> Markup {
    html! { @for f in figures(dossier) { (figure(&f)) } }
}

pub(super) fn figures(dossier: &Dossier) -> Vec<Figure> {
    let iter = dossier.results.files().iter();
    iter.filter_map(|g| if let FoundResult::TwinCost(cost) = &g.found { Some(drawn(cost)) } else { None }).collect()
}

fn drawn(cost: &TwinCost) -> Figure {
    let most = cost.stages.iter().map(|s| s.us).fold(0.0, f64::max);
    let bar = |s: &results::report::StageCost| Bar {
        name: s.stage.clone(),
        parts: vec![Segment { name: "µs".to_owned(), class: "plain", amount: s.us.max(0.0) }],
        said: format!("{:.1} µs, {:.1} %", s.us, s.share * 100.0),
    };
    let all: Vec<Bar> = cost.stages.iter().map(bar).collect();
    let manner = if cost.rendered { "rendered" } else { "unrendered" };
    Figure {
        name: format!("cost-{}-{manner}", super::slug(&cost.scenario)),
        title: format!("CPU of a simulated second of {}, {manner}, by stage", cost.scenario),
        caption: format!(
            "Median of {} rounds of {} trials, first seed {}. Simulated seconds a CPU second: {:.0} (least {:.0}, most {:.0}). CPU over that of bare \
             rapier on the same course: {:.2} ({:.2} to {:.2}).",
            cost.rounds,
            cost.trials,
            cost.seed,
            cost.per_cpu_second.median,
            cost.per_cpu_second.min,
            cost.per_cpu_second.max,
            cost.ratio.median,
            cost.ratio.min,
            cost.ratio.max
        ),
        drawing: bars(&all, Some(most)),
        table: bar_table(&all, "stage", "CPU of a simulated second"),
    }
}
