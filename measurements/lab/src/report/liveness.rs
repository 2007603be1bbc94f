//! The operating curve of detectors of silence: the object that `lab liveness` prints, its table and its plot.

use core::fmt::Write;

use results::report::new_table;
use serde::Serialize;
use stats::events_upper;

use crate::liveness::{Detector, LEASE_MS, Outcome, Weather};

/// Loss and false trips an hour that the platform is made for (`docs/reference/bounds.md`).
const BUDGET: (f64, f64) = (0.02, 0.1);

/// One detector in one weather, with the bound on its rate.
#[derive(Clone, Debug, Serialize)]
pub struct LivenessRow {
    /// The measurement.
    #[serde(flatten)]
    pub outcome: Outcome,
    /// Name of the detector.
    pub name: String,
    /// False trips an hour.
    pub per_hour: f64,
    /// Upper bound on that (one-sided, 95 %).
    pub per_hour_upper_95: Option<f64>,
}

/// The curve.
#[derive(Clone, Debug, Serialize)]
pub struct LivenessObject {
    /// Version of this object.
    pub schema_version: u32,
    /// Seed of the draws.
    pub seed: u64,
    /// Every detector in every weather.
    pub rows: Vec<LivenessRow>,
    /// Adaptive detectors within the budget of false trips in every weather up to the loss that the platform is made for.
    pub within_budget: Vec<String>,
}

impl LivenessObject {
    /// Object for the measured outcomes.
    pub fn new(schema_version: u32, seed: u64, outcomes: Vec<Outcome>) -> Self {
        let row = |outcome: Outcome| LivenessRow {
            name: outcome.detector.name(),
            per_hour: outcome.per_hour(),
            per_hour_upper_95: events_upper(outcome.false_trips, outcome.hours),
            outcome,
        };
        let rows: Vec<LivenessRow> = outcomes.into_iter().map(row).collect();
        let kept = |detector: &Detector| {
            let made_for =
                |row: &&LivenessRow| row.outcome.detector == *detector && row.outcome.weather.loss <= BUDGET.0;
            rows.iter().filter(made_for).all(|row| row.per_hour_upper_95.is_some_and(|upper| upper <= BUDGET.1))
        };
        let within_budget = Detector::all().into_iter().filter(kept).map(Detector::name).collect();
        Self { schema_version, seed, rows, within_budget }
    }

    fn rows_of(&self, detector: Detector) -> impl Iterator<Item = &LivenessRow> {
        self.rows.iter().filter(move |row| row.outcome.detector == detector)
    }
}

/// The table: for each detector its mean latency and its false trips an hour, by loss, without jitter.
pub fn liveness_table(curve: &LivenessObject) -> String {
    let shown = |weather: &Weather| weather.jitter_ms == 0.0;
    let mut weathers: Vec<Weather> = Vec::new();
    for row in &curve.rows {
        if shown(&row.outcome.weather) && !weathers.contains(&row.outcome.weather) {
            weathers.push(row.outcome.weather);
        }
    }
    let heads = weathers.iter().map(|w| format!("{}{} %", if w.changing { "0/" } else { "" }, w.loss * 100.0));
    let heads: Vec<String> = ["detector".to_owned()].into_iter().chain(heads).collect();
    let mut table = new_table(&heads.iter().map(String::as_str).collect::<Vec<_>>());
    for detector in Detector::all() {
        let cells = curve.rows_of(detector).filter(|row| shown(&row.outcome.weather));
        let cells = cells.map(|row| format!("{:.0} / {:.3}", row.outcome.latency_ms, row.per_hour));
        table.add_row([detector.name()].into_iter().chain(cells));
    }
    let text = if curve.within_budget.is_empty() { "none".to_owned() } else { curve.within_budget.join(", ") };
    format!(
        "{table}\nmean latency in ms / false trips an hour, by loss (0/x: by turns none and x, a minute each), no jitter\n\
         below {} an hour (95 %) in every weather with up to {} % loss: {text}",
        BUDGET.1,
        BUDGET.0 * 100.0
    )
}

const PANEL: (f64, f64) = (300.0, 220.0);
const EDGE: (f64, f64) = (44.0, 34.0);
/// False trips an hour from the bottom of a panel to its top, as powers of ten.
const DECADES: (f64, f64) = (-2.0, 4.0);

/// The plot: a panel a weather, mean latency across, false trips an hour upwards.
pub fn liveness_svg(curve: &LivenessObject) -> String {
    let mut weathers: Vec<Weather> = Vec::new();
    for row in &curve.rows {
        if row.outcome.weather.loss > 0.0 && !weathers.contains(&row.outcome.weather) {
            weathers.push(row.outcome.weather);
        }
    }
    let columns = 6;
    let rows = weathers.len().div_ceil(columns);
    let (width, height) = (columns as f64 * PANEL.0, rows as f64 * PANEL.1 + EDGE.1);
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" \
         font-size=\"10\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n\
         <text x=\"12\" y=\"18\">false trips an hour (powers of ten, at most 1 in all hours drawn at the bottom) over mean \
         latency in ms; grey: fixed, blue: accrual, red: configured</text>\n"
    );
    for (i, weather) in weathers.iter().enumerate() {
        let place = ((i % columns) as f64 * PANEL.0, (i / columns) as f64 * PANEL.1 + EDGE.1);
        panel(&mut text, place, curve, weather);
    }
    text.push_str("</svg>\n");
    text
}

fn panel(text: &mut String, (left, top): (f64, f64), curve: &LivenessObject, weather: &Weather) {
    let (wide, high) = (PANEL.0 - EDGE.0 - 10.0, PANEL.1 - 2.0 * EDGE.1);
    let x = |ms: f64| left + EDGE.0 + wide * ms / LEASE_MS;
    let y = |per_hour: f64| {
        let power = decade(per_hour).clamp(DECADES.0, DECADES.1);
        top + EDGE.1 + high * (DECADES.1 - power) / (DECADES.1 - DECADES.0)
    };
    let turns = if weather.changing { "by turns none and " } else { "" };
    let title = format!("{turns}{} % loss, {} ms jitter", weather.loss * 100.0, weather.jitter_ms);
    put(text, format_args!("<text x=\"{:.1}\" y=\"{:.1}\">{title}</text>\n", x(0.0), top + 24.0));
    for power in [-2, 0, 2, 4] {
        let at = y(10f64.powi(power));
        put(
            text,
            format_args!(
                "<line x1=\"{:.1}\" y1=\"{at:.1}\" x2=\"{:.1}\" y2=\"{at:.1}\" stroke=\"#ddd\"/>\n",
                x(0.0),
                x(LEASE_MS)
            ),
        );
        put(
            text,
            format_args!("<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{power}</text>\n", x(0.0) - 4.0, at + 3.0),
        );
    }
    for ms in [100.0, 300.0, 500.0] {
        put(
            text,
            format_args!("<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{ms}</text>\n", x(ms), y(0.0) + 14.0),
        );
    }
    for row in curve.rows.iter().filter(|row| row.outcome.weather == *weather) {
        let colour = match row.outcome.detector {
            Detector::Fixed { .. } => "#808080",
            Detector::Accrual { .. } => "#2060c0",
            Detector::Configured { .. } => "#c02020",
        };
        let (cx, cy) = (x(row.outcome.latency_ms), y(row.per_hour));
        put(
            text,
            format_args!(
                "<circle cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"3\" fill=\"{colour}\"><title>{}</title></circle>\n",
                row.name
            ),
        );
    }
}

/// Power of ten, of zero the lowest drawn one.
fn decade(value: f64) -> f64 {
    if value > 0.0 { value.log10() } else { DECADES.0 }
}

fn put(text: &mut String, name: core::fmt::Arguments<'_>) {
    text.write_fmt(name).expect("invariant: writing to a String cannot fail");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::liveness::Draws;

    /// Each in its panel.
    #[test]
    fn every_point_is_drawn_and_tabulated() {
        let draws = Draws::new(1, 1);
        let weather = Weather { loss: 0.1, jitter_ms: 0.0, changing: false };
        let outcomes = Detector::all().into_iter().map(|detector| draws.watch(detector, weather)).collect();
        let curve = LivenessObject::new(1, 1, outcomes);
        let svg = liveness_svg(&curve);
        assert_eq!(svg.matches("<circle").count(), Detector::all().len());
        assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n") && !svg.contains("NaN"), "{svg}");
        let table = liveness_table(&curve);
        assert!(Detector::all().into_iter().all(|d| table.contains(&d.name())), "{table}");
    }
}
