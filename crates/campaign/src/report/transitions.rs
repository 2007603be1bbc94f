//! The table of processes that end, hang or are slow at a change of mode: counts only.

use std::collections::BTreeMap;

use serde::Serialize;

use super::table::new_table;
use crate::stats::{LEVEL, rate_upper};
use crate::trial::Outcome;

/// One process with one ending, at every change.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TransitionRow {
    /// Process and ending, `gateway/hang`.
    pub pair: String,
    /// By change of mode.
    pub changes: BTreeMap<String, TransitionCell>,
}

/// One process with one ending at one change.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TransitionCell {
    /// Trials.
    pub n: u64,
    /// Of these, those in which everything owed came in time and nothing broke.
    pub kept: u64,
    /// Classes.
    pub outcomes: BTreeMap<Outcome, u64>,
}

impl TransitionRow {
    /// Counts a trial.
    pub fn count(&mut self, change: &str, kept: bool, outcome: Outcome) {
        let cell = self.changes.entry(change.to_owned()).or_default();
        cell.n += 1;
        cell.kept += u64::from(kept);
        *cell.outcomes.entry(outcome).or_insert(0) += 1;
    }
}

/// The table for a terminal.
pub fn transition_table(rows: &[TransitionRow]) -> String {
    let mut changes: Vec<&str> = Vec::new();
    for change in rows.iter().flat_map(|row| row.changes.keys()) {
        if !changes.contains(&change.as_str()) {
            changes.push(change);
        }
    }
    let mut table = new_table(&[&["process"][..], &changes].concat());
    for row in rows {
        let cell = |change: &&str| row.changes.get(*change).map_or_else(String::new, told);
        table.add_row(std::iter::once(row.pair.clone()).chain(changes.iter().map(cell)));
    }
    let cells = || rows.iter().flat_map(|row| row.changes.values());
    let (n, kept): (u64, u64) = (cells().map(|c| c.n).sum(), cells().map(|c| c.kept).sum());
    let upper = rate_upper(n - kept, n, LEVEL) * 100.0;
    format!(
        "{table}\nAs owed / trials, and the classes. {kept} of {n} as owed: not as owed below {upper:.2} % (one-sided 95 %, \
         all cells together).\n"
    )
}

fn told(cell: &TransitionCell) -> String {
    let classes: Vec<String> = cell.outcomes.iter().map(|(class, n)| format!("{} {n}", class.name())).collect();
    format!("{}/{} {}", cell.kept, cell.n, classes.join(", "))
}
