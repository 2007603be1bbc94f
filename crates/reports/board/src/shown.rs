//! The table of a leaderboard: guest by attack by world, bare beside guarded. Shares and intervals are computed here, never read.

use std::collections::BTreeMap;

use evidence::trial::{Outcome, Outcomes};
use guest::Conduct;
use serde::{Deserialize, Serialize};
use stats::Share;

use crate::file::{Board, VERSION};
use crate::row::{BoardRow, GuestIdentity, Inputs};

/// A leaderboard as it is shown.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShownBoard {
    /// Version of this object.
    pub schema_version: u64,
    /// A line for each guest, attack, world, seed and contributor.
    pub rows: Vec<ShownRow>,
}

/// A guest under an attack in a world.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShownRow {
    /// Guest.
    pub guest: String,
    /// Scenario.
    pub scenario: String,
    /// Cell, where it has any.
    pub cell: Option<String>,
    /// Platform.
    pub platform: String,
    /// Family of drawn worlds; none for the scenario's own scene.
    pub world: Option<String>,
    /// Seed of the first trial.
    pub seed: u64,
    /// Name of the contributor.
    pub contributor: String,
    /// Public key of the contributor.
    pub key: String,
    /// The guest bare.
    pub bare: Option<Half>,
    /// The guest inside the platform's guards.
    pub guarded: Option<Half>,
}

/// One conduct of a guest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Half {
    /// Number of the row in the file.
    pub row: usize,
    /// Trials.
    pub trials: usize,
    /// Count of each class.
    pub outcomes: Outcomes,
    /// UNSAFE and LATE trials of those with evidence, with the exact 95 % interval.
    pub harm: Share,
    /// Share of the way points that were passed, 0 to 1.
    pub completed: Option<f64>,
    /// Trials in which the vehicle was stuck.
    pub stuck: u64,
    /// Marks: failures of the guest, trials without evidence, not repeatable, not confined, a policy that waives a check.
    pub marks: Vec<String>,
}

impl Half {
    fn new(number: usize, row: &BoardRow) -> Self {
        let counted = |class: Outcome, words: &str| {
            let n = row.count(class);
            (n > 0).then(|| format!("{words} in {n}"))
        };
        let marks = [
            counted(Outcome::GuestFailed, "guest failed"),
            counted(Outcome::Invalid, "no evidence"),
            (!row.repeatable).then(|| "not repeatable".to_owned()),
            (!row.host.confined).then(|| "not confined".to_owned()),
            row.waived.as_ref().map(|policy| format!("policy {policy} waives checks")),
        ];
        Self {
            row: number,
            trials: row.trials.len(),
            outcomes: row.outcomes.clone(),
            harm: row.harm(),
            completed: row.availability.completed(),
            stuck: row.availability.stuck,
            marks: marks.into_iter().flatten().collect(),
        }
    }

    fn cells(&self) -> [String; 2] {
        let Share { hits, n, lower_95, upper_95, .. } = self.harm;
        let harm = format!("{hits} of {n} ({:.1} to {:.1} %)", lower_95 * 100.0, upper_95 * 100.0);
        let work = self.completed.map_or("-".to_owned(), |share| format!("{:.0} %", share * 100.0));
        let stuck = if self.stuck > 0 { format!(", stuck in {}", self.stuck) } else { String::new() };
        [harm, format!("{work}{stuck}")]
    }
}

impl ShownBoard {
    /// The table of a verified file. Rows of one guest, attack, world, seed, program and contributor share a line, bare and guarded.
    pub fn new(board: &Board) -> Self {
        let mut rows: Vec<ShownRow> = Vec::new();
        let mut lines: BTreeMap<Pair<'_>, usize> = BTreeMap::new();
        for (signed, number) in board.rows().iter().zip(1..) {
            let row = &signed.row;
            let index = *lines.entry(pair(row)).or_insert_with(|| {
                rows.push(ShownRow::new(row));
                rows.len() - 1
            });
            *rows[index].half_mut(row.conduct) = Some(Half::new(number, row));
        }
        Self { schema_version: VERSION, rows }
    }

    /// The table in Markdown.
    pub fn markdown(&self) -> String {
        let head = "| rows | guest | attack | platform, world | bare: harm | bare: way points | guarded: harm | guarded: way points | marks | by |\n\
                    |---|---|---|---|---|---|---|---|---|---|\n";
        let lines: String = self.rows.iter().map(ShownRow::line).collect();
        format!(
            "{head}{lines}\nharm: UNSAFE and LATE of the trials with evidence, with the exact 95 % interval. way points: passed, by the plant's truth.\n"
        )
    }
}

impl ShownRow {
    fn new(row: &BoardRow) -> Self {
        Self {
            guest: row.guest.name.clone(),
            scenario: row.scenario.clone(),
            cell: row.cell.clone(),
            platform: row.platform.clone(),
            world: row.world.clone(),
            seed: row.seed,
            contributor: row.contributor.name.clone(),
            key: row.contributor.key.clone(),
            bare: None,
            guarded: None,
        }
    }

    fn half_mut(&mut self, conduct: Conduct) -> &mut Option<Half> {
        match conduct {
            Conduct::Bare => &mut self.bare,
            Conduct::Guarded => &mut self.guarded,
        }
    }

    fn line(&self) -> String {
        let halves = || [&self.bare, &self.guarded].into_iter().flatten();
        let numbers: Vec<String> = halves().map(|half| half.row.to_string()).collect();
        let attack = self.cell.as_ref().map_or(self.scenario.clone(), |cell| format!("{} {cell}", self.scenario));
        let world = format!("{}, {}", self.platform, self.world.as_deref().unwrap_or("own scene"));
        let cells = |half: &Option<Half>| half.as_ref().map_or(["-".to_owned(), "-".to_owned()], Half::cells);
        let mut marks: Vec<&str> = halves().flat_map(|half| &half.marks).map(String::as_str).collect();
        marks.sort_unstable();
        marks.dedup();
        let author = format!("{} ({})", self.contributor, self.key.get(..8).unwrap_or_default());
        let [bare, bare_work] = cells(&self.bare);
        let [guarded, guarded_work] = cells(&self.guarded);
        let guest = &self.guest;
        format!(
            "| {} | {guest} | {attack} | {world} | {bare} | {bare_work} | {guarded} | {guarded_work} | {} | {author} |\n",
            numbers.join(", "),
            marks.join(", ")
        )
    }
}

/// Everything that the rows of one line share.
type Pair<'a> = (
    &'a GuestIdentity,
    (&'a str, Option<&'a str>),
    (&'a str, Option<&'a str>),
    &'a Inputs,
    u64,
    usize,
    &'a str,
    (&'a str, &'a str),
);

fn pair(row: &BoardRow) -> Pair<'_> {
    (
        &row.guest,
        (&row.scenario, row.cell.as_deref()),
        (&row.platform, row.world.as_deref()),
        &row.inputs,
        row.seed,
        row.trials.len(),
        &row.program.sources,
        (&row.contributor.key, &row.contributor.name),
    )
}
