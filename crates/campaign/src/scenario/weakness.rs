//! A list of weaknesses: each a check that is waived, and with what a search is to find that out.
//!
//! How fast it is found, and by which strategy, is `command::worth`'s to measure.

use std::path::Path;

use serde::Deserialize;

use super::read::read_text;
use super::value::{List, Located, Name};
use super::{Problem, Problems};
use crate::ablation::Switch;
use crate::trial::Outcome;

/// A list of weaknesses.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Weaknesses {
    /// The weaknesses, in the order in which they are reported.
    pub weakness: Located<List<Weakness, 128>>,
}

/// One of them.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Weakness {
    /// What it is called in reports.
    pub name: Located<Name>,
    /// What goes on meanwhile, a scenario of one cell.
    pub scenario: Name,
    /// What may be done.
    pub alphabet: Name,
    /// The one thing that is waived.
    pub waive: Switch,
    /// Classes that count as found.
    pub find: Located<List<Outcome, 9>>,
}

impl Weaknesses {
    /// Reads the list at `path`.
    ///
    /// # Errors
    /// Everything that is wrong with it, in its place.
    pub fn load(path: &Path) -> Result<Self, Problems> {
        let file = path.display().to_string();
        Self::parse(&file, &read_text(path, &file)?)
    }

    /// Checks the text of a list.
    ///
    /// # Errors
    /// Everything that is wrong with it, with `file` as its name.
    pub fn parse(file: &str, text: &str) -> Result<Self, Problems> {
        let list: Self = toml::from_str(text).map_err(|e| Problem::from_toml(file, text, &e))?;
        let wrong = list.wrong();
        let problem = |(bytes, message, remedy): (_, String, &str)| Problem::at(file, text, bytes, message, remedy);
        Problems::none_or(wrong.into_iter().map(problem).collect())?;
        Ok(list)
    }

    fn wrong(&self) -> Vec<(std::ops::Range<usize>, String, &'static str)> {
        let mut wrong = Vec::new();
        if self.weakness.is_empty() {
            wrong.push((self.weakness.bytes(), "no weakness".to_owned(), "add a `[[weakness]]`"));
        }
        for (i, of) in self.weakness.iter().enumerate() {
            let name = of.name.as_str();
            if self.weakness.iter().take(i).any(|before| before.name.as_str() == name) {
                wrong.push((of.name.bytes(), format!("weakness {name} is there twice"), "give each its own name"));
            }
            if of.find.is_empty() || of.find.contains(&Outcome::Invalid) {
                let remedy = "name classes such as \"UNSAFE\"; what is INVALID shows nothing";
                wrong.push((of.find.bytes(), "no class that can be found".to_owned(), remedy));
            }
        }
        wrong
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::find_root;

    const TEXT: &str = "[[weakness]]\nname = \"a\"\nscenario = \"nominal\"\nalphabet = \"path\"\n\
                        waive = \"boundary.freshness\"\nfind = [\"UNSAFE\"]\n\
                        [[weakness]]\nname = \"b\"\nscenario = \"nominal\"\nalphabet = \"path\"\n\
                        waive = \"guards.lease\"\nfind = [\"LATE\"]\n";

    #[test]
    fn the_shipped_list_is_read() {
        let root = find_root(Path::new(env!("CARGO_MANIFEST_DIR"))).unwrap();
        assert!(!Weaknesses::load(&root.join("scenarios/weaknesses/checks.toml")).unwrap().weakness.is_empty());
    }

    #[test]
    fn a_list_that_makes_no_sense_is_refused_in_its_place() {
        assert_eq!(Weaknesses::parse("w.toml", TEXT).unwrap().weakness.len(), 2);
        for (wrong, with, message, marked) in [
            ("name = \"b\"", "name = \"a\"", "weakness a is there twice", "\"a\""),
            ("[\"LATE\"]", "[]", "no class that can be found", "[]"),
            ("[\"LATE\"]", "[\"INVALID\"]", "no class that can be found", "[\"INVALID\"]"),
            (
                "guards.lease",
                "guards.leash",
                "no check `guards.leash`; there are: boundary.freshness",
                "\"guards.leash\"",
            ),
        ] {
            let problems = Weaknesses::parse("w.toml", &TEXT.replace(wrong, with)).unwrap_err();
            let problem = &problems.all()[0];
            assert!(problem.message().starts_with(message), "{}", problem.message());
            assert_eq!(problem.marked(), Some(marked));
        }
    }
}
