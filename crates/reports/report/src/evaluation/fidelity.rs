//! Which conclusions hang on the models: the same scenarios where sensors, plant or link are taken to be better or worse.
//!
//! A conclusion flips where a trial leaves the classes that its scenario states. Whether it flips into harm is distinguished from that.

use std::collections::{BTreeMap, BTreeSet};

use evidence::trial::Outcome;
use results::report::CampaignRow;

use super::put;
use crate::reader::{FoundResult, Results};
use crate::tried::class_counts;

/// The policy that needs no naming.
const SHIPPED: &str = "default";

/// The section; empty without a campaign that set any value.
pub(super) fn fidelity(results: &Results) -> String {
    let campaigns =
        results.files().iter().filter_map(|g| if let FoundResult::Campaign(c) = &g.found { Some(c) } else { None });
    let rows: Vec<&CampaignRow> =
        campaigns.filter(|c| c.complete).flat_map(|c| &c.rows).filter(|r| is_of_a_model(r)).collect();
    if rows.is_empty() {
        return String::new();
    }
    let (least, most) = rows.iter().fold((u64::MAX, 0), |(least, most), r| (least.min(r.n), most.max(r.n)));
    let n = if least == most { least.to_string() } else { format!("{least} to {most}") };
    let mut text = format!(
        "\n## Which conclusions hang on the models?\n\nThe same scenarios under models of sensors, plant and link that are better or worse than those that ship, {n} \
         trials each. *Holds*: every trial ended in a class that the scenario states. `models.noise` is a factor on the noise of every sensor and on what the \
         stages miss, confuse or invent, `models.load` on the vehicle's mass, which its brakes are not told, `models.grip` on friction; \
         `conditions` are the telemetry link's. What harms (UNSAFE, LATE) is bold. Whether a mission took place is in no class: where the unit's guards keep it \
         in IDLE, nothing done to it ends NOMINAL or REJECTED and a loss UNDETECTED, so *holds* beside UNDETECTED in the same row says little \
         (`docs/reference/scenarios.md`).\n\n"
    );
    table(&mut text, &rows);
    flips(&mut text, &rows);
    text
}

/// Settings down, scenarios across, both in the order of the campaigns.
fn table(text: &mut String, rows: &[&CampaignRow]) {
    let (settings, scenarios) = (distinct(rows, setting), distinct(rows, scenario));
    put(text, format_args!("| model | {} |\n|---|{}\n", scenarios.join(" | "), "---|".repeat(scenarios.len())));
    for set in &settings {
        let row_of = |name: &String| rows.iter().find(|r| setting(r) == *set && scenario(r) == *name).map(|r| cell(r));
        let cells: Vec<String> = scenarios.iter().map(|name| row_of(name).unwrap_or_default()).collect();
        put(text, format_args!("| {set} | {} |\n", cells.join(" | ")));
    }
}

/// Values that flip an outcome and values that do not, scenario by scenario.
fn flips(text: &mut String, rows: &[&CampaignRow]) {
    let mut flipped: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for row in rows.iter().filter(|r| r.unexpected > 0) {
        flipped.entry(scenario(row)).or_default().push(format!("{} ({} of {})", setting(row), row.unexpected, row.n));
    }
    let harmed: Vec<String> =
        rows.iter().filter(|r| harms(r)).map(|r| format!("{} at {}", scenario(r), setting(r))).collect();
    put(
        text,
        format_args!("\nOf {} variations {} hold.\n\n", rows.len(), rows.iter().filter(|r| r.unexpected == 0).count()),
    );
    for name in distinct(rows, scenario) {
        match flipped.get(&name) {
            Some(where_to) => put(text, format_args!("- {name} flips at {}\n", where_to.join("; "))),
            None => put(text, format_args!("- {name} holds throughout\n")),
        }
    }
    match harmed.is_empty() {
        true => text.push_str("\nNone flips into harm: no trial was UNSAFE or LATE that the scenario did not state.\n"),
        false => put(text, format_args!("\n**Flips into harm**: {}.\n", harmed.join("; "))),
    }
}

/// True if all its settings are of a model, and no check is waived.
fn is_of_a_model(row: &CampaignRow) -> bool {
    let of_a_model = |key: &str| key.starts_with("models.") || key.starts_with("conditions.");
    row.set.iter().next().is_some()
        && row.set.iter().all(|(key, _)| of_a_model(key))
        && row.counts
        && row.watermark.is_none()
}

fn distinct(rows: &[&CampaignRow], value: impl Fn(&CampaignRow) -> String) -> Vec<String> {
    let mut seen = BTreeSet::new();
    rows.iter().map(|row| value(row)).filter(|name| seen.insert(name.clone())).collect()
}

fn scenario(row: &CampaignRow) -> String {
    let cell = row.cell.as_ref().map_or_else(String::new, |cell| format!(" ({cell})"));
    let policy = if row.policy == SHIPPED { String::new() } else { format!(" (policy {})", row.policy) };
    format!("`{}`{cell}{policy}", row.scenario)
}

fn setting(row: &CampaignRow) -> String {
    let set: Vec<String> = row.set.iter().map(|(key, value)| format!("`{key}` {value}")).collect();
    set.join(", ")
}

fn cell(row: &CampaignRow) -> String {
    match (row.unexpected, harms(row)) {
        (0, _) => "holds".to_owned(),
        (_, false) => class_counts(&row.outcomes),
        (_, true) => format!("**{}**", class_counts(&row.outcomes)),
    }
}

/// True if a trial did harm that its scenario does not state.
fn harms(row: &CampaignRow) -> bool {
    let harm = [Outcome::Unsafe, Outcome::Late];
    harm.iter().any(|class| row.outcomes.contains_key(class) && !row.expected.contains(class))
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;
    use crate::reader::golden;

    /// Nine trials at this noise.
    fn row(noise: u64, outcomes: Value, unexpected: u64) -> Value {
        let mut row = golden("campaign")["rows"][0].take();
        (row["scenario"], row["set"], row["expected"]) =
            ("replay".into(), json!({"models.noise": noise}), json!(["REJECTED"]));
        (row["cell"], row["watermark"], row["n"]) = (Value::Null, Value::Null, 9.into());
        (row["outcomes"], row["unexpected"]) = (outcomes, unexpected.into());
        row
    }

    fn render_rows(rows: Vec<Value>) -> String {
        let mut campaign = golden("campaign");
        campaign["rows"] = rows.into();
        let mut results = Results::default();
        results.read("c.json", campaign.to_string().as_bytes()).expect("a campaign");
        fidelity(&results)
    }

    #[test]
    fn variation_outside_its_classes_flips_a_conclusion() {
        let text =
            render_rows(vec![row(1, json!({"REJECTED": 9}), 0), row(2, json!({"REJECTED": 7, "FALSE_TRIP": 2}), 2)]);
        assert!(text.contains("| `models.noise` 1 | holds |"), "{text}");
        assert!(text.contains("- `replay` flips at `models.noise` 2 (2 of 9)"), "{text}");
        assert!(text.contains("Of 2 variations 1 hold.") && text.contains("None flips into harm"), "{text}");
        assert_eq!(fidelity(&Results::default()), "");
    }

    #[test]
    fn non_model_settings_are_no_fidelity_question() {
        let mut row = row(2, json!({"REJECTED": 9}), 0);
        row["set"] = json!({"delay.0.by_ms": 2});
        assert_eq!(render_rows(vec![row]), "");
    }

    #[test]
    fn harm_is_told_from_what_only_costs() {
        let text = render_rows(vec![row(2, json!({"REJECTED": 8, "UNSAFE": 1}), 1)]);
        assert!(text.contains("**Flips into harm**: `replay` at `models.noise` 2.") && text.contains("| **"), "{text}");
    }
}
