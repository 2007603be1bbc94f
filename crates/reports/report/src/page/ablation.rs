//! Attacks that each check keeps out, and its cost without an attack.

use maud::{Markup, html};
use results::report::{Ablation, CheckRow, Worth};

use super::table;
use crate::Dossier;
use crate::figure::Table;
use crate::reader::FoundResult;
use crate::tried::class_counts;

pub(super) fn section(dossier: &Dossier) -> Markup {
    let all = dossier
        .results
        .files()
        .iter()
        .filter_map(|g| if let FoundResult::Ablation(a) = &g.found { Some(a) } else { None });
    html! { @for ablation in all {
        p class="watermark" { (ablation.watermark) }
        p { (ablation.defects.found) " of " (ablation.defects.n) " checks are missed when each is waived alone, over " (ablation.attacks)
            " attacks with up to " (ablation.trials) " pairs each, seed " (ablation.seed) ". Trials with and without a check have the same seeds." }
        (table(&rows(ablation), "Checks"))
    } }
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
