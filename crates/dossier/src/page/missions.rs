//! Progress of the missions of runs: a class is no evidence about a platform that never set out.

use maud::{Markup, html};

use super::table;
use crate::Dossier;
use crate::figure::Table;
use crate::objects::Run;
use crate::results::Found;

pub(super) fn section(dossier: &Dossier) -> Markup {
    let rows = rows(dossier);
    html! {
        @if !rows.rows.is_empty() {
            p {
                "Armed: the unit held authority. Acted: by the plant's record. Short: the mission did not come as far as the scenario presumes, so that "
                "nothing is shown. Way by the plant's truth, and time in nominal control: means of the trials."
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
        "never carried out",
    ]);
    for given in dossier.results.given() {
        let runs = if let Found::Runs(runs) = &given.found { runs.as_slice() } else { &[] };
        rows.rows.extend(runs.iter().filter_map(row));
    }
    rows
}

fn row(run: &Run) -> Option<Vec<String>> {
    let mission = run.mission.as_ref().filter(|mission| mission.n > 0)?;
    let never: Vec<String> = mission.never.iter().map(|(step, n)| format!("{step} ({n})")).collect();
    let counts = [mission.n, mission.armed, mission.acted, mission.missing].map(|n| n.to_string());
    let mut row = vec![run.scenario.clone(), run.mode.name().to_owned()];
    row.extend(counts);
    row.extend([format!("{:.1}", mission.driven_m), format!("{:.1}", mission.nominal_s), never.join("; ")]);
    Some(row)
}

#[cfg(test)]
mod tests {
    use crate::results::Results;

    use super::*;

    #[test]
    fn missions_are_reported_with_a_platform_only() {
        let summary = r#"{"n":2,"outcomes":{"INVALID":2},"unsafe_upper_95":1.0,"unsafe_upper_95_invalid_counted":1.0,"distinct_decisions":1,
            "latency_ms":{"to_degraded":{"n":0},"to_hold_safe":{"n":0},"to_authority_revoked":{"n":0}},"cpu_seconds":0.1,"sim_seconds":18.0}"#;
        let run = |mission: &str| {
            format!(
                r#"{{"kind":"run","schema_version":1,"scenario":"loss","mode":"twin","seed":1,"expected":["HOLD_SAFE"],"trials":[],{mission}"summary":{summary}}}"#
            )
        };
        let told = r#""mission":{"n":2,"armed":0,"acted":0,"missing":2,"driven_m":4.25,"nominal_s":3.0,"never":{"arm: never, no vehicle shown":2}},"#;
        let page = |text: &str| {
            let mut results = Results::default();
            results.read("run.json", text.as_bytes()).expect("a run");
            let (title, version) = ("t".to_owned(), "0".to_owned());
            section(&Dossier { title, version, results, stories: Vec::new(), recordings: Vec::new() }).into_string()
        };
        let with = page(&run(told));
        assert!(with.contains("<td>4.2</td>") && with.contains("arm: never, no vehicle shown (2)"), "{with}");
        assert_eq!(page(&run("")), "");
    }
}
