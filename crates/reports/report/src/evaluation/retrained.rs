//! Retraining against a thermovisual attack: one curve with the detector that ships, and one with another.

use results::report::{CurveObject, CurvePoint};
use stats::Share;

use super::{Answer, Status, missing};
use crate::reader::{FoundResult, Results};

/// The scenario in which paint and warmth deceive together, in steps of strength.
const THERMOVISUAL: &str = "decoy_printed_heated";

/// Statement of the two curves: fewer decoys acted on at some strength, and more at none.
pub(super) fn retrained(results: &Results) -> Answer {
    let curves =
        results.files().iter().filter_map(|g| if let FoundResult::Curve(c) = &g.found { Some(c) } else { None });
    let curves: Vec<&CurveObject> = curves.filter(|c| c.scenario == THERMOVISUAL && c.watermarks.is_empty()).collect();
    let shipped = curves.iter().find(|c| c.detector.is_none());
    let same = |c: &&&CurveObject| shipped.is_some_and(|s| c.detector.is_some() && c.seed == s.seed);
    let Some((shipped, other)) = shipped.zip(curves.iter().find(same)) else { return missing() };
    let pairs: Vec<(&CurvePoint, &CurvePoint)> =
        points(shipped).filter_map(|a| Some((a, points(other).find(|b| b.value == a.value)?))).collect();
    let fewer = pairs.iter().filter(|(a, b)| b.harmed.upper_95 < a.harmed.lower_95).count();
    let more = pairs.iter().filter(|(a, b)| a.harmed.upper_95 < b.harmed.lower_95).count();
    let mut lines: Vec<String> = pairs.iter().map(|(a, b)| line(&shipped.unit, a, b)).collect();
    lines.push(format!(
        "fewer at {fewer} of {} strengths and more at {more}, where the 95 % intervals do not meet; judged by what the platform did, not by the network",
        pairs.len()
    ));
    lines.push(format!("the retrained detector: `{}`", other.detector.as_deref().unwrap_or_default()));
    lines.push(
        "the print was made with the weights of the detector that ships, so this says nothing of an attacker who knows of the retraining; `docs/researcher/perception.md` \
         has a print that was made with the retrained one's weights, and what that comes to"
            .to_owned(),
    );
    let status = if fewer > 0 && more == 0 { Status::Reproduced } else { Status::NotReproduced };
    Answer { status, lines }
}

fn points(curve: &CurveObject) -> impl Iterator<Item = &CurvePoint> {
    curve.lines.iter().filter(|line| line.cell.is_none()).flat_map(|line| &line.points)
}

fn line(unit: &str, shipped: &CurvePoint, other: &CurvePoint) -> String {
    let fraction = |Share { hits, n, .. }: Share| format!("{hits} of {n}");
    let (value, shipped, other) = (shipped.value, fraction(shipped.harmed), fraction(other.harmed));
    format!(
        "`{THERMOVISUAL}` at {value} {unit}: the decoy is acted on in {shipped} with the detector that ships, {other} with the retrained one"
    )
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::reader::golden;

    fn curve(detector: Option<&str>, hits: u64, lower: f64, upper: f64) -> String {
        let mut curve = golden("curve");
        (curve["scenario"], curve["watermarks"], curve["detector"]) = (THERMOVISUAL.into(), json!([]), detector.into());
        let line = &mut curve["lines"][0];
        line["cell"] = json!(null);
        line["points"][0]["harmed"] =
            json!({"hits": hits, "n": 20, "share": 0.5, "lower_95": lower, "upper_95": upper});
        curve.to_string()
    }

    fn compare_status(shipped: (u64, f64, f64), other: (u64, f64, f64)) -> Status {
        let mut results = Results::default();
        let shipped = curve(None, shipped.0, shipped.1, shipped.2);
        let other = curve(Some("ab"), other.0, other.1, other.2);
        results.read("a.json", shipped.as_bytes()).expect("a curve");
        assert_eq!(retrained(&results).status, Status::NotMeasured, "one curve says nothing");
        results.read("b.json", other.as_bytes()).expect("a curve");
        retrained(&results).status
    }

    #[test]
    fn retraining_helps_only_with_disjoint_intervals() {
        assert_eq!(compare_status((20, 0.83, 1.0), (0, 0.0, 0.17)), Status::Reproduced);
        assert_eq!(compare_status((12, 0.36, 0.81), (9, 0.23, 0.68)), Status::NotReproduced);
        assert_eq!(compare_status((0, 0.0, 0.17), (20, 0.83, 1.0)), Status::NotReproduced);
    }
}
