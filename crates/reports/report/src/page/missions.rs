//! Progress of the missions of runs: a class is no evidence about a platform that never set out.

use results::report::RunObject;

use crate::Dossier;
use crate::figure::Table;
use crate::reader::FoundResult;

/// A row a run with a platform: way and times are means of its trials by the plant's truth.
pub(super) fn rows(dossier: &Dossier) -> Table {
    let mut rows = Table::new(&[
        "scenario",
        "evidence",
        "n",
        "armed",
        "acted",
        "short",
        "way (m)",
        "nominal (s)",
        "passed",
        "stuck",
        "stuck (s)",
        "never carried out",
    ]);
    for given in dossier.results.files() {
        let runs = if let FoundResult::Runs(runs) = &given.found { runs.as_slice() } else { &[] };
        rows.rows.extend(runs.iter().filter_map(row));
    }
    rows
}

fn row(run: &RunObject) -> Option<Vec<String>> {
    let mission = Some(&run.mission).filter(|mission| mission.n > 0)?;
    let texts: Vec<String> = mission.never.iter().map(|(step, n)| format!("{step} ({n})")).collect();
    let counts = [mission.n, mission.armed, mission.acted, mission.missing].map(|n| n.to_string());
    let mut row = vec![run.scenario.clone(), run.mode.evidence().name().to_owned()];
    row.extend(counts);
    row.extend([format!("{:.1}", mission.driven_m), format!("{:.1}", mission.nominal_s)]);
    row.extend(match &mission.progress {
        Some(of) => [
            format!("{:.0} %", of.completed * 100.0),
            format!("{} of {}", of.stuck, of.n),
            format!("{:.1}", of.stuck_s),
        ],
        None => ["-", "-", "-"].map(str::to_owned),
    });
    row.push(texts.join("; "));
    Some(row)
}
