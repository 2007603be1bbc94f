//! The object and the table of `holdsafe campaign curve`: outcome shares, latencies and counts along one value of a scenario.
//!
//! Shares have exact intervals; INVALID trials stay in every n and count neither as noticed nor as harm.

use std::collections::BTreeMap;

use evidence::SCHEMA_VERSION;
use evidence::trial::{Outcome, Trial};
use scenario::Curve;
use serde::{Deserialize, Serialize};
use stats::{Sample, Share};

use super::run::{LatencySummary, Summary};
use super::table::{outcomes, sample};
use crate::report::new_table;

/// A whole curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CurveObject {
    /// Version of this object.
    pub schema_version: u32,
    /// Name of the scenario.
    pub scenario: String,
    /// Title.
    pub title: String,
    /// Path of the value in the scenario.
    pub set: String,
    /// Unit of the values.
    pub unit: String,
    /// The base seed; trial i of every point has seed + i.
    pub seed: u64,
    /// Reasons for which a line is an ablation, where one is.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub watermarks: Vec<String>,
    /// The detector that took the shipped one's place, by its SHA-256.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub detector: Option<String>,
    /// One line a cell of the scenario.
    pub lines: Vec<CurveLine>,
}

/// One line of a curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CurveLine {
    /// The cell, where the scenario has cells.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cell: Option<String>,
    /// The policy it ran under.
    pub policy: String,
    /// Its points, in order of their values.
    pub points: Vec<CurvePoint>,
    /// Values read off it.
    pub reading: Reading,
}

/// One point of a line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    /// The value.
    pub value: f64,
    /// Trials in which the attack was noticed or refused and did no harm.
    pub detected: Share,
    /// Trials in which it did harm.
    pub harmed: Share,
    /// Every class that came out, with its share.
    pub outcomes: BTreeMap<Outcome, Share>,
    /// Latencies from the first receipt.
    pub latency_ms: LatencySummary,
    /// Share of an admitted teammate's false claims that the gateway accepted; records of one trial are not
    /// independent.
    #[serde(default = "no_claims")]
    pub claims_accepted: Share,
    /// The most that such claims led from the truth before a reaction, in metres.
    #[serde(default)]
    pub believed_m: Sample,
    /// Records that the two ends of the link accepted, all trials together.
    pub accepted: u64,
    /// Records that the two ends refused, by reason.
    pub refused: BTreeMap<String, u64>,
    /// Trials outside the expected classes.
    pub unexpected: u64,
    /// Different decision hashes.
    pub distinct_decisions: usize,
}

/// Values read off a line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// The smallest value at which every trial was noticed and none was harmed.
    pub smallest_detected_before_harm: Option<f64>,
    /// Lower end of the exact interval of the share noticed there.
    pub detected_there_lower_95: Option<f64>,
    /// The smallest value from which on that holds at every further point.
    pub always_detected_from: Option<f64>,
    /// The largest value at which some trial was not noticed, or not before harm.
    pub largest_undetected: Option<f64>,
    /// The smallest value at which some trial was harmed.
    pub smallest_harmful: Option<f64>,
}

impl CurveObject {
    /// A curve over these lines.
    pub fn new(scenario: &str, curve: &Curve, seed: u64, watermarks: Vec<String>, lines: Vec<CurveLine>) -> Self {
        Self {
            schema_version: SCHEMA_VERSION,
            scenario: scenario.to_owned(),
            title: curve.title.as_str().to_owned(),
            set: curve.set.as_str().to_owned(),
            unit: curve.unit.as_str().to_owned(),
            seed,
            watermarks,
            detector: None,
            lines,
        }
    }
}

impl CurveLine {
    /// A line over these points.
    pub fn new(cell: Option<String>, policy: &str, points: Vec<CurvePoint>) -> Self {
        let reading = Reading::from_points(&points);
        Self { cell, policy: policy.to_owned(), points, reading }
    }
}

/// The claims of a trial without a teammate in bad faith, and of results from before these were counted.
fn no_claims() -> Share {
    Share::new(0, 0)
}

impl CurvePoint {
    /// Point of the trials at `value`; `expected` are the classes that it may end in, none where any may.
    pub fn new(value: f64, curve: &Curve, expected: &[Outcome], trials: &[&Trial]) -> Self {
        let n = trials.len() as u64;
        let summary = Summary::from_trials(trials);
        let count_in = |classes: &[Outcome]| trials.iter().filter(|t| classes.contains(&t.outcome)).count() as u64;
        let believed_m = |t: &Trial| t.claims.map(|claims| f64::from(claims.believed_mm) / 1000.0);
        let misled = |t: &Trial| curve.harm_beyond_m.is_some_and(|m| believed_m(t).is_some_and(|off| off > m.get()));
        let harmed = |t: &Trial| curve.harm.contains(&t.outcome) || (t.outcome != Outcome::Invalid && misled(t));
        let count = |test: &dyn Fn(&Trial) -> bool| trials.iter().filter(|t| test(t)).count() as u64;
        let claims = trials.iter().filter_map(|t| t.claims);
        let (stated, accepted) = claims.fold((0, 0), |(stated, accepted), c| (stated + c.said, accepted + c.accepted));
        let mut refused = BTreeMap::new();
        for (reason, count) in trials.iter().flat_map(|t| &t.dropped) {
            *refused.entry(reason.clone()).or_insert(0) += count;
        }
        Self {
            value,
            detected: Share::new(count(&|t| curve.detected.contains(&t.outcome) && !harmed(t)), n),
            harmed: Share::new(count(&harmed), n),
            claims_accepted: Share::new(accepted, stated),
            believed_m: Sample::from_values(trials.iter().filter_map(|t| believed_m(t))),
            outcomes: summary.outcomes.iter().map(|(class, hits)| (*class, Share::new(*hits, n))).collect(),
            latency_ms: summary.latency_ms,
            accepted: trials.iter().map(|t| t.accepted).sum(),
            refused,
            unexpected: if expected.is_empty() { 0 } else { n - count_in(expected) },
            distinct_decisions: summary.distinct_decisions,
        }
    }

    /// True if every trial was noticed and none was harmed.
    fn caught(&self) -> bool {
        self.detected.hits == self.detected.n && self.detected.n > 0 && self.harmed.hits == 0
    }
}

impl Reading {
    fn from_points(points: &[CurvePoint]) -> Self {
        let first = points.iter().find(|p| p.caught());
        let missed = points.iter().rposition(|p| !p.caught());
        Self {
            smallest_detected_before_harm: first.map(|p| p.value),
            detected_there_lower_95: first.map(|p| p.detected.lower_95),
            always_detected_from: points.get(missed.map_or(0, |index| index + 1)).map(|p| p.value),
            largest_undetected: points.iter().rfind(|p| p.detected.hits < p.detected.n).map(|p| p.value),
            smallest_harmful: points.iter().find(|p| p.harmed.hits > 0).map(|p| p.value),
        }
    }
}

/// The curve for a terminal: a table a line, and the values read off it.
pub fn curve_table(curve: &CurveObject) -> String {
    let mut text: String = curve.watermarks.iter().map(|mark| format!("{mark}\n")).collect();
    let (title, set, unit) = (&curve.title, &curve.set, &curve.unit);
    text.push_str(&format!("{}: {title} ({set}, seed {} for each point)\n", curve.scenario, curve.seed));
    curve
        .detector
        .iter()
        .for_each(|sha256| text.push_str(&format!("with the detector {sha256} in place of the shipped one\n")));
    for line in &curve.lines {
        let cell = line.cell.as_ref().map(|cell| format!("{cell}, ")).unwrap_or_default();
        let columns = [
            "detected",
            "harmed",
            "claims accepted",
            "outcomes",
            "to degraded ms",
            "to hold-safe ms",
            "accepted / refused",
        ];
        let columns: Vec<&str> = std::iter::once(unit.as_str()).chain(columns).collect();
        let mut table = new_table(&columns);
        line.points.iter().for_each(|point| {
            table.add_row(row(point));
        });
        text.push_str(&format!("{cell}policy {}\n{table}\n{}\n", line.policy, reading(&line.reading, unit)));
    }
    text.push_str("shares: exact two-sided 95 % interval. ms: mean / p95 / upper 95 % bound on p95 (needs n >= 59).\n");
    text
}

fn row(point: &CurvePoint) -> Vec<String> {
    let classes = point.outcomes.iter().map(|(class, share)| (*class, share.hits)).collect();
    let mut classes = outcomes(&classes);
    if point.unexpected > 0 {
        classes.push_str(&format!(" ({} unexpected)", point.unexpected));
    }
    let refused: Vec<String> = point.refused.iter().map(|(reason, n)| format!("{reason} {n}")).collect();
    let refused = if refused.is_empty() { "0".to_owned() } else { refused.join(", ") };
    vec![
        point.value.to_string(),
        share(&point.detected),
        share(&point.harmed),
        claims(point),
        classes,
        sample(&point.latency_ms.to_degraded),
        sample(&point.latency_ms.to_hold_safe),
        format!("{} / {refused}", point.accepted),
    ]
}

/// `12/20 (0.361-0.809)`.
fn share(share: &Share) -> String {
    format!("{}/{} ({:.3}-{:.3})", share.hits, share.n, share.lower_95, share.upper_95)
}

/// Claims accepted and made, and the distance by which they misled: mean and 95th percentile in metres.
fn claims(point: &CurvePoint) -> String {
    let Share { hits, n, .. } = point.claims_accepted;
    match (n, point.believed_m.mean, point.believed_m.p95) {
        (0, _, _) => "-".to_owned(),
        (_, Some(mean), Some(p95)) if p95 > 0.0 => format!("{hits}/{n}, {mean:.2} / {p95:.2} m off"),
        _ => format!("{hits}/{n}"),
    }
}

fn reading(reading: &Reading, unit: &str) -> String {
    let value = |value: Option<f64>| value.map_or_else(|| "none".to_owned(), |v| format!("{v} {unit}"));
    let detected = reading.detected_there_lower_95;
    let share_text = detected.map_or_else(String::new, |low| format!(" (share noticed there above {low:.3})"));
    format!(
        "smallest detected before harm: {}{share_text}; always from: {}; largest undetected: {}; smallest harmful: {}",
        value(reading.smallest_detected_before_harm),
        value(reading.always_detected_from),
        value(reading.largest_undetected),
        value(reading.smallest_harmful),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A point of ten trials, a given number of them detected, some harmed, the rest unnoticed.
    fn point(value: f64, detected: u64, harmed: u64) -> CurvePoint {
        let class = |seed| match seed {
            s if s < detected => Outcome::HoldSafe,
            s if s < detected + harmed => Outcome::Unsafe,
            _ => Outcome::Undetected,
        };
        let trials: Vec<Trial> = (0..10).map(|seed| Trial::example(seed, class(seed))).collect();
        let curve: Curve = toml::from_str("title = \"t\"\nset = \"a.b\"\nvalues = [1, 2]\nunit = \"m/s\"\n").unwrap();
        CurvePoint::new(value, &curve, &[Outcome::HoldSafe], &trials.iter().collect::<Vec<_>>())
    }

    #[test]
    fn smallest_value_detected_before_harm_is_found() {
        let points = vec![point(0.1, 0, 0), point(0.2, 7, 3), point(0.4, 10, 0), point(0.8, 9, 0), point(1.6, 10, 0)];
        let line = CurveLine::new(None, "default", points);
        let reading = line.reading;
        assert_eq!(reading.smallest_detected_before_harm, Some(0.4));
        assert_eq!(reading.always_detected_from, Some(1.6));
        assert_eq!((reading.largest_undetected, reading.smallest_harmful), (Some(0.8), Some(0.2)));
        assert!((reading.detected_there_lower_95.unwrap() - 0.6915).abs() < 1e-4);
        assert_eq!(line.points[1].unexpected, 3);
    }

    #[test]
    fn where_nothing_was_caught_nothing_is_read_off() {
        let reading = CurveLine::new(None, "default", vec![point(1.0, 9, 0), point(2.0, 0, 10)]).reading;
        assert_eq!((reading.smallest_detected_before_harm, reading.always_detected_from), (None, None));
    }
}
