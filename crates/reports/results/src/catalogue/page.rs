//! docs/reference/threats.md out of the catalogue and the scenarios: the threats, and the tests of each.

use std::fmt::Write as _;

use super::{Catalogue, ThreatRow};
use scenario::{Scenario, TechniqueId};

pub(super) fn page(catalogue: &Catalogue, scenarios: &[Scenario]) -> String {
    let mut text = catalogue.head.clone();
    text.push_str("\n## The threats\n\n");
    table(
        &mut text,
        &[
            "id",
            "attack / fault (parameters)",
            "STRIDE",
            "technique ids",
            "interface",
            "requirement",
            "expected containment",
        ],
    );
    for row in &catalogue.row {
        let stride: Vec<String> = row.stride.iter().map(|s| s.letter().to_string()).collect();
        let cells = [
            row.id.as_str(),
            &row.threat,
            &stride.join(" "),
            &techniques(row),
            &row.interface,
            row.requirement.name(),
            &row.containment,
        ];
        line(&mut text, &cells.map(str::to_owned));
    }
    text.push_str("\n## What tests them\n\n");
    text.push_str("*Evidence* is where the real mechanism runs. *Open* is what the row lacks.\n\n");
    table(&mut text, &["id", "evidence", "scenarios", "tests and commands", "open"]);
    for row in &catalogue.row {
        let evidence: Vec<&str> = row.evidence.iter().map(|e| e.name()).collect();
        let named: Vec<String> =
            row.scenarios_naming(scenarios).iter().map(|s| format!("`{}`", s.name.as_str())).collect();
        let tests = row.tests.iter().map(|test| format!("`{}`", test.trim_start_matches("tests/")));
        let commands = row.commands.iter().map(|command| format!("`{command}`"));
        let shown = |cells: Vec<String>| if cells.is_empty() { "–".to_owned() } else { cells.join(", ") };
        let cells = [
            row.id.as_str().to_owned(),
            evidence.join(", "),
            shown(named),
            shown(tests.chain(commands).collect()),
            row.open.clone().unwrap_or_default(),
        ];
        line(&mut text, &cells);
    }
    text.push('\n');
    text.push_str(&catalogue.tail);
    text
}

/// ICS, Enterprise and ATLAS apart, in this order; approximate matches are marked.
fn techniques(row: &ThreatRow) -> String {
    let group = |technique: &&TechniqueId| match technique.as_str() {
        id if id.starts_with("AML.") => 2,
        id if id.starts_with("T0") => 0,
        _ => 1,
    };
    let shown = |technique: &TechniqueId| {
        let mark = if row.nearest.contains(technique) { "≈" } else { "" };
        format!("{mark}{}", technique.as_str())
    };
    let groups = (0..3).map(|wanted| {
        let members = row.techniques.iter().filter(|t| group(t) == wanted);
        members.map(shown).collect::<Vec<_>>().join(" ")
    });
    groups.filter(|g| !g.is_empty()).collect::<Vec<_>>().join(" · ")
}

fn table(text: &mut String, columns: &[&str]) {
    line(text, &columns.iter().map(|c| (*c).to_owned()).collect::<Vec<_>>());
    line(text, &columns.iter().map(|_| "--".to_owned()).collect::<Vec<_>>());
}

fn line(text: &mut String, cells: &[String]) {
    let result = writeln!(text, "| {} |", cells.join(" | "));
    result.expect("invariant: a string takes what is written to it");
}
