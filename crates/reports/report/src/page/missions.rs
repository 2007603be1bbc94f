//! Progress of the missions of runs: a class is no evidence about a platform that never set out.

use maud::{Markup, html};
use results::report::RunObject;

use super::table;
use crate::Dossier;
use crate::figure::Table;
use crate::reader::FoundResult;

pub(super) fn section(dossier: &Dossier) -> Markup {
    let rows = rows(dossier);
    html! {
        @if !rows.rows.is_empty() {
            p {
                "Armed: the unit held authority. Acted: by the plant's record. Short: the mission did not come as far as the scenario presumes, so that "
                "nothing is shown. Passed: share of the way points, by the plant's truth. Stuck: trials in which the vehicle did not get on though its mode let it "
                "drive, and for how long. Way by the plant's truth, and times: means of the trials."
            }
            (table(&rows, "Missions"))
        }
    }
}

fn rows(dossier: &Dossier) -> Table {
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

#[cfg(test)]
mod tests {
    use crate::reader::{Results, golden};

    use super::*;

    #[test]
    fn missions_are_reported_with_a_platform_only() {
        let page = |run: &serde_json::Value| {
            let mut results = Results::default();
            results.read("run.json", run.to_string().as_bytes()).expect("a run");
            section(&Dossier { results, ..Dossier::default() }).into_string()
        };
        let mut run = golden("run");
        let guarded_page = page(&run);
        assert!(
            guarded_page.contains("<td>4.2</td>") && guarded_page.contains("arm: never, no vehicle shown (1)"),
            "{guarded_page}"
        );
        run.as_object_mut().and_then(|run| run.remove("mission")).expect("a mission");
        assert_eq!(page(&run), "");
    }
}
