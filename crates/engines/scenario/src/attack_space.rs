//! Attack space of a search, as tables of a scenario with the ranges of their numbers.
//!
//! A *move* is one table with everything but its times and numbers fixed; an *entry* is that table with them. The participants
//! that moves require, an insider with credentials or an operator who revokes an identity, are put into the scenario first
//! (`with`), for every combination of entries. Combining entries, and timing them, is the part of `search`.

use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use super::file::read_text;
use super::value::{List, Located, Name, Text, Whole};
use super::{Problem, Problems, Scenario, Settings, SettingsError};

/// Most numbers that one move varies.
const MAX_NUMBERS: usize = 4;
/// Most values that one number takes.
const MAX_VALUES: u32 = 100_000;

/// The attack space: its moves, the ranges of their numbers, and their times.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AttackSpace {
    /// Name, equal to the file's name without `.toml`.
    pub name: Located<Name>,
    /// One line on the adversary that could do all this.
    pub title: Text<160>,
    /// Most moves in an attack sequence.
    pub longest: Whole<1, 6>,
    /// First and last moment at which anything begins, milliseconds.
    pub begins_ms: Located<List<Whole<0, 3_600_000>, 2>>,
    /// Times and lengths are whole multiples of this.
    pub tick_ms: Whole<1, 1_000>,
    /// Requirements of the moves on the scenario: values by their path, as in a cell.
    #[serde(default)]
    pub with: Settings,
    /// The moves. Where several suffice, shrinking prefers the earlier.
    #[serde(rename = "move")]
    pub moves: Located<List<Move, 64>>,
}

/// One action type of the adversary.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Move {
    /// Name in reports.
    pub name: Located<Name>,
    /// Scenario table to which the move adds an entry.
    pub table: Name,
    /// Keys that are the same in each entry.
    #[serde(default)]
    #[schemars(with = "std::collections::BTreeMap<String, serde_json::Value>")]
    pub set: Table,
    /// Length, milliseconds, for a move that lasts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lasts_ms: Option<Range>,
    /// Its numbers, each with its key.
    #[serde(default)]
    pub varies: List<Number, MAX_NUMBERS>,
}

/// A number that a move varies.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Number {
    /// Its key in the table.
    pub key: Name,
    /// Its values.
    pub range: Range,
}

/// Values in equal steps, from the weakest to the strongest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// The weakest.
    pub from: f64,
    /// The strongest; less than the weakest where less is stronger.
    pub to: f64,
    /// Distance between adjacent values.
    pub step: f64,
}

impl Range {
    /// The last place of the range; the first is 0.
    pub fn last(&self) -> u32 {
        // The quotient of decimal fractions may fall just below a whole number, as 0.3 / 0.1 does.
        ((self.to - self.from).abs() / self.step + 1e-9) as u32
    }

    /// The value at a place, rounded to a millionth so that it is written as it was meant.
    pub fn value_at(&self, place: u32) -> f64 {
        let step = self.step.copysign(self.to - self.from);
        let value = self.from + step * f64::from(place.min(self.last()));
        (value * 1e6).round() / 1e6
    }

    /// The nearest place to a value.
    pub fn place(&self, value: f64) -> u32 {
        let way = (value - self.from) * (self.to - self.from).signum();
        ((way / self.step).round().max(0.0) as u32).min(self.last())
    }

    fn is_sound(&self) -> bool {
        let numbers = [self.from, self.to, self.step];
        numbers.iter().all(|n| n.is_finite())
            && self.step > 0.0
            && self.from != self.to
            && (self.to - self.from).abs() / self.step < f64::from(MAX_VALUES)
    }
}

impl Move {
    /// Its numbers in order: the length, where it lasts, and then those that it varies.
    pub fn ranges(&self) -> impl Iterator<Item = &Range> {
        self.lasts_ms.iter().chain(self.varies.iter().map(|number| &number.range))
    }

    /// True if number `n` counts time, in milliseconds.
    pub fn counts_time(&self, n: usize) -> bool {
        match n.checked_sub(usize::from(self.lasts_ms.is_some())) {
            Some(n) => self.varies.get(n).is_some_and(|number| number.key.as_str().ends_with("_ms")),
            None => true,
        }
    }

    /// The places of its numbers at their strongest; at their weakest all are 0.
    pub fn strongest(&self) -> Vec<u32> {
        self.ranges().map(Range::last).collect()
    }

    /// The entry that begins then, with the numbers at those places.
    pub fn entry(&self, begins_ms: u64, places: &[u32]) -> Table {
        let mut entry = self.set.clone();
        entry.insert("at_s".into(), Value::Float(begins_ms as f64 / 1000.0));
        let mut values = self.ranges().zip(places).map(|(range, place)| range.value_at(*place));
        if self.lasts_ms.is_some() {
            let lasts = values.next().unwrap_or_default() / 1000.0;
            entry.insert("duration_s".into(), Value::Float(lasts));
        }
        for (number, value) in self.varies.iter().zip(values) {
            let whole = value.fract() == 0.0 && number.range.step.fract() == 0.0;
            let value = if whole { Value::Integer(value as i64) } else { Value::Float(value) };
            entry.insert(number.key.as_str().to_owned(), value);
        }
        entry
    }
}

impl AttackSpace {
    /// Reads the attack space at `path`.
    ///
    /// # Errors
    /// Everything that is wrong with it, in its place.
    pub fn load(path: &Path) -> Result<Self, Problems> {
        let file = path.display().to_string();
        let text = read_text(path, &file)?;
        let stem = path.file_stem().and_then(|s| s.to_str()).unwrap_or_default();
        Self::parse(&file, stem, &text)
    }

    /// Checks an attack space's text; `stem` is its file's name without the ending.
    ///
    /// # Errors
    /// Everything that is wrong with it, with `file` as its name.
    pub fn parse(file: &str, stem: &str, text: &str) -> Result<Self, Problems> {
        let space: Self = toml::from_str(text).map_err(|e| Problem::from_toml(file, text, &e))?;
        let wrong = space.wrong(stem);
        let problem = |(bytes, message, remedy): (_, String, &str)| Problem::new(file, text, bytes, message, remedy);
        Problems::none_or(wrong.into_iter().map(problem).collect())?;
        Ok(space)
    }

    fn wrong(&self, stem: &str) -> Vec<(std::ops::Range<usize>, String, &'static str)> {
        let mut wrong = Vec::new();
        if self.name.as_str() != stem {
            let message = format!("the file is named `{stem}`");
            wrong.push((self.name.bytes(), message, "make name and file name the same"));
        }
        let (first, last) = self.begins();
        if self.begins_ms.len() != 2 || first > last {
            let remedy = "write it as [first, last], with a multiple of `tick_ms` from one to the other";
            wrong.push((self.begins_ms.bytes(), "no moment to begin at".to_owned(), remedy));
        }
        if self.moves.is_empty() {
            wrong.push((self.moves.bytes(), "no move".to_owned(), "add an `[[move]]`"));
        }
        for (i, of) in self.moves.iter().enumerate() {
            let name = of.name.as_str();
            if self.moves.iter().take(i).any(|before| before.name.as_str() == name) {
                wrong.push((of.name.bytes(), format!("move {name} is there twice"), "give each its own name"));
            }
            if !of.ranges().all(Range::is_sound) {
                let message = format!("move {name} has a range that is none");
                wrong.push((of.name.bytes(), message, "give `from`, another `to`, and a `step` above 0"));
            }
        }
        wrong
    }

    /// The attack space with every number that counts time in steps of a millisecond.
    #[must_use]
    pub fn in_milliseconds(&self) -> Self {
        let finer = |action: &Move| {
            let step =
                |n: usize, range: Range| if action.counts_time(n) { Range { step: 1.0, ..range } } else { range };
            let first = usize::from(action.lasts_ms.is_some());
            let varies = action.varies.iter().enumerate();
            let varies = varies.map(|(i, number)| Number { range: step(first + i, number.range), ..number.clone() });
            Move {
                lasts_ms: action.lasts_ms.map(|range| step(0, range)),
                varies: List::from_first(varies),
                ..action.clone()
            }
        };
        Self { moves: Located::nowhere(List::from_first(self.moves.iter().map(finer))), ..self.clone() }
    }

    /// First and last moment at which anything begins, in ticks.
    pub fn begins(&self) -> (u32, u32) {
        let tick = self.tick_ms.unsigned();
        match &self.begins_ms[..] {
            [first, last] => (first.unsigned().div_ceil(tick) as u32, (last.unsigned() / tick) as u32),
            [] | [_] | [_, _, ..] => (0, 0),
        }
    }
}

impl Scenario {
    /// The scenario with these settings and with further entries in its tables, checked as its own file would be, without
    /// cells and curve.
    ///
    /// # Errors
    /// A setting or an entry that does not fit, in words.
    pub fn with_entries(
        &self,
        settings: &Settings,
        entries: impl IntoIterator<Item = (String, Table)>,
    ) -> Result<Scenario, SettingsError> {
        let mut table = Table::try_from(settings.applied_to(self)?)?;
        for (name, entry) in entries {
            match table.get_mut(&name) {
                Some(Value::Array(list)) => list.push(Value::Table(entry)),
                Some(_) | None => return Err(SettingsError::NoTable { name }),
            }
        }
        let text = toml::to_string(&table)?;
        let entry = |error: toml::de::Error| SettingsError::Entry { message: error.message().trim().to_owned() };
        let scenario: Scenario = toml::from_str(&text).map_err(entry)?;
        scenario.fitting()
    }

    /// Sets its title and description, each cut to the room there is.
    pub fn describe(&mut self, title: &str, description: &str) {
        (self.title, self.description) = (Text::cut(title), Text::cut(description));
    }

    /// The scenario as its own file: under that name, with its scene in it, without empty lists and tables.
    ///
    /// # Errors
    /// TOML cannot represent it: a defect of this program.
    pub fn to_file(&self, name: &Name) -> Result<String, toml::ser::Error> {
        let mut single_scenario = self.clone();
        single_scenario.name = Located::nowhere(name.clone());
        single_scenario.scene_file = None;
        let mut table = Table::try_from(&single_scenario)?;
        // `stride` has no default: without the key the file could not be read again.
        table.retain(|key, value| key == "stride" || !is_empty(value));
        toml::to_string_pretty(&table)
    }
}

fn is_empty(value: &Value) -> bool {
    match value {
        Value::Array(list) => list.is_empty(),
        Value::Table(table) => table.values().all(is_empty),
        Value::String(_) | Value::Integer(_) | Value::Float(_) | Value::Boolean(_) | Value::Datetime(_) => false,
    }
}

#[cfg(test)]
mod tests {
    use super::super::{find_root, load, parse};
    use super::*;
    use evidence::mission::Verb;

    const TEXT: &str = "name = \"a\"\ntitle = \"t\"\nlongest = 2\nbegins_ms = [500, 8000]\ntick_ms = 10\n\
                        [[move]]\nname = \"cut\"\ntable = \"loss\"\nset = { share = 1.0 }\n\
                        lasts_ms = { from = 50, to = 3000, step = 10 }\n\
                        [[move]]\nname = \"hold\"\ntable = \"delay\"\nset = { direction = \"up\" }\n\
                        lasts_ms = { from = 50, to = 3000, step = 10 }\n\
                        varies = [{ key = \"by_ms\", range = { from = 10, to = 2000, step = 10 } }]\n";

    fn nominal() -> Scenario {
        let root = find_root(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap();
        load(&root.join("scenarios/control/nominal.toml")).unwrap()
    }

    #[test]
    fn entries_read_as_if_written_in_the_scenario() {
        let space = AttackSpace::parse("a.toml", "a", TEXT).unwrap();
        let hold = &space.moves[1];
        let entry = ("delay".to_owned(), hold.entry(4_000, &[hold.lasts_ms.unwrap().place(300.0), 29]));
        let scenario = nominal().with_entries(&Settings::default(), [entry]).unwrap();
        let delay = &scenario.delay[0];
        assert_eq!((delay.at_s.get(), delay.duration_s.get(), delay.by_ms.get()), (4.0, 0.3, 300));
        assert!(scenario.loss.is_empty());
    }

    /// `with` takes effect in a scenario without any entry.
    #[test]
    fn requirements_of_moves_are_always_there() {
        let overrides = "[with]\n\"operator.step.2.do\" = \"hold\"\n\
                    \"unit.0\" = { name = \"unit-b\", role = \"insider\", start = { at_m = [-15, 6] } }\n[[move]]";
        let space = AttackSpace::parse("a.toml", "a", &TEXT.replacen("[[move]]", overrides, 1)).unwrap();
        let scenario = nominal().with_entries(&space.with, []).unwrap();
        let last = scenario.operator.step.last().unwrap();
        assert_eq!((scenario.unit[0].name.as_str(), *last.verb), ("unit-b", Verb::Hold));
        let elsewhere =
            AttackSpace::parse("a.toml", "a", &TEXT.replacen("[[move]]", &overrides.replace("unit.0", "unit.1"), 1));
        let text = nominal().with_entries(&elsewhere.unwrap().with, []).unwrap_err().to_string();
        assert_eq!(text, "`unit.1` leads nowhere");
    }

    #[test]
    fn what_does_not_fit_the_scenario_is_told() {
        let space = AttackSpace::parse("a.toml", "a", TEXT).unwrap();
        let late = ("loss".to_owned(), space.moves[0].entry(9_500, &[0]));
        assert!(
            nominal()
                .with_entries(&Settings::default(), [late])
                .unwrap_err()
                .to_string()
                .starts_with("starts at 9.5 s")
        );
        let nowhere = ("los".to_owned(), space.moves[0].entry(1_000, &[0]));
        assert_eq!(
            nominal().with_entries(&Settings::default(), [nowhere]).unwrap_err().to_string(),
            "a scenario has no tables `los`"
        );
        let mut undeclared = nominal();
        undeclared.expect([]);
        assert!(
            undeclared.with_entries(&Settings::default(), []).is_ok(),
            "under a policy of which nothing was declared"
        );
    }

    #[test]
    fn scenario_written_as_file_reads_as_the_same() {
        let space = AttackSpace::parse("a.toml", "a", TEXT).unwrap();
        let scenario = nominal()
            .with_entries(&Settings::default(), [("loss".to_owned(), space.moves[0].entry(1_000, &[3]))])
            .unwrap();
        let text = scenario.to_file(&Name::new("found-1").unwrap()).unwrap();
        let repeated = parse("found-1.toml", "found-1", &text).unwrap();
        assert!(text.contains("[[loss]]") && !text.contains("[[delay]]"), "{text}");
        assert_eq!(
            (&repeated.loss, &repeated.operator, &repeated.scene),
            (&scenario.loss, &scenario.operator, &scenario.scene)
        );
    }

    /// The strongest may be the smaller number.
    #[test]
    fn range_runs_from_weakest_to_strongest() {
        let down = Range { from: 0.9, to: 0.1, step: 0.1 };
        let values: Vec<f64> = (0..=down.last()).map(|place| down.value_at(place)).collect();
        assert_eq!(values, [0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1]);
        assert_eq!((down.place(0.32), down.place(2.0), down.place(-1.0)), (6, 0, 8));
    }

    #[test]
    fn senseless_space_is_refused_in_its_place() {
        for (wrong, with, message, marked) in [
            ("[500, 8000]", "[8000, 500]", "no moment to begin at", "[8000, 500]"),
            ("[500, 8000]", "[501, 509]", "no moment to begin at", "[501, 509]"),
            ("name = \"hold\"", "name = \"cut\"", "move cut is there twice", "\"cut\""),
            ("step = 10 } }]", "step = 0 } }]", "move hold has a range that is none", "\"hold\""),
            ("to = 2000, step = 10", "to = inf, step = 10", "move hold has a range that is none", "\"hold\""),
        ] {
            let problems = AttackSpace::parse("a.toml", "a", &TEXT.replace(wrong, with)).unwrap_err();
            let problem = &problems.all()[0];
            assert_eq!((problem.message(), problem.marked()), (message, Some(marked)), "{with}");
        }
    }
}
