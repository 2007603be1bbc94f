//! Plot of shares with their intervals over one value.

use super::Table;
use super::drawing::{Anchor, Drawing};

const WIDE: f64 = 900.0;
const HIGH: f64 = 280.0;
/// Space for labels: left, top, right, bottom.
const MARGIN: (f64, f64, f64, f64) = (52.0, 16.0, 180.0, 40.0);
/// Ratio of a range to its smallest step from which on points are drawn at equal distances.
const RANGE: f64 = 40.0;
/// Most labels along the value's axis.
const LABELS: usize = 8;

/// A share at a value.
#[derive(Clone, Copy, Debug)]
pub struct SharePoint {
    /// The value.
    pub value: f64,
    /// The observed share; `None` without trials.
    pub share: Option<f64>,
    /// Ends of its interval.
    pub interval: (f64, f64),
}

/// A line of shares.
#[derive(Clone, Debug)]
pub struct Series {
    /// Name of the share.
    pub name: String,
    /// Its points, in order of their values; the same values in every line.
    pub points: Vec<SharePoint>,
}

/// The drawing; none without a point.
pub fn series(lines: &[Series], unit: &str) -> Option<Drawing> {
    let values: Vec<f64> = lines.first()?.points.iter().map(|p| p.value).collect();
    let positions = scale_unit(&values);
    let mut drawing = Drawing::new(WIDE, HIGH);
    let (left, top, right, bottom) = MARGIN;
    let (wide, high) = (WIDE - left - right, HIGH - top - bottom);
    let x = |i: usize| left + positions.get(i).copied().unwrap_or_default() * wide;
    let y = |share: f64| top + (1.0 - share) * high;
    for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
        drawing.line("grid", (left, y(share)), (left + wide, y(share)));
        drawing.words("faint", Anchor::End, (left - 6.0, y(share) + 4.0), &format!("{:.0} %", share * 100.0));
    }
    for (i, value) in values.iter().enumerate().filter(|(i, _)| i.is_multiple_of(values.len().div_ceil(LABELS))) {
        drawing.words("faint", Anchor::Middle, (x(i), y(0.0) + 16.0), &format!("{value}"));
    }
    drawing.words("faint", Anchor::Middle, (left + wide / 2.0, HIGH - 6.0), unit);
    for (k, line) in lines.iter().enumerate() {
        let (class, veil) = (format!("line-{}", k % 3), format!("band-{}", k % 3));
        let tried = || line.points.iter().enumerate().filter(|(_, p)| p.share.is_some());
        let upper = tried().map(|(i, p)| (x(i), y(p.interval.1)));
        let lower = tried().rev().map(|(i, p)| (x(i), y(p.interval.0)));
        drawing.area(&veil, &upper.chain(lower).collect::<Vec<_>>());
        let places: Vec<_> = tried().filter_map(|(i, p)| Some((x(i), y(p.share?)))).collect();
        drawing.path(&class, &places);
        let row = y(1.0) + 10.0 + k as f64 * 18.0;
        drawing.line(&class, (left + wide + 10.0, row - 4.0), (left + wide + 30.0, row - 4.0));
        drawing.words("label", Anchor::Start, (left + wide + 36.0, row), &line.name);
    }
    (!values.is_empty()).then_some(drawing)
}

/// The curves as a table: a row a value, a column a line.
pub(crate) fn table(lines: &[Series], unit: &str) -> Table {
    let names: Vec<&str> = std::iter::once(unit).chain(lines.iter().map(|l| l.name.as_str())).collect();
    let mut table = Table::new(&names);
    let Some(first) = lines.first() else { return table };
    for (i, at) in first.points.iter().enumerate() {
        let shares = lines.iter().map(|line| line.points.get(i).map_or_else(|| "-".to_owned(), point_title));
        table.rows.push(std::iter::once(at.value.to_string()).chain(shares).collect());
    }
    table
}

fn point_title(point: &SharePoint) -> String {
    let (low, high) = point.interval;
    point.share.map_or_else(|| "-".to_owned(), |share| format!("{share:.3} ({low:.3} to {high:.3})"))
}

/// Position of rising values between the first and the last, 0 to 1.
fn scale_unit(values: &[f64]) -> Vec<f64> {
    let (Some(first), Some(last)) = (values.first(), values.last()) else { return Vec::new() };
    let step = values.windows(2).filter_map(|pair| Some(pair.get(1)? - pair.first()?)).fold(f64::INFINITY, f64::min);
    let whole = last - first;
    let even = |i: usize| i as f64 / (values.len() - 1).max(1) as f64;
    let wide = whole <= 0.0 || whole / step > RANGE;
    values.iter().enumerate().map(|(i, value)| if wide { even(i) } else { (value - first) / whole }).collect()
}

/// The next step of 1, 2 or 5 times a power of ten that is no smaller.
pub(super) fn round_step(least: f64) -> f64 {
    let power = libm::pow(10.0, libm::floor(libm::log10(least)));
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * power).find(|step| *step >= least).unwrap_or(power * 10.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_range_has_equal_steps() {
        assert_eq!(scale_unit(&[0.0, 1.0, 4.0]), [0.0, 0.25, 1.0]);
        assert_eq!(scale_unit(&[0.1, 1.0, 100.0]), [0.0, 0.5, 1.0]);
        assert_eq!((scale_unit(&[3.0]), scale_unit(&[])), (vec![0.0], vec![]));
    }

    #[test]
    fn steps_are_round() {
        assert_eq!([round_step(0.9), round_step(1.1), round_step(3.0), round_step(60.0)], [1.0, 2.0, 5.0, 100.0]);
    }

    #[test]
    fn what_was_not_tried_is_no_point() {
        let none = SharePoint { value: 1.0, share: None, interval: (0.0, 1.0) };
        let line = Series { name: "detected".to_owned(), points: vec![none] };
        let text = series(std::slice::from_ref(&line), "s").expect("a drawing").inline("x");
        assert!(text.contains("<polyline class=\"line-0\" points=\"\"/>"), "{text}");
        assert_eq!(table(&[line], "s").rows, [["1", "-"]]);
    }
}
