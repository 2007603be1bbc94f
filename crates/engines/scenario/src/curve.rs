//! A curve: one value of a scenario taken through a range, and the classes that count as detection and as harm.
//!
//! The lines of a curve are the scenario's cells, or the scenario itself where it has none. Every point runs on the same seeds,
//! so that points differ by the value alone. The verb `curve` runs it.

use evidence::trial::Outcome;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Scenario;
use super::cell::{Cell, Variation};
use super::set::{Settings, SettingsError};
use super::value::{List, Located, Real, Text};

/// Most points on a line.
const MAX_POINTS: usize = 64;

/// The range that a scenario's curve goes through.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Curve {
    /// Heading of the curve.
    pub title: Text<120>,
    /// Path of the value, as in a cell's `set`.
    pub set: Located<Text<96>>,
    /// The values, each greater than the one before.
    pub values: Located<List<Real<-1_000_000_000, 1_000_000_000>, MAX_POINTS>>,
    /// Unit of the values.
    pub unit: Text<24>,
    /// Classes that say that the attack was noticed or refused.
    #[serde(default = "noticed")]
    pub detected: List<Outcome, 9>,
    /// Classes that say that it did harm.
    #[serde(default = "harm")]
    pub harm: List<Outcome, 9>,
    /// Distance from the truth, in metres, beyond which a teammate's accepted claims have done harm too.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub harm_beyond_m: Option<Real<0, 1_000_000>>,
    /// Classes that any point may end in, in place of each line's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expected: Option<Located<List<Outcome, 9>>>,
}

fn noticed() -> List<Outcome, 9> {
    List::from_first([Outcome::HoldSafe, Outcome::Degraded, Outcome::Rejected])
}

fn harm() -> List<Outcome, 9> {
    List::from_first([Outcome::Unsafe])
}

impl Curve {
    /// One line with one of the values in force; its cell is named `line @ value unit`.
    ///
    /// # Errors
    /// The value that does not fit, in words.
    pub fn variation_at(&self, line: &Variation, value: f64) -> Result<Variation, SettingsError> {
        let mut scenario = self.setting(value).applied_to(&line.scenario)?;
        if let Some(expected) = &self.expected {
            scenario.expected = expected.clone();
        }
        let point = format!("{value} {}", self.unit.as_str());
        let cell = line.cell.as_ref().map_or_else(|| point.clone(), |line| format!("{line} @ {point}"));
        Ok(Variation { cell: Some(cell), scenario })
    }

    fn setting(&self, value: f64) -> Settings {
        let whole = value.fract() == 0.0;
        let number = if whole { serde_json::Value::from(value as i64) } else { serde_json::Value::from(value) };
        Settings::one(self.set.as_str(), number)
    }
}

impl Scenario {
    /// Every point of the curve as a variation, for checking; none where the scenario has no curve.
    pub(super) fn points(&self) -> Vec<Result<Scenario, SettingsError>> {
        let Some(curve) = &self.curve else { return Vec::new() };
        let cell_name = |cell: Option<&Cell>| match cell {
            Some(cell) => self.with_cell(cell),
            None => Settings::default().applied_to(self),
        };
        let lines = match self.cell.is_empty() {
            true => vec![cell_name(None)],
            false => self.cell.iter().map(|cell| cell_name(Some(cell))).collect(),
        };
        // A line that does not fit is an error of its cell, reported there.
        let lines: Vec<Variation> =
            lines.into_iter().flatten().map(|scenario| Variation { cell: None, scenario }).collect();
        let variation = |line: &Variation, value: f64| curve.variation_at(line, value).map(|point| point.scenario);
        lines.iter().flat_map(|line| curve.values.iter().map(|value| variation(line, value.get()))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Name, Problems, parse, template};
    use super::*;

    const CURVE: &str =
        "[curve]\ntitle = \"loss\"\nset = \"loss.0.share\"\nvalues = [0.1, 0.5, 1]\nunit = \"of all\"\n";

    fn parse_with(extra: &str) -> Result<Scenario, Problems> {
        parse("x.toml", "x", &format!("{}{extra}", template(&Name::new("x").unwrap())))
    }

    /// The expectation is that of its line.
    #[test]
    fn each_point_has_value_name_and_expectation() {
        let cell = "[[cell]]\nname = \"early\"\nset = { \"loss.0.at_s\" = 3 }\nexpected = [\"REJECTED\"]\n";
        let scenario = parse_with(&format!("{cell}{CURVE}")).unwrap();
        let curve = scenario.curve.clone().unwrap();
        let line = scenario.variations(None).remove(0);
        let point = curve.variation_at(&line, 0.5).unwrap();
        assert_eq!(point.cell.as_deref(), Some("early @ 0.5 of all"));
        assert_eq!((point.scenario.loss[0].share.get(), point.scenario.loss[0].at_s.get()), (0.5, 3.0));
        assert_eq!(point.scenario.expected[..], [Outcome::Rejected]);
        assert!(curve.variation_at(&line, 2.0).is_err());
        assert_eq!(scenario.points().len(), 3);
    }

    #[test]
    fn mistakes_are_reported_at_the_curve() {
        for (from, to, message) in [
            ("[0.1, 0.5, 1]", "[0.1, 0.5, 0.5]", "no range"),
            ("[0.1, 0.5, 1]", "[0.1]", "no range"),
            ("[0.1, 0.5, 1]", "[0.1, 0.5, 2]", "on the curve: loss.0.share: 2 is out of range, expected 0 to 1"),
            ("loss.0.share", "delay.0.by_ms", "on the curve: `delay.0.by_ms` leads nowhere"),
            ("loss.0.share", "loss.0.direction", "on the curve: loss.0.direction: "),
        ] {
            let problems = parse_with(&CURVE.replace(from, to)).unwrap_err();
            assert!(problems.all()[0].message().starts_with(message), "{to}: {problems}");
            assert!(problems.all()[0].line_column().is_some());
        }
    }
}
