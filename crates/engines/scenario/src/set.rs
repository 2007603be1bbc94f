//! Settings: values put into a scenario by their path, as if they had stood there in the file.
//!
//! A scenario is taken apart into TOML, changed and read again, so a value that is set meets the same types and ranges as one
//! that is written. Holding changed values against each other is the part of `check`, as for any scenario.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use super::Scenario;

/// Most values that are set together.
const MAX_SETTINGS: usize = 16;
/// Keys that no path may begin with: a variation has its own keys for some, and has no use for the others.
const KEPT: [&str; 9] =
    ["schema_version", "name", "extends", "policy", "expected", "under", "cell", "curve", "scene_file"];

/// Values by their path: keys and places (from 0) joined by points, such as `delay.0.by_ms`. A place one behind the last
/// adds an entry.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct Settings(BTreeMap<String, serde_json::Value>);

/// Values or entries do not fit a scenario.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SettingsError {
    /// Too many values are set together.
    #[error("{got} values are set, at most {MAX_SETTINGS} are taken")]
    Many {
        /// Their number.
        got: usize,
    },
    /// A path that leads to no place of the scenario.
    #[error("`{path}` leads nowhere")]
    Nowhere {
        /// The path.
        path: String,
    },
    /// A key that no setting may change.
    #[error("`{key}` is not for a path to set")]
    Reserved {
        /// The first key of a path.
        key: &'static str,
    },
    /// A value that TOML cannot represent.
    #[error("`{path}`: {error}")]
    Value {
        /// Its path.
        path: String,
        /// TOML's error.
        error: toml::ser::Error,
    },
    /// Values that are wrong at their places.
    #[error("{paths}: {message}")]
    Wrong {
        /// Their paths.
        paths: String,
        /// TOML's message.
        message: String,
    },
    /// Entries of a table that a scenario does not have.
    #[error("a scenario has no tables `{name}`")]
    NoTable {
        /// Name.
        name: String,
    },
    /// An entry that is wrong in its table.
    #[error("{message}")]
    Entry {
        /// TOML's message.
        message: String,
    },
    /// Parts of the scenario that do not fit together.
    #[error("{message}")]
    Unfit {
        /// The first mistake.
        message: String,
    },
    /// A scenario that TOML cannot represent; a defect of this program.
    #[error(transparent)]
    Unwritable(#[from] toml::ser::Error),
}

impl Settings {
    /// One value.
    pub fn one(path: &str, value: serde_json::Value) -> Self {
        Self(BTreeMap::from([(path.to_owned(), value)]))
    }

    /// Each value with its path, in the order of paths.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &serde_json::Value)> {
        self.0.iter().map(|(path, value)| (path.as_str(), value))
    }

    /// The scenario with these values in it, without its cells and its curve.
    ///
    /// # Errors
    /// A path that leads nowhere, a value that is wrong there, or too many values.
    pub fn applied_to(&self, scenario: &Scenario) -> Result<Scenario, SettingsError> {
        let mut bare = scenario.clone();
        (bare.cell, bare.curve) = (super::List::default(), None);
        if self.0.is_empty() {
            return Ok(bare);
        }
        if self.0.len() > MAX_SETTINGS {
            return Err(SettingsError::Many { got: self.0.len() });
        }
        let mut table = Table::try_from(&bare)?;
        for (path, value) in &self.0 {
            put(&mut table, path, value)?;
        }
        let text = toml::to_string(&table)?;
        let paths = || self.0.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
        toml::from_str(&text)
            .map_err(|e| SettingsError::Wrong { paths: paths(), message: e.message().trim().to_owned() })
    }
}

impl FromIterator<(String, serde_json::Value)> for Settings {
    fn from_iter<I: IntoIterator<Item = (String, serde_json::Value)>>(values: I) -> Self {
        Self(values.into_iter().collect())
    }
}

/// Puts a value at its path.
fn put(table: &mut Table, path: &str, value: &serde_json::Value) -> Result<(), SettingsError> {
    let nowhere = || SettingsError::Nowhere { path: path.to_owned() };
    let value = Value::try_from(value).map_err(|error| SettingsError::Value { path: path.to_owned(), error })?;
    let (way, last) = path.rsplit_once('.').unwrap_or(("", path));
    let mut steps = way.split('.').filter(|_| !way.is_empty());
    let first = steps.next().unwrap_or(last);
    if let Some(key) = KEPT.into_iter().find(|key| *key == first) {
        return Err(SettingsError::Reserved { key });
    }
    if way.is_empty() {
        table.insert(last.to_owned(), value);
        return Ok(());
    }
    let start = table.get_mut(first).ok_or_else(nowhere)?;
    let target = steps.try_fold(start, |target, step| match target {
        Value::Table(table) => table.get_mut(step),
        Value::Array(list) => list.get_mut(step.parse::<usize>().ok()?),
        Value::String(_) | Value::Integer(_) | Value::Float(_) | Value::Boolean(_) | Value::Datetime(_) => None,
    });
    match target.ok_or_else(nowhere)? {
        Value::Table(table) => {
            table.insert(last.to_owned(), value);
        }
        Value::Array(list) => match last.parse::<usize>().map_err(|_| nowhere())? {
            place if place < list.len() => list[place] = value,
            place if place == list.len() => list.push(value),
            _ => return Err(nowhere()),
        },
        Value::String(_) | Value::Integer(_) | Value::Float(_) | Value::Boolean(_) | Value::Datetime(_) => {
            return Err(nowhere());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::{Name, Outcome, find_root, load, parse, shipped, template};
    use super::*;

    fn text() -> String {
        template(&Name::new("x").unwrap())
    }

    fn parse_with(extra: &str) -> Result<Scenario, super::super::Problems> {
        parse("x.toml", "x", &format!("{}{extra}", text()))
    }

    fn problem(extra: &str) -> (String, Option<String>) {
        let problems = parse_with(extra).unwrap_err();
        assert_eq!(problems.all().len(), 1, "{problems}");
        (problems.all()[0].message().to_owned(), problems.all()[0].marked().map(str::to_owned))
    }

    /// A scenario that is taken apart and put together is the same.
    #[test]
    fn shipped_scenarios_survive_a_round_trip() {
        for file in shipped(&find_root(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap()).unwrap() {
            let scenario = load(&file).unwrap();
            let title = serde_json::Value::from(scenario.title.as_str());
            let repeated = Settings::one("title", title).applied_to(&scenario).unwrap();
            assert_eq!(repeated, Settings::default().applied_to(&scenario).unwrap(), "{}", file.display());
        }
    }

    #[test]
    fn cell_sets_values_by_path_keeping_the_rest() {
        let cells = "[[cell]]\nname = \"half/late\"\nexpected = [\"REJECTED\"]\n\
                     set = { \"loss.0.share\" = 0.5, \"loss.0.at_s\" = 5, \"conditions.jitter_ms\" = 3 }\n\
                     [[cell]]\nname = \"all\"\npolicy = \"session-only\"\n";
        let scenario = parse_with(cells).unwrap();
        let [half, all] = <[_; 2]>::try_from(scenario.variations(None)).unwrap();
        assert_eq!((half.cell.as_deref(), half.scenario.policy.as_str()), (Some("half/late"), "default"));
        assert_eq!((half.scenario.loss[0].share.get(), half.scenario.loss[0].at_s.get()), (0.5, 5.0));
        assert_eq!((half.scenario.conditions.jitter_ms.get(), half.scenario.cell.len()), (3, 0));
        assert_eq!(half.scenario.expected[..], [Outcome::Rejected]);
        assert_eq!((all.scenario.loss[0].share.get(), &all.scenario.expected[..]), (1.0, &[Outcome::HoldSafe][..]));
    }

    /// Cells that name none then expect no class.
    #[test]
    fn another_policy_leaves_cells_naming_it_or_none() {
        let cells = "[[cell]]\nname = \"a\"\n[[cell]]\nname = \"b\"\npolicy = \"session-only\"\n\
                     [[cell]]\nname = \"c\"\npolicy = \"session-bound\"\n";
        let left = parse_with(cells).unwrap().variations(Some("session-only"));
        let left: Vec<_> = left.iter().map(|v| (v.cell.as_deref().unwrap(), v.scenario.expected.len())).collect();
        assert_eq!(left, [("a", 0), ("b", 1)]);
    }

    #[test]
    fn mistakes_are_reported_at_their_cell() {
        let cell = |set: &str| problem(&format!("[[cell]]\nname = \"one\"\nset = {{ {set} }}\n"));
        for (set, message) in [
            ("\"loss.1.at_s\" = 5", "in cell one: `loss.1.at_s` leads nowhere"),
            ("\"loss.2\" = 5", "in cell one: `loss.2` leads nowhere"),
            ("\"loss.0.share\" = 1.5", "in cell one: loss.0.share: 1.5 is out of range, expected 0 to 1"),
            ("\"loss.0.shar\" = 1", "in cell one: loss.0.shar: unknown field `shar`, expected one of"),
            ("\"loss.0.at_s\" = 8.5", "in cell one: starts at 8.5 s, up to 1 s later by its phase"),
            ("\"policy\" = \"session-only\"", "in cell one: `policy` is not for a path to set"),
            ("\"cell.0.name\" = \"two\"", "in cell one: `cell` is not for a path to set"),
            ("\"scene.start.at_m\" = [45, 0]", "in cell one: the platform starts outside its geofence"),
        ] {
            let (text, marked) = cell(set);
            assert!(text.starts_with(message), "{set}: {text}");
            assert_eq!(marked.as_deref(), Some("\"one\""), "{set}");
        }
        let problem_text = problem("[[cell]]\nname = \"one\"\n[[cell]]\nname = \"one\"\n");
        assert_eq!(problem_text.0, "cell one is there twice");
        assert!(problem("[[cell]]\nname = \"../one\"\n").0.starts_with("a cell's name is"));
    }
}
