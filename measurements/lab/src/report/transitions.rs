//! The table of processes that end, hang or are slow at a change of mode: counts only.

use std::collections::BTreeMap;

use evidence::trial::Outcome;
use results::report::new_table;
use serde::Serialize;
use stats::{LEVEL, rate_upper};

/// One process with one ending, at every change.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TransitionRow {
    /// Process and ending, `gateway/hang`.
    pub pair: String,
    /// Counts by change of mode.
    pub changes: BTreeMap<String, TransitionCell>,
}

/// One process with one ending at one change.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TransitionCell {
    /// Trials.
    pub n: u64,
    /// Number of these in which every required response came in time and nothing broke.
    pub kept: u64,
    /// Trials in which no response was required, because there was no fault to respond to, and nothing broke.
    pub nothing_owed: u64,
    /// Classes.
    pub outcomes: BTreeMap<Outcome, u64>,
}

impl TransitionRow {
    /// Counts a trial: `owed` if a response was required, `kept` if all of that came in time and nothing broke.
    pub fn count(&mut self, change: &str, expected: bool, kept: bool, outcome: Outcome) {
        let cell = self.changes.entry(change.to_owned()).or_default();
        cell.n += 1;
        cell.kept += u64::from(expected && kept);
        cell.nothing_owed += u64::from(!expected && kept);
        *cell.outcomes.entry(outcome).or_insert(0) += 1;
    }
}

impl TransitionCell {
    /// Trials in which a response was required, or a property broke.
    fn of_note(&self) -> u64 {
        self.n - self.nothing_owed
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
        let cell = |change: &&str| row.changes.get(*change).map_or_else(String::new, describe_cell);
        table.add_row(std::iter::once(row.pair.clone()).chain(changes.iter().map(cell)));
    }
    let cells = || rows.iter().flat_map(|row| row.changes.values());
    let sum = |of: fn(&TransitionCell) -> u64| -> u64 { cells().map(of).sum() };
    let (n, kept, nothing) = (sum(TransitionCell::of_note), sum(|c| c.kept), sum(|c| c.nothing_owed));
    let upper = rate_upper(n - kept, n, LEVEL) * 100.0;
    format!(
        "{table}\nAs owed / trials, and the classes. {kept} of {n} as owed: not as owed below {upper:.2} % (one-sided 95 %, \
         all cells together). In {nothing} more trials nothing was owed, and nothing broke.\n"
    )
}

fn describe_cell(cell: &TransitionCell) -> String {
    let classes: Vec<String> = cell.outcomes.iter().map(|(class, n)| format!("{} {n}", class.name())).collect();
    let empty_text = match cell.nothing_owed {
        0 => String::new(),
        n if n == cell.n => return format!("nothing owed, {}", classes.join(", ")),
        n => format!(" ({n} nothing owed)"),
    };
    format!("{}/{}{empty_text} {}", cell.kept, cell.of_note(), classes.join(", "))
}
