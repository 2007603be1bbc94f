//! Distribution of the values of several samples: each as the share of it that does not exceed a value, with marks for
//! figures reported elsewhere.

use super::Table;
use super::drawing::{Anchor, Drawing};

const WIDE: f64 = 900.0;
const HIGH: f64 = 300.0;
/// Space for labels: left, top, right, bottom.
const MARGIN: (f64, f64, f64, f64) = (52.0, 16.0, 290.0, 40.0);

/// One sample.
#[derive(Clone, Debug)]
pub struct Steps {
    /// Its name.
    pub name: String,
    /// Its values, in any order, milliseconds.
    pub values: Vec<f64>,
}

/// A value reported elsewhere.
#[derive(Clone, Debug)]
pub struct Mark {
    /// Name.
    pub name: String,
    /// Position, milliseconds.
    pub at: f64,
}

/// The drawing; none without a value.
pub fn ecdf(samples: &[Steps], marks: &[Mark]) -> Option<Drawing> {
    let most = samples.iter().flat_map(|s| &s.values).chain(marks.iter().map(|m| &m.at)).copied().fold(0.0, f64::max);
    if samples.iter().all(|s| s.values.is_empty()) || most <= 0.0 {
        return None;
    }
    let mut drawing = Drawing::new(WIDE, HIGH);
    let (left, top, right, bottom) = MARGIN;
    let (wide, high) = (WIDE - left - right, HIGH - top - bottom);
    let step = super::curve::round_step(most / 6.0);
    let end = (most / step).ceil() * step;
    let x = |value: f64| left + value / end * wide;
    let y = |share: f64| top + (1.0 - share) * high;
    for share in [0.0, 0.25, 0.5, 0.75, 0.95, 1.0] {
        drawing.line("grid", (left, y(share)), (left + wide, y(share)));
        drawing.words("faint", Anchor::End, (left - 6.0, y(share) + 4.0), &format!("{:.0} %", share * 100.0));
    }
    for i in 0..=(end / step).round() as u32 {
        let value = f64::from(i) * step;
        drawing.words("faint", Anchor::Middle, (x(value), y(0.0) + 16.0), &format!("{value}"));
    }
    drawing.words(
        "faint",
        Anchor::Middle,
        (left + wide / 2.0, HIGH - 6.0),
        "milliseconds from the injection's receipt",
    );
    for (i, mark) in marks.iter().enumerate() {
        drawing.line("reported", (x(mark.at), y(1.0)), (x(mark.at), y(0.0)));
        let line = y(1.0) + 140.0 + i as f64 * 18.0;
        drawing.line("reported", (left + wide + 20.0, line - 12.0), (left + wide + 20.0, line + 2.0));
        drawing.words("label", Anchor::Start, (left + wide + 36.0, line), &mark.name);
    }
    for (i, sample) in samples.iter().filter(|s| !s.values.is_empty()).enumerate() {
        let class = format!("line-{}", i % 3);
        let points: Vec<_> = stairs(&sample.values).into_iter().map(|(v, share)| (x(v), y(share))).collect();
        drawing.path(&class, &points);
        let line = y(1.0) + 10.0 + i as f64 * 18.0;
        drawing.line(&class, (left + wide + 10.0, line - 4.0), (left + wide + 30.0, line - 4.0));
        drawing.words("label", Anchor::Start, (left + wide + 36.0, line), &sample.name);
    }
    Some(drawing)
}

/// The corners of the share that does not exceed a value.
fn stairs(values: &[f64]) -> Vec<(f64, f64)> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len() as f64;
    sorted.iter().enumerate().flat_map(|(i, v)| [(*v, i as f64 / n), (*v, (i + 1) as f64 / n)]).collect()
}

/// Quantiles of each sample, and the marks.
pub(crate) fn table(samples: &[Steps], marks: &[Mark]) -> Table {
    let mut table = Table::new(&["sample", "n", "least", "median", "p95", "greatest"]);
    for sample in samples {
        let mut sorted = sample.values.clone();
        sorted.sort_by(f64::total_cmp);
        let quantile = |share: f64| {
            let rank = (share * sorted.len() as f64).ceil().max(1.0) as usize;
            sorted.get(rank - 1).map_or_else(|| "-".to_owned(), |v| format!("{v:.1}"))
        };
        let cells = [
            sample.name.clone(),
            sorted.len().to_string(),
            quantile(0.0),
            quantile(0.5),
            quantile(0.95),
            quantile(1.0),
        ];
        table.rows.push(cells.to_vec());
    }
    for mark in marks {
        let mut cells = vec![mark.name.clone(), "-".to_owned()];
        cells.extend(std::iter::repeat_n(format!("{:.1}", mark.at), 4));
        table.rows.push(cells);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stairs_rise_from_nothing_to_all() {
        assert_eq!(stairs(&[3.0, 1.0]), [(1.0, 0.0), (1.0, 0.5), (3.0, 0.5), (3.0, 1.0)]);
    }

    #[test]
    fn without_a_value_there_is_no_drawing() {
        let empty = Steps { name: "x".to_owned(), values: Vec::new() };
        assert!(ecdf(&[empty], &[]).is_none());
    }

    #[test]
    fn quantiles_are_values_of_the_sample() {
        let sample = Steps { name: "x".to_owned(), values: (1..=20).map(f64::from).collect() };
        assert_eq!(table(&[sample], &[]).rows[0], ["x", "20", "1.0", "10.0", "19.0", "20.0"]);
    }
}
