//! The plot of a curve as one SVG file: a panel a line, shares from 0 to 1 over the value.
//!
//! Detected is drawn with its interval, harmed beside it. The file stands by itself: no script, no font, no link.

use core::fmt::Write;

use super::curve::{CurveLine, CurveObject, CurvePoint};
use stats::Share;

const COLUMNS: usize = 3;
const PANEL: (f64, f64) = (320.0, 220.0);
/// Space in a panel for its labels: left, top, right, bottom.
const MARGIN: (f64, f64, f64, f64) = (40.0, 30.0, 14.0, 36.0);
const HEAD: f64 = 48.0;
/// Ratio of a range to its smallest step from which on points are drawn at equal distances.
const WIDE: f64 = 40.0;

/// The plot.
pub fn svg(curve: &CurveObject) -> String {
    let columns = COLUMNS.min(curve.lines.len().max(1));
    let rows = curve.lines.len().div_ceil(columns).max(1);
    let (width, height) = (columns as f64 * PANEL.0, rows as f64 * PANEL.1 + HEAD);
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" \
         font-size=\"10\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    label(&mut text, (12.0, 18.0), "start", &format!("{}: {}", curve.scenario, curve.title));
    let key = "blue: detected, with its exact 95 % interval; red: harmed; grey: a teammate's claims that were accepted";
    let marks = curve.watermarks.iter().fold(String::new(), |all, mark| format!("{all}; {mark}"));
    label(&mut text, (12.0, 34.0), "start", &format!("{key}{marks}"));
    for (i, line) in curve.lines.iter().enumerate() {
        let place = ((i % columns) as f64 * PANEL.0, (i / columns) as f64 * PANEL.1 + HEAD);
        panel(&mut text, place, line, &curve.unit);
    }
    text.push_str("</svg>\n");
    text
}

/// Conversion from points and shares to places on the page.
struct Frame {
    left: f64,
    top: f64,
    wide: f64,
    high: f64,
    /// Place of each point along the value's axis, from 0 to 1.
    along: Vec<f64>,
}

impl Frame {
    fn new((x, y): (f64, f64), line: &CurveLine) -> Frame {
        Frame {
            left: x + MARGIN.0,
            top: y + MARGIN.1,
            wide: PANEL.0 - MARGIN.0 - MARGIN.2,
            high: PANEL.1 - MARGIN.1 - MARGIN.3,
            along: scale_unit(&line.points.iter().map(|p| p.value).collect::<Vec<_>>()),
        }
    }

    fn x(&self, point: usize) -> f64 {
        self.left + self.wide * self.along.get(point).copied().unwrap_or(0.0)
    }

    fn y(&self, share: f64) -> f64 {
        self.top + self.high * (1.0 - share)
    }
}

/// Position of rising values between the first and the last.
fn scale_unit(values: &[f64]) -> Vec<f64> {
    let (Some(first), Some(last)) = (values.first(), values.last()) else { return Vec::new() };
    let step = values.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    let whole = last - first;
    let even = |i: usize| i as f64 / (values.len() - 1).max(1) as f64;
    let wide = whole <= 0.0 || whole / step > WIDE;
    values.iter().enumerate().map(|(i, value)| if wide { even(i) } else { (value - first) / whole }).collect()
}

fn panel(text: &mut String, place: (f64, f64), line: &CurveLine, unit: &str) {
    let frame = Frame::new(place, line);
    let title = line.cell.clone().unwrap_or_else(|| format!("policy {}", line.policy));
    label(text, (frame.left, place.1 + 20.0), "start", &title);
    for share in [0.0, 0.5, 1.0] {
        let y = frame.y(share);
        rule(text, (frame.left, y), (frame.left + frame.wide, y));
        label(text, (frame.left - 6.0, y + 3.0), "end", &format!("{share}"));
    }
    let below = frame.y(0.0) + 14.0;
    let shown = |i: usize| i.is_multiple_of(line.points.len().div_ceil(6));
    for (i, point) in line.points.iter().enumerate().filter(|(i, _)| shown(*i)) {
        label(text, (frame.x(i), below), "middle", &format!("{}", point.value));
    }
    label(text, (frame.left + frame.wide / 2.0, below + 13.0), "middle", unit);
    band(text, &frame, &line.points);
    trace(text, &frame, &line.points, "#2060c0", |point| &point.detected);
    trace(text, &frame, &line.points, "#c02020", |point| &point.harmed);
    trace(text, &frame, &line.points, "#808080", |point| &point.claims_accepted);
}

fn band(text: &mut String, frame: &Frame, points: &[CurvePoint]) {
    let upper = points.iter().enumerate().map(|(i, p)| (i, p.detected.upper_95));
    let lower = points.iter().enumerate().rev().map(|(i, p)| (i, p.detected.lower_95));
    let outline = places(upper.chain(lower).map(|(i, share)| (frame.x(i), frame.y(share))));
    write(text, format_args!("<polygon points=\"{outline}\" fill=\"#2060c0\" fill-opacity=\"0.15\"/>\n"));
}

fn trace(
    text: &mut String,
    frame: &Frame,
    points: &[CurvePoint],
    colour: &str,
    share_of: impl Fn(&CurvePoint) -> &Share,
) {
    let along = points.iter().enumerate().filter_map(|(i, p)| Some((frame.x(i), frame.y(share_of(p).share?))));
    let along: Vec<(f64, f64)> = along.collect();
    let line = places(along.iter().copied());
    write(text, format_args!("<polyline points=\"{line}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.5\"/>\n"));
    for (x, y) in along {
        write(text, format_args!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2\" fill=\"{colour}\"/>\n"));
    }
}

fn places(points: impl Iterator<Item = (f64, f64)>) -> String {
    points.map(|(x, y)| format!("{x:.1},{y:.1}")).collect::<Vec<_>>().join(" ")
}

fn rule(text: &mut String, (x1, y1): (f64, f64), (x2, y2): (f64, f64)) {
    let ends = format_args!("<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"#ddd\"/>\n");
    write(text, ends);
}

fn label(text: &mut String, (x, y): (f64, f64), anchor: &str, words: &str) {
    let words = words.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    write(text, format_args!("<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{words}</text>\n"));
}

fn write(text: &mut String, name: core::fmt::Arguments<'_>) {
    text.write_fmt(name).expect("invariant: writing to a String cannot fail");
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::super::run::LatencySummary;
    use super::super::{CurveLine, CurveObject, CurvePoint};
    use super::*;

    fn point(value: f64, hits: u64) -> CurvePoint {
        CurvePoint {
            value,
            detected: Share::new(hits, 10),
            harmed: Share::new(10 - hits, 10),
            outcomes: BTreeMap::new(),
            latency_ms: LatencySummary::default(),
            claims_accepted: Share::new(hits, 10),
            believed_m: stats::Sample::default(),
            accepted: 0,
            refused: BTreeMap::new(),
            unexpected: 0,
            distinct_decisions: 1,
        }
    }

    #[test]
    fn wide_range_has_equal_steps() {
        assert_eq!(scale_unit(&[0.0, 1.0, 4.0]), [0.0, 0.25, 1.0]);
        assert_eq!(scale_unit(&[0.1, 1.0, 100.0]), [0.0, 0.5, 1.0]);
        assert_eq!((scale_unit(&[3.0]), scale_unit(&[])), (vec![0.0], vec![]));
    }

    #[test]
    fn every_line_has_a_panel_containing_its_points() {
        let line = |cell: &str| CurveLine::new(Some(cell.to_owned()), "default", vec![point(0.1, 0), point(10.0, 10)]);
        let curve = CurveObject {
            schema_version: 1,
            scenario: "x".to_owned(),
            title: "a < b".to_owned(),
            set: "a.b".to_owned(),
            unit: "m/s".to_owned(),
            seed: 1,
            watermarks: Vec::new(),
            detector: None,
            lines: vec![line("one"), line("two"), line("three"), line("four")],
        };
        let text = svg(&curve);
        assert!(text.starts_with("<svg") && text.ends_with("</svg>\n") && text.contains("a &lt; b"), "{text}");
        assert_eq!((text.matches("<polygon").count(), text.matches("<circle").count()), (4, 24));
        assert!(text.contains("viewBox=\"0 0 960 488\""), "{text}");
        assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
    }
}
