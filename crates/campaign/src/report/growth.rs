//! What the twin costs as there is more in it: the object that `bench growth` prints, and its table.

use serde::Serialize;

use super::cost::Spread;
use super::table::new_table;

/// What there is more of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Grown {
    /// Objects in view of the unit.
    Objects,
    /// Units with body, perception and autonomy of their own.
    Platforms,
}

/// One number of them.
#[derive(Clone, Debug, Serialize)]
pub struct GrowthRow {
    /// What there is more of.
    pub of: Grown,
    /// How many.
    pub n: usize,
    /// The most tracks shown at a time.
    pub tracks: u8,
    /// CPU microseconds of a simulated second.
    pub us: Spread,
}

/// All rows.
#[derive(Clone, Debug, Serialize)]
pub struct Growth {
    /// Version of this object.
    pub schema_version: u32,
    /// First seed.
    pub seed: u64,
    /// Trials of each row in a round.
    pub trials: u64,
    /// Rows; of each kind the least first.
    pub rows: Vec<GrowthRow>,
}

impl Growth {
    /// How many times linear a row's cost is, taken from the first of its kind; and what one more costs since the row before.
    fn ratio(&self, at: usize) -> (f64, Option<f64>) {
        let row = &self.rows[at];
        let first = self.rows.iter().find(|other| other.of == row.of).unwrap_or(row);
        let linear = first.us.median * row.n as f64 / first.n as f64;
        let before = self.rows[..at].last().filter(|before| before.of == row.of);
        let each = before.map(|before| (row.us.median - before.us.median) / (row.n - before.n) as f64);
        (row.us.median / linear, each)
    }
}

/// The table for a terminal.
pub fn growth_table(growth: &Growth) -> String {
    let columns =
        ["more", "n", "tracks", "CPU us a simulated s (least / median / most)", "times linear", "each more, us"];
    let mut table = new_table(&columns);
    for (at, row) in growth.rows.iter().enumerate() {
        let (ratio, each) = growth.ratio(at);
        table.add_row([
            match row.of {
                Grown::Objects => "objects".to_owned(),
                Grown::Platforms => "platforms".to_owned(),
            },
            row.n.to_string(),
            row.tracks.to_string(),
            row.us.text(0),
            format!("{ratio:.2}"),
            each.map_or_else(|| "-".to_owned(), |each| format!("{each:.0}")),
        ]);
    }
    format!(
        "nominal, seed {}, {} trials a round\n{table}\nlinear: n times the first row of its kind, what is there anyway included.\n",
        growth.seed, growth.trials
    )
}
