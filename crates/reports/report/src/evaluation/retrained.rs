//! Retraining against a thermovisual attack: one curve with the detector before it, and one with that after it. What ships fuses several networks,
//! so its own curve is told beside them and decides nothing.

use results::report::{CurveObject, CurvePoint};
use stats::Share;

use super::{Answer, Status, missing};
use crate::reader::{FoundResult, Results};

/// The scenario in which paint and warmth deceive together, in steps of strength.
const THERMOVISUAL: &str = "decoy_printed_heated";

/// Statement of the two curves of other detectors, in the order of the files: fewer decoys acted on at some strength, and more at none.
pub(super) fn retrained(results: &Results) -> Answer {
    let curves =
        results.files().iter().filter_map(|g| if let FoundResult::Curve(c) = &g.found { Some(c) } else { None });
    let curves: Vec<&CurveObject> = curves.filter(|c| c.scenario == THERMOVISUAL && c.watermarks.is_empty()).collect();
    let mut own = curves.iter().filter(|c| c.detector.is_some());
    let Some((before, after)) = own.next().zip(own.next()).filter(|(a, b)| a.seed == b.seed) else { return missing() };
    let pairs: Vec<(&CurvePoint, &CurvePoint)> =
        points(before).filter_map(|a| Some((a, points(after).find(|b| b.value == a.value)?))).collect();
    let fewer = pairs.iter().filter(|(a, b)| b.harmed.upper_95 < a.harmed.lower_95).count();
    let more = pairs.iter().filter(|(a, b)| a.harmed.upper_95 < b.harmed.lower_95).count();
    let mut lines: Vec<String> = pairs.iter().map(|(a, b)| line(&before.unit, a, b)).collect();
    lines.push(format!(
        "fewer at {fewer} of {} strengths and more at {more}, where the 95 % intervals do not meet; judged by what the platform did, not by the network",
        pairs.len()
    ));
    let digest = |curve: &CurveObject| curve.detector.clone().unwrap_or_default();
    lines.push(format!("the detectors, before and after: `{}`, `{}`", digest(before), digest(after)));
    if let Some(shipped) = curves.iter().find(|c| c.detector.is_none() && c.seed == before.seed) {
        let counts: Vec<String> = points(shipped).map(|p| format!("{} at {}", fraction(p.harmed), p.value)).collect();
        lines.push(format!("as shipped, with fused networks: {}", counts.join(", ")));
    }
    lines.push(
        "the print was made with the weights before the retraining, so this says nothing of an attacker who knows of it; `docs/researcher/perception.md` has a print \
         that was made with the retrained one's weights, and what that comes to"
            .to_owned(),
    );
    let status = if fewer > 0 && more == 0 { Status::Reproduced } else { Status::NotReproduced };
    Answer { status, lines }
}

fn points(curve: &CurveObject) -> impl Iterator<Item = &CurvePoint> {
    curve.lines.iter().filter(|line| line.cell.is_none()).flat_map(|line| &line.points)
}

fn fraction(Share { hits, n, .. }: Share) -> String {
    format!("{hits} of {n}")
}

fn line(unit: &str, before: &CurvePoint, after: &CurvePoint) -> String {
    let (value, before, after) = (before.value, fraction(before.harmed), fraction(after.harmed));
    format!(
        "`{THERMOVISUAL}` at {value} {unit}: the decoy is acted on in {before} before the retraining, {after} after it"
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

    fn compare_status(before: (u64, f64, f64), after: (u64, f64, f64)) -> Status {
        let mut results = Results::default();
        let shipped = curve(None, 20, 0.83, 1.0);
        let before = curve(Some("aa"), before.0, before.1, before.2);
        let after = curve(Some("ab"), after.0, after.1, after.2);
        for (name, curve) in [("a.json", shipped), ("b.json", before)] {
            results.read(name, curve.as_bytes()).expect("a curve");
            assert_eq!(retrained(&results).status, Status::NotMeasured, "that of what ships is no detector before it");
        }
        results.read("c.json", after.as_bytes()).expect("a curve");
        retrained(&results).status
    }

    #[test]
    fn retraining_helps_only_with_disjoint_intervals() {
        assert_eq!(compare_status((20, 0.83, 1.0), (0, 0.0, 0.17)), Status::Reproduced);
        assert_eq!(compare_status((12, 0.36, 0.81), (9, 0.23, 0.68)), Status::NotReproduced);
        assert_eq!(compare_status((0, 0.0, 0.17), (20, 0.83, 1.0)), Status::NotReproduced);
    }
}
