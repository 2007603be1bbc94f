//! Curves: outcomes of an attack over its strength.

use results::report::{CurveLine, CurveObject, CurvePoint};
use stats::Share;

use crate::Dossier;
use crate::figure::{Figure, Series, SharePoint, series, series_table};
use crate::reader::FoundResult;

pub(super) fn figures(dossier: &Dossier) -> Vec<Figure> {
    let curves = dossier
        .results
        .files()
        .iter()
        .filter_map(|g| if let FoundResult::Curve(c) = &g.found { Some(c) } else { None });
    curves.flat_map(of_curve).collect()
}

/// A figure a line.
pub(super) fn of_curve(curve: &CurveObject) -> Vec<Figure> {
    curve.lines.iter().filter_map(|line| drawn(curve, line)).collect()
}

fn drawn(curve: &CurveObject, line: &CurveLine) -> Option<Figure> {
    let point = |share_of: fn(&CurvePoint) -> &Share| {
        let one = move |p: &CurvePoint| {
            let share = share_of(p);
            SharePoint { value: p.value, share: share.share, interval: (share.lower_95, share.upper_95) }
        };
        line.points.iter().map(one).collect()
    };
    let lines = [
        Series { name: "noticed, no harm".to_owned(), points: point(|p| &p.detected) },
        Series { name: "harmed".to_owned(), points: point(|p| &p.harmed) },
    ];
    let which = line.cell.clone().unwrap_or_else(|| format!("policy {}", line.policy));
    // Twelve digits tell detectors apart and keep the title short.
    let brought =
        curve.detector.as_ref().map(|sha256| format!(", detector {}", sha256.chars().take(12).collect::<String>()));
    let which = format!("{which}{}", brought.unwrap_or_default());
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reader::golden;

    #[test]
    fn curve_of_another_detector_is_another_figure() {
        let mut shipped: CurveObject = serde_json::from_value(golden("curve")).expect("a curve");
        shipped.detector = None;
        let line = &mut shipped.lines[0];
        line.cell = None;
        line.points.push(CurvePoint { value: 2.0, ..line.points[0].clone() });
        let line = line.clone();
        let other = CurveObject { detector: Some("ab".repeat(32)), ..shipped.clone() };
        let [shipped, other] = [&shipped, &other].map(|curve| drawn(curve, &line).unwrap());
        assert!(shipped.name != other.name && shipped.title != other.title);
        assert!(other.title.ends_with("policy default, detector abababababab"), "{}", other.title);
    }
}
