//! The list of published figures: name, command, sample, claim and place of each.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use serde::Deserialize;

/// Name of the list in its folder.
pub const FILE: &str = "records.toml";

/// Headings of docs/results.md, in its order.
pub const PARTS: [&str; 14] = [
    "Twin",
    "Rendered",
    "Live",
    "Guests",
    "Buses",
    "Worlds",
    "Perception",
    "Search",
    "Evidence",
    "Confinement",
    "Faults",
    "Speed",
    "Mutants",
    "Host",
];

/// The list.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct List {
    /// First seed of every command that names none.
    pub seed: u64,
    /// Figures that a command takes.
    #[serde(default, rename = "record")]
    pub records: Vec<Entry>,
    /// Figures of other pages that no command of the list takes.
    #[serde(default)]
    pub older: Vec<Older>,
}

/// One published figure, or several of one measurement.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// Name of its file, without `.json`.
    pub name: String,
    /// Heading of the page, of [`PARTS`].
    pub part: String,
    /// Quantity.
    pub what: String,
    /// Commands, run by a shell in the repository.
    pub run: Vec<String>,
    /// Tier: `hour` or `long`.
    pub tier: Tier,
    /// Minutes on two idle cores.
    pub minutes: f64,
    /// Requirements beyond the two programs.
    #[serde(default)]
    pub needs: Vec<String>,
    /// Sentence with pointers into the results.
    pub figure: String,
    /// Sample and interval, likewise.
    pub sample: String,
    /// True if another run on the same architecture gives the same figure to the digit; else its claims are its tolerance.
    #[serde(default)]
    pub repeats: bool,
    /// Comparisons that must be true for the published claim to stand: a pointer, an operator and a number.
    #[serde(default)]
    pub holds: Vec<String>,
    /// The figure published before, with its commit where known.
    #[serde(default)]
    pub before: String,
    /// Explanation of a difference, or another remark.
    #[serde(default)]
    pub note: String,
    /// Regular expressions with one group, by the name of the number in a command's text output.
    #[serde(default)]
    pub take: std::collections::BTreeMap<String, String>,
    /// Sentences of other pages.
    #[serde(default)]
    pub quotes: Vec<Quote>,
}

/// Share of the measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Tier {
    /// With all others of this tier within an hour.
    Hour,
    /// Longer.
    Long,
}

/// A sentence of another page that carries a figure.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quote {
    /// The page, below the repository.
    pub page: String,
    /// The sentence, with pointers. It begins with text.
    pub text: String,
}

/// Figures in a section of a page that keep the date of their measurement.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Older {
    /// The page, below the repository.
    pub page: String,
    /// The heading's line.
    pub section: String,
    /// The command or the file that the figures are of.
    pub command: String,
    /// The commit at which they were measured, or a hyphen.
    pub commit: String,
    /// The reason for which no record takes them.
    pub why: String,
}

/// The list in this folder.
///
/// # Errors
/// The file cannot be read, is no list, or has two records of one name, an unknown heading or a record without a command.
pub fn read(folder: &Path) -> Result<List, String> {
    let path = folder.join(FILE);
    let text = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    let list: List = toml::from_str(&text).map_err(|error| format!("{FILE}: {error}"))?;
    let mut names = BTreeSet::new();
    for entry in &list.records {
        let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        let fault = if entry.name.is_empty() || !entry.name.chars().all(plain) {
            "a name of lower-case letters, digits and hyphens is expected"
        } else if !names.insert(&entry.name) {
            "the name is taken by another record"
        } else if !PARTS.contains(&entry.part.as_str()) {
            "its part is no heading of the page"
        } else if entry.run.is_empty() {
            "it has no command"
        } else {
            continue;
        };
        return Err(format!("{FILE}, {}: {fault}", entry.name));
    }
    Ok(list)
}
