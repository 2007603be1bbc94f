//! Curves: what came of an attack over its strength.

use maud::{Markup, html};

use super::figure;
use crate::Dossier;
use crate::figure::{Figure, Point, Series, series, series_table};
use crate::measured::{Curve, CurveLine, CurvePoint, Share};
use crate::results::Found;

pub(super) fn section(dossier: &Dossier) -> Markup {
    html! { @for f in figures(dossier) { (figure(&f)) } }
}

pub(super) fn figures(dossier: &Dossier) -> Vec<Figure> {
    let curves =
        dossier.results.given().iter().filter_map(|g| if let Found::Curve(c) = &g.found { Some(c) } else { None });
    curves.flat_map(|c| c.lines.iter().filter_map(move |line| drawn(c, line))).collect()
}

fn drawn(curve: &Curve, line: &CurveLine) -> Option<Figure> {
    let point = |of: fn(&CurvePoint) -> &Share| {
        let one = move |p: &CurvePoint| {
            let share = of(p);
            Point { value: p.value, share: share.share, interval: (share.lower_95, share.upper_95) }
        };
        line.points.iter().map(one).collect()
    };
    let lines = [
        Series { name: "noticed, no harm".to_owned(), points: point(|p| &p.detected) },
        Series { name: "harmed".to_owned(), points: point(|p| &p.harmed) },
    ];
    let which = line.cell.clone().unwrap_or_else(|| format!("policy {}", line.policy));
    let n = line.points.iter().map(|p| p.detected.n).max().unwrap_or_default();
    let value = |value: Option<f64>| value.map_or_else(|| "none".to_owned(), |v| format!("{v} {}", curve.unit));
    let marks = curve.watermarks.iter().fold(String::new(), |all, mark| format!("{all} {mark}."));
    Some(Figure {
        name: format!("curve-{}-{}", super::slug(&curve.scenario), super::slug(&which)),
        title: format!("{}, {which}", curve.title),
        caption: format!(
            "Shares with exact two-sided 95 % intervals, n = {n} trials a point, seed {}. Smallest noticed before harm: {}. Smallest \
             harmful: {}.{marks}",
            curve.seed,
            value(line.reading.smallest_detected_before_harm),
            value(line.reading.smallest_harmful),
        ),
        drawing: series(&lines, &curve.unit)?,
        table: series_table(&lines, &curve.unit),
    })
}
