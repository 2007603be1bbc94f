//! Time from a fault or an attack to DEGRADED, from its receipt: live beside the paper's figures.

use results::report::{BenchLive, RunObject};
use stats::Sample;

use crate::Dossier;
use crate::figure::{Figure, Mark, Steps, Table, ecdf, ecdf_table};
use crate::reader::FoundResult;

pub(super) fn figures(dossier: &Dossier) -> Vec<Figure> {
    let iter = dossier.results.files().iter();
    iter.filter_map(|g| if let FoundResult::BenchLive(bench) = &g.found { of_bench(bench) } else { None }).collect()
}

/// The distribution of live losses beside the paper's means.
pub(super) fn of_bench(bench: &BenchLive) -> Option<Figure> {
    let values = |run: &RunObject| run.trials.iter().filter_map(|t| t.latency_ms.to_degraded).collect();
    let samples: Vec<Steps> =
        bench.losses.iter().map(|run| Steps { name: run.scenario.clone(), values: values(run) }).collect();
    let mark = |l: &results::report::LiveLatency| Mark {
        name: format!("paper: {}, mean of {}", l.paper.loss, l.paper.n),
        at: l.paper.mean_ms,
    };
    let marks: Vec<Mark> = bench.live_latency_ms.iter().map(mark).collect();
    let n: Vec<String> = samples.iter().map(|s| format!("{} n = {}", s.name, s.values.len())).collect();
    Some(Figure {
        name: "latency".to_owned(),
        title: "From loss to DEGRADED, live".to_owned(),
        caption: format!(
            "Share of the live runs in which DEGRADED came no later; upright lines are the paper's means, on other hardware. {}.",
            n.join(", ")
        ),
        drawing: ecdf(&samples, &marks)?,
        table: ecdf_table(&samples, &marks),
    })
}

/// p95 is the value that 95 % of the sample do not exceed; its bound needs at least 59 values. An empty field: there were fewer.
pub(super) fn rows(dossier: &Dossier) -> Table {
    let mut rows = Table::new(&["scenario", "evidence", "to", "n", "mean (ms)", "p95 (ms)", "p95 at most (95 %)"]);
    let mut put = |scenario: &str, cell: Option<&str>, place: &str, to: &str, s: &Sample| {
        let ms = |v: Option<f64>| v.map_or_else(String::new, |v| format!("{v:.1}"));
        let name = cell.map_or_else(|| scenario.to_owned(), |cell| format!("{scenario}: {cell}"));
        if s.n > 0 {
            let cells =
                [name, place.to_owned(), to.to_owned(), s.n.to_string(), ms(s.mean), ms(s.p95), ms(s.p95_upper_95)];
            rows.rows.push(cells.to_vec());
        }
    };
    for given in dossier.results.files() {
        let runs = match &given.found {
            FoundResult::Runs(runs) => runs.as_slice(),
            FoundResult::BenchLive(bench) => bench.losses.as_slice(),
            FoundResult::Reference(reference) => {
                for row in &reference.rows {
                    let (cell, place, l) = (row.cell.as_deref(), row.evidence.name(), &row.summary.latency_ms);
                    put(&row.scenario, cell, place, "DEGRADED", &l.to_degraded);
                    put(&row.scenario, cell, place, "HOLD_SAFE", &l.to_hold_safe);
                }
                continue;
            }
            FoundResult::Matrix(_)
            | FoundResult::Campaign(_)
            | FoundResult::Search(_)
            | FoundResult::Comparison(_)
            | FoundResult::Curve(_)
            | FoundResult::Ablation(_)
            | FoundResult::TwinCost(_)
            | FoundResult::Worlds(_) => continue,
        };
        for run in runs {
            let (place, l) = (run.mode.evidence().name(), &run.summary.latency_ms);
            put(&run.scenario, None, place, "DEGRADED", &l.to_degraded);
            put(&run.scenario, None, place, "HOLD_SAFE", &l.to_hold_safe);
        }
    }
    rows
}
