//! The threat catalogue: one row a threat, from `docs/reference/catalogue.toml`, and its mismatches with the scenarios.
//!
//! A row's scenarios are those with files that name it; the row itself names its tests. The existence of those tests is
//! checked by `tests/tidy`, which knows the sources. `page` writes docs/reference/threats.md, `figures`
//! docs/researcher/figures.md; running rows is left to the verb `matrix`.

mod figures;
mod page;

use std::collections::BTreeSet;

use scenario::{Evidence, Platform, Problem, Problems, Requirement, Scenario, Stride, TechniqueId, ThreatId};
use serde::{Deserialize, Serialize};
use topology::Topology;

/// The file, as it was when this program was built.
const TEXT: &str = include_str!("../../../../docs/reference/catalogue.toml");

/// The catalogue.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Catalogue {
    /// Text before the tables of docs/reference/threats.md.
    head: String,
    /// Text behind them.
    tail: String,
    /// The rows, in order.
    pub row: Vec<ThreatRow>,
}

/// One threat.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ThreatRow {
    /// Its id.
    pub id: ThreatId,
    /// The threat, and its parameters.
    pub threat: String,
    /// STRIDE categories.
    pub stride: Vec<Stride>,
    /// ATT&CK and ATLAS techniques.
    pub techniques: Vec<TechniqueId>,
    /// Techniques that are only the nearest there is.
    #[serde(default)]
    pub nearest: Vec<TechniqueId>,
    /// The boundary that is attacked, in words.
    pub interface: String,
    /// The requirement under test.
    pub requirement: Requirement,
    /// Places at which its real mechanism runs; an n from elsewhere is no evidence of it.
    pub evidence: Vec<Evidence>,
    /// Required containment.
    pub containment: String,
    /// Tests named after it, `file::name`.
    pub tests: Vec<String>,
    /// Commands that run it beside its scenarios.
    #[serde(default)]
    pub commands: Vec<String>,
    /// The open gap and its reason; `None` if the row is complete.
    #[serde(default)]
    pub open: Option<String>,
}

impl Catalogue {
    /// The catalogue that this program was built with.
    ///
    /// # Errors
    ///
    /// Faults of the file, with their place.
    pub fn load() -> Result<Self, Problems> {
        toml::from_str(TEXT).map_err(|e| Problem::from_toml("docs/reference/catalogue.toml", TEXT, &e).into())
    }

    /// The row with this id.
    pub fn row(&self, id: &str) -> Option<&ThreatRow> {
        self.row.iter().find(|row| row.id.as_str() == id)
    }

    /// Everything in which rows and scenarios do not fit each other, in words with their remedy.
    pub fn disagreements(&self, scenarios: &[Scenario]) -> Vec<String> {
        let mut found = self.doubles();
        for row in &self.row {
            let tested = !row.scenarios_naming(scenarios).is_empty() && !row.tests.is_empty();
            if !tested && row.open.is_none() {
                let id = row.id.as_str();
                found.push(format!("{id} has no scenario or no test: add one, or say why under `open`"));
            }
        }
        found.extend(scenarios.iter().flat_map(|s| self.disagreement(s)));
        found
    }

    /// docs/reference/threats.md.
    pub fn page(&self, scenarios: &[Scenario]) -> String {
        page::page(self, scenarios)
    }

    /// docs/researcher/figures.md; the architecture is that of a run of `shown` with this topology.
    pub fn figures(&self, scenarios: &[Scenario], shown: &str, topology: &Topology, platforms: &[Platform]) -> String {
        figures::page(self, scenarios, shown, topology, platforms)
    }

    fn doubles(&self) -> Vec<String> {
        let mut seen = BTreeSet::new();
        let doubled = self.row.iter().filter(|row| !seen.insert(row.id.as_str()));
        doubled.map(|row| format!("{} is there twice: take one out", row.id.as_str())).collect()
    }

    fn disagreement(&self, scenario: &Scenario) -> Vec<String> {
        let name = scenario.name.as_str();
        let (known, unknown): (Vec<_>, Vec<_>) =
            scenario.threats.iter().map(|id| (id.as_str(), self.row(id.as_str()))).partition(|(_, row)| row.is_some());
        let mut found: Vec<String> =
            unknown.iter().map(|(id, _)| format!("`{name}` names {id}: no such row")).collect();
        let rows: Vec<&ThreatRow> = known.into_iter().filter_map(|(_, row)| row).collect();
        let text = rows.iter().map(|row| row.id.as_str()).collect::<Vec<_>>().join(", ");
        let mut must = |holds: bool, label: String| {
            if !holds {
                found.push(format!("`{name}` has {label}, {text} not: correct one of the two"));
            }
        };
        for letter in scenario.stride.iter() {
            must(rows.iter().any(|row| row.stride.contains(letter)), format!("STRIDE {}", letter.letter()));
        }
        for technique in scenario.techniques.iter() {
            must(
                rows.iter().any(|row| row.techniques.contains(technique)),
                format!("technique {}", technique.as_str()),
            );
        }
        let requirement = scenario.requirement;
        must(rows.iter().any(|row| row.requirement == requirement), format!("the requirement {}", requirement.name()));
        found
    }
}

impl ThreatRow {
    /// The scenarios that name it.
    pub fn scenarios_naming<'a>(&self, scenarios: &'a [Scenario]) -> Vec<&'a Scenario> {
        scenarios.iter().filter(|s| s.threats.iter().any(|id| id.as_str() == self.id.as_str())).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nominal() -> Scenario {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..");
        scenario::load(&root.join("scenarios/control/nominal.toml")).expect("a shipped scenario loads")
    }

    fn catalogue(rows: &str) -> Catalogue {
        toml::from_str(&format!("head = ''\ntail = ''\n{rows}")).expect("rows of a catalogue")
    }

    fn row(id: &str, more: &str) -> String {
        format!(
            "[[row]]\nid = '{id}'\nthreat = ''\nstride = []\ntechniques = []\ninterface = ''\n\
             requirement = 'runtime-assurance'\nevidence = ['model']\ncontainment = ''\n{more}\n"
        )
    }

    #[test]
    fn row_without_scenario_or_test_needs_a_reason() {
        let bare = catalogue(&(row("N0", "tests = ['a::b']") + &row("A01", "tests = []")));
        let found = bare.disagreements(&[nominal()]);
        assert!(matches!(&found[..], [one] if one.starts_with("A01 has no scenario")), "{found:?}");
        let error_text = catalogue(&(row("N0", "tests = ['a::b']") + &row("A01", "tests = []\nopen = 'later'")));
        assert_eq!(error_text.disagreements(&[nominal()]), Vec::<String>::new());
    }

    /// The requirement of a row must be the scenario's, too.
    #[test]
    fn scenario_carries_its_rows_stride_and_techniques() {
        let mut scenario = nominal();
        scenario.stride = scenario::List::from_first([Stride::Spoofing]);
        scenario.requirement = Requirement::PerceptionIntegrity;
        let found = catalogue(&row("N0", "tests = ['a::b']")).disagreements(&[scenario]);
        assert_eq!(found.len(), 2, "{found:?}");
        let none = catalogue(&row("A01", "tests = []\nopen = 'later'")).disagreements(&[nominal()]);
        assert!(none.iter().any(|f| f.contains("names N0: no such row")), "{none:?}");
    }
}
