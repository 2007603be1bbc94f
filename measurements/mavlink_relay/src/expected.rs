//! The required classes, as they were stated before the first run: `expected.toml`.

use serde::{Deserialize, Serialize};

use crate::attack::{Attack, Link};
use crate::class::Required;

/// The committed table.
const TABLE: &str = include_str!("../expected.toml");

/// Required classes of one attack on one kind of link.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cell {
    /// Counts of the attacker's messages.
    pub attack: Required,
    /// Counts of the true sender's messages after the first of these.
    pub honest: Required,
    /// Section of the published rules, and its content in short.
    pub rule: String,
}

/// One attack.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// The attack.
    pub name: Attack,
    /// The attack in a line.
    pub does: String,
    /// On an unsigned link.
    pub unsigned: Cell,
    /// On a signed link.
    pub signed: Cell,
}

impl Row {
    /// The classes on this kind of link.
    pub fn cell(&self, link: Link) -> &Cell {
        match link {
            Link::Unsigned => &self.unsigned,
            Link::Signed => &self.signed,
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    attack: Vec<Row>,
}

/// All rows, in the order of the file.
///
/// # Errors
/// A mistake in the table, with its line.
pub fn rows() -> Result<Vec<Row>, toml::de::Error> {
    toml::from_str::<Table>(TABLE).map(|table| table.attack)
}
