//! Cost of the checks without an attack: false stops, orders that were never carried out, CPU; and the cost of a simulated second.

use maud::{Markup, html};
use results::report::{Comparison, RunObject, TwinCost};

use super::{figure, words};
use crate::Dossier;
use crate::figure::{Bar, Figure, Segment, bar_table, bars};
use crate::reader::{FoundResult, Given};

/// A number and its words.
type Price = (String, String);

pub(super) fn section(dossier: &Dossier) -> Markup {
    let prices: Vec<Price> = dossier.results.files().iter().flat_map(prices).collect();
    let figures = figures(dossier);
    html! { @if !prices.is_empty() || !figures.is_empty() {
        h2 { "What the checks cost" }
        div class="cost" { @for (value, said) in &prices { div { b { (value) } span { (said) } } } }
        @for f in &figures { (figure(f)) }
    } }
}

fn prices(given: &Given) -> Vec<Price> {
    match &given.found {
        FoundResult::Runs(runs) => runs.iter().flat_map(of_run).collect(),
        FoundResult::BenchLive(bench) => bench.live_null_attack.iter().flat_map(of_run).collect(),
        FoundResult::Comparison(comparison) => of_comparison(comparison),
        FoundResult::Campaign(campaign) => {
            let trips: u64 = campaign.rows.iter().map(|row| row.false_trips).sum();
            let seconds: f64 = campaign.rows.iter().map(|row| row.sim_seconds).sum();
            vec![(words::number(trips, "false stop"), format!("in {}", hours(seconds)))]
        }
        FoundResult::Matrix(_)
        | FoundResult::Reference(_)
        | FoundResult::Search(_)
        | FoundResult::Curve(_)
        | FoundResult::Ablation(_)
        | FoundResult::TwinCost(_)
        | FoundResult::Worlds(_) => Vec::new(),
    }
}

fn hours(seconds: f64) -> String {
    if seconds < 600.0 {
        format!("{} s", words::grouped(seconds.round() as u64))
    } else {
        format!("{} h", words::three_digits(seconds / 3600.0))
    }
}

fn of_run(run: &RunObject) -> Vec<Price> {
    let (summary, mission) = (&run.summary, &run.mission);
    let trips = summary.false_trips_per_hour * summary.sim_seconds / 3600.0;
    let upper = summary.false_trips_per_hour_upper_95;
    let bound = upper.map(|most| format!(", below {} an hour (95 %)", words::three_digits(most))).unwrap_or_default();
    let mut all = vec![(
        words::number(trips.round() as u64, "false stop"),
        format!("{}: in {}{bound}", run.scenario, hours(summary.sim_seconds)),
    )];
    if mission.n > 0 {
        let never: u64 = mission.never.values().sum();
        let value = if never == 0 {
            "No order left undone".to_owned()
        } else {
            format!("{} left undone", words::number(never, "order"))
        };
        all.push((
            value,
            format!(
                "{} of {} missions armed, {} m driven on average",
                mission.armed,
                mission.n,
                words::three_digits(mission.driven_m)
            ),
        ));
    }
    if summary.cpu_seconds > 0.0 {
        let value = format!("{} CPU s", words::three_digits(summary.cpu_seconds));
        all.push((
            value,
            format!(
                "for {} s of {}",
                words::grouped(summary.sim_seconds.round() as u64),
                if run.mode.evidence() == scenario::Evidence::Live { "a live run" } else { "simulation" }
            ),
        ));
    }
    all
}

fn of_comparison(comparison: &Comparison) -> Vec<Price> {
    let quiet = comparison.rows.iter().filter(|row| row.quiet);
    quiet
        .map(|row| {
            let driven = row.driven_m.mean.map_or("–".to_owned(), |m| format!("{} m driven", words::three_digits(m)));
            let said = format!(
                "{} {}, no attack: {} false stops, {:.1} % of set-points limited",
                row.guest,
                row.conduct,
                row.false_trips,
                row.limited * 100.0
            );
            (driven, said)
        })
        .collect()
}

/// The figures of cost, for files too.
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
