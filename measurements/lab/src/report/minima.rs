//! Minimal cases of findings, as an object and as a table.

use std::collections::BTreeMap;

use results::report::new_table;
use scenario::Weakness;
use search::{Cause, SearchConfig, Shrunk};
use serde::Serialize;

use results::report::Spread;

/// The object of `lab search --shrink N --json`.
#[derive(Clone, Debug, Serialize)]
pub struct MinimaObject {
    /// Version of this object.
    pub schema_version: u32,
    /// Seed of each trial.
    pub seed: u64,
    /// Seeds of guided drawing, from 1.
    pub seeds: u64,
    /// Most trials of each.
    pub budget: u64,
    /// One row for each weakness and cause.
    pub rows: Vec<MinimaRow>,
}

/// The findings of one weakness with the same cause.
#[derive(Clone, Debug, Serialize)]
pub struct MinimaRow {
    /// The weakness.
    pub name: String,
    /// Class and property.
    pub cause: Cause,
    /// Findings that were shrunk.
    pub n: usize,
    /// Minimal cases and the number of findings that shrank to each, the most frequent first.
    pub minima: Vec<(String, usize)>,
    /// Actions of the most frequent.
    #[serde(rename = "letters")]
    pub actions: usize,
    /// The fewest actions with which an exhaustive search found this cause, where they are fewer than any minimal
    /// case's.
    #[serde(rename = "fewer_letters")]
    pub fewer_actions: Option<usize>,
    /// Trials that shrinking took.
    pub executions: Spread,
}

impl MinimaRow {
    /// Row of shrunk findings.
    pub fn new(
        weakness: &Weakness,
        config: &SearchConfig,
        cause: &Cause,
        shrunk: &[Shrunk],
        fewer: Option<usize>,
    ) -> Self {
        let mut counted = BTreeMap::new();
        for one in shrunk {
            *counted.entry(&one.sequence).or_insert(0_usize) += 1;
        }
        let mut minima: Vec<_> = counted.into_iter().collect();
        minima.sort_by_key(|(_, n)| std::cmp::Reverse(*n));
        Self {
            name: weakness.name.as_str().to_owned(),
            cause: cause.clone(),
            n: shrunk.len(),
            actions: minima.first().map_or(0, |(sequence, _)| sequence.actions().len()),
            minima: minima.into_iter().map(|(sequence, n)| (sequence.describe(&config.space), n)).collect(),
            fewer_actions: fewer,
            executions: Spread::from_values(shrunk.iter().map(|shrunk| shrunk.executions as f64)),
        }
    }
}

/// The table for a terminal.
pub fn minima_table(object: &MinimaObject) -> String {
    let header = ["weakness", "cause", "the same minimum", "minima", "most frequent", "actions", "executions"];
    let mut table = new_table(&header);
    for row in &object.rows {
        let (sequence, same) = row.minima.first().cloned().unwrap_or_default();
        let actions = match row.fewer_actions {
            Some(fewer) => format!("{}, fewest {fewer}", row.actions),
            None => format!("{}, none with fewer", row.actions),
        };
        table.add_row([
            row.name.clone(),
            format!("{} {}", row.cause.outcome.name(), row.cause.broken),
            format!("{same} of {}", row.n),
            row.minima.len().to_string(),
            sequence,
            actions,
            format!("{} / {} / {}", row.executions.min, row.executions.median, row.executions.max),
        ]);
    }
    format!(
        "{table}\nfirst findings of {} seeds of guided drawing, budget {} trials; executions: least, median, most.",
        object.seeds, object.budget
    )
}
