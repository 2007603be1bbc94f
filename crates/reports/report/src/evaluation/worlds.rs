//! Which conclusions hang on the yard: the paper's scenarios in drawn worlds beside their own scene.

use results::report::{Holds, InWorlds, WorldsRow};

use super::put;
use crate::reader::{FoundResult, Results};
use crate::tried::class_counts;

/// Scenarios that the paper's claims rest on.
const OF_THE_PAPER: [&str; 10] = [
    "nominal",
    "replay",
    "delay",
    "duplicate",
    "loss",
    "naive_relay",
    "thermal_loss",
    "rgb_loss",
    "localisation_loss",
    "track_starvation",
];

/// The section; empty without a result of worlds.
pub(super) fn worlds(results: &Results) -> String {
    let found =
        results.files().iter().filter_map(|g| if let FoundResult::Worlds(w) = &g.found { Some(w) } else { None });
    let all: Vec<&InWorlds> = found.collect();
    let rows: Vec<&WorldsRow> =
        all.iter().flat_map(|w| &w.rows).filter(|row| OF_THE_PAPER.contains(&row.scenario.as_str())).collect();
    let (Some(first), false) = (all.first(), rows.is_empty()) else { return String::new() };
    let mut text = format!(
        "\n## Which conclusions hang on the yard?\n\nThe same scenarios in their own scene and in drawn worlds of {} families (`docs/researcher/worlds.md`), \
         seed {}. A trial that is INVALID, since its attack meets nothing to act on, is not counted as unexpected.\n\n\
         | scenario | own scene | drawn worlds | holds |\n|---|---|---|---|\n",
        first.families.len(),
        first.seed
    );
    for row in &rows {
        let (own, drawn) = (class_counts(&row.own.outcomes), class_counts(&row.drawn.outcomes));
        put(&mut text, format_args!("| {} | {own} | {drawn} | {} |\n", name(row), row.holds.words()));
    }
    let kept: Vec<&&WorldsRow> = rows.iter().filter(|row| row.holds == Holds::Both).collect();
    put(&mut text, format_args!("\nOf {} rows {} hold in both.\n", rows.len(), kept.len()));
    text
}

fn name(row: &WorldsRow) -> String {
    let cell = row.cell.as_ref().map_or_else(String::new, |cell| format!(" ({cell})"));
    format!("`{}`{cell}", row.scenario)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::reader::golden;

    fn section(scenario: &str, holds: &str) -> String {
        let mut object = golden("worlds");
        let mut row = object["rows"][0].take();
        (row["scenario"], row["holds"], row["cell"]) = (json!(scenario), json!(holds), json!(null));
        object["rows"] = json!([row]);
        let mut results = Results::default();
        results.read("w.json", object.to_string().as_bytes()).expect("a result of worlds");
        worlds(&results)
    }

    #[test]
    fn rows_of_the_paper_are_counted_where_they_hold() {
        let text = section("replay", "both");
        assert!(text.contains("| `replay` | ") && text.contains("Of 1 rows 1 hold in both."), "{text}");
        let text = section("replay", "own_scene");
        assert!(text.contains("| in the own scene only |") && text.contains("Of 1 rows 0 hold"), "{text}");
        assert_eq!(section("gusts", "both"), "");
        assert_eq!(worlds(&Results::default()), "");
    }
}
