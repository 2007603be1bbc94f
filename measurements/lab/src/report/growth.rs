//! Cost of the twin by its size: the object that `lab growth` prints, and its table.

use evidence::SCHEMA_VERSION;
use results::report::new_table;
use serde::Serialize;

use results::report::Spread;

/// The dimension that grows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Grown {
    /// Objects in view of the unit.
    Objects,
    /// Units with their own body, perception and autonomy, at one gateway.
    Platforms,
    /// Units, each with a gateway and its own operator.
    Abreast,
}

impl Grown {
    fn name(self) -> &'static str {
        match self {
            Grown::Objects => "objects",
            Grown::Platforms => "platforms at one gateway",
            Grown::Abreast => "platforms abreast",
        }
    }
}

/// The line that is nearest to the rows of a kind: least squares of the distances, each in proportion to its row.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Fit {
    /// The dimension that grows.
    pub of: Grown,
    /// Fixed cost, CPU microseconds of a simulated second.
    pub fixed_us: f64,
    /// Cost of each.
    pub each_us: f64,
    /// Largest distance of a row from the line, as a share of its cost.
    pub off: f64,
}

impl Fit {
    /// None of fewer than three rows: a line goes through any two.
    fn fit_rows(of: Grown, rows: &[(f64, f64)]) -> Option<Fit> {
        let sum = |term: fn(f64, f64) -> f64| rows.iter().map(|(n, us)| term(*n, *us) / (us * us)).sum::<f64>();
        let (w, n, nn) = (sum(|_, _| 1.0), sum(|n, _| n), sum(|n, _| n * n));
        let (us, n_us) = (sum(|_, us| us), sum(|n, us| n * us));
        let spread = w * nn - n * n;
        if rows.len() < 3 || spread <= 0.0 || !spread.is_finite() {
            return None;
        }
        let (fixed_us, each_us) = ((nn * us - n * n_us) / spread, (w * n_us - n * us) / spread);
        let off = rows.iter().map(|(n, us)| ((fixed_us + each_us * n) / us - 1.0).abs());
        Some(Fit { of, fixed_us, each_us, off: off.fold(0.0, f64::max) })
    }
}

/// One number of them.
#[derive(Clone, Debug, Serialize)]
pub struct GrowthRow {
    /// The dimension that grows.
    pub of: Grown,
    /// Number of them.
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
    /// A line through the rows of each kind.
    pub fits: Vec<Fit>,
}

impl Growth {
    /// Growth of these rows.
    pub fn new(seed: u64, trials: u64, rows: Vec<GrowthRow>) -> Self {
        let fit = |grown: Grown| {
            let own = rows.iter().filter(|row| row.of == grown).map(|row| (row.n as f64, row.us.median));
            Fit::fit_rows(grown, &own.collect::<Vec<_>>())
        };
        let fits = [Grown::Objects, Grown::Platforms, Grown::Abreast].into_iter().filter_map(fit).collect();
        Self { schema_version: SCHEMA_VERSION, seed, trials, rows, fits }
    }

    /// Cost of a row over linear growth from the first of its kind; and the cost of one more since the row before.
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
            row.of.name().to_owned(),
            row.n.to_string(),
            row.tracks.to_string(),
            row.us.text(0),
            format!("{ratio:.2}"),
            each.map_or_else(|| "-".to_owned(), |each| format!("{each:.0}")),
        ]);
    }
    let mut text = format!(
        "nominal, seed {}, {} trials a round\n{table}\nlinear: n times the first row of its kind, what is there anyway included.\n",
        growth.seed, growth.trials
    );
    for Fit { of, fixed_us, each_us, off } in &growth.fits {
        let (name, off) = (of.name(), off * 100.0);
        text.push_str(&format!(
            "{name}: {fixed_us:.0} us and {each_us:.0} each; no row is off that by more than {off:.0} %\n"
        ));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values that are on no line are off the fit.
    #[test]
    fn exact_line_is_fitted_exactly() {
        let straight: Vec<_> = [1.0, 2.0, 4.0, 64.0].map(|n| (n, 100.0 + 7.0 * n)).to_vec();
        let fit = Fit::fit_rows(Grown::Objects, &straight).unwrap();
        assert!((fit.fixed_us - 100.0).abs() < 1e-6 && (fit.each_us - 7.0).abs() < 1e-6 && fit.off < 1e-9, "{fit:?}");
        let square: Vec<_> = [1.0, 2.0, 4.0, 64.0].map(|n| (n, n * n)).to_vec();
        assert!(Fit::fit_rows(Grown::Objects, &square).unwrap().off > 0.5);
        assert_eq!(Fit::fit_rows(Grown::Objects, &straight[..2]), None);
    }
}
