//! Attacks that each check keeps out: the outcomes with it beside those without, and its cost without an attack.

use maud::{Markup, html};
use results::report::{Ablation, CheckRow, Worth};

use super::table;
use crate::figure::Table;
use crate::tried::class_counts;

/// A row a check.
pub(super) fn picture(ablation: &Ablation) -> Markup {
    html! {
        h2 { "What each check is worth" }
        p class="say" { (ablation.watermark) }
        (table(&rows(ablation), "Checks"))
    }
}

fn rows(ablation: &Ablation) -> Table {
    let mut rows = Table::new(&[
        "check",
        "keeps out",
        "attacks that differ without it",
        "false trips an hour, with and without",
        "CPU s an hour, with and without",
    ]);
    for check in &ablation.checks {
        let [trips, cpu] = check.quiet.as_ref().map_or_else(Default::default, |q| {
            let pair = |[with, without]: [f64; 2]| format!("{with:.2}, {without:.2}");
            [pair(q.false_trips_per_hour), pair(q.cpu_seconds_per_hour)]
        });
        rows.rows.push(vec![check.check.clone(), worth(check), attacks(check), trips, cpu]);
    }
    rows
}

fn worth(check: &CheckRow) -> String {
    match check.worth {
        Worth::Alone => "by itself",
        Worth::Pair => "together with another",
        Worth::None => "nothing that was seen",
    }
    .to_owned()
}

fn attacks(check: &CheckRow) -> String {
    let one = |a: &results::report::AttackRow| {
        let name = a.cell.as_ref().map_or_else(|| a.scenario.clone(), |cell| format!("{} ({cell})", a.scenario));
        format!("{name}: {} → {}", class_counts(&a.with), class_counts(&a.without))
    };
    check.attacks.iter().map(one).collect::<Vec<_>>().join("; ")
}
