//! Layers for the ATT&CK Navigator (layer format 4.5): one for ICS, one for Enterprise, one for ATLAS; techniques scored by their
//! outcomes, not by having been tried.
//!
//! A technique stands for the rows of the catalogue that name it. Its **score** is a lower bound on the trials of a hundred that are not
//! unsafe, in the worst of its runs: 100 × (1 − upper 95 % bound), rounded down, INVALID counted as unsafe. Few trials therefore give a
//! low score. Its **colour** is that of the worst class in any of these runs. Three kinds of run count for neither: runs without the row's
//! real mechanism, runs under a policy that waives a check, and controls, which expect UNSAFE or INVALID. A technique without a run has
//! neither score nor colour. The technique's metadata have all runs, by row and kind of evidence, the n of which are never added.

use std::collections::BTreeMap;

use evidence::trial::Outcome;
use results::report::{Kind, MatrixRow, MatrixRun};
use serde_json::{Map, Value, json};

use crate::reader::{FoundResult, Results};
use crate::tried::{class_counts, meaning};

/// The ATT&CK release that the catalogue's ids were checked against. From version 19 on ICS has ids without a leading zero.
const ATTACK: &str = "18";

/// The ATLAS release that the catalogue's ids were checked against.
const ATLAS: &str = "5.6.0";

/// Classes from worst to best, for the platform's users.
const WORST_FIRST: [Outcome; 11] = [
    Outcome::Unsafe,
    Outcome::Late,
    Outcome::GuestFailed,
    Outcome::Invalid,
    Outcome::Undetected,
    Outcome::FalseTrip,
    Outcome::Stuck,
    Outcome::HoldSafe,
    Outcome::Degraded,
    Outcome::Rejected,
    Outcome::Nominal,
];

/// A collection of techniques that has its own layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Domain {
    Ics,
    Enterprise,
    Atlas,
}

impl Domain {
    const ALL: [Domain; 3] = [Domain::Ics, Domain::Enterprise, Domain::Atlas];

    fn from_id(id: &str) -> Option<Self> {
        match id {
            _ if id.starts_with("AML.T") => Some(Domain::Atlas),
            // Enterprise ids begin at T1001.
            _ if id.starts_with("T0") => Some(Domain::Ics),
            _ if id.starts_with('T') => Some(Domain::Enterprise),
            _ => None,
        }
    }

    /// Name of the layer's file, the domain as Navigator knows it, title.
    fn names(self) -> [&'static str; 3] {
        match self {
            Domain::Ics => ["attack-ics.json", "ics-attack", "ATT&CK for ICS"],
            Domain::Enterprise => ["attack-enterprise.json", "enterprise-attack", "ATT&CK Enterprise"],
            // The format's text names three domains; ATLAS's own Navigator reads its layers under this one.
            Domain::Atlas => ["atlas.json", "atlas-atlas", "ATLAS"],
        }
    }
}

/// Rows by the technique that they name.
type Techniques<'a> = BTreeMap<&'a str, Vec<&'a MatrixRow>>;

/// Layers, each with its file name and its text, made from matrices alone; empty without a matrix.
pub fn layers(results: &Results) -> Vec<(&'static str, String)> {
    let mut techniques = Techniques::new();
    let mut sources = Vec::new();
    for given in results.files() {
        let FoundResult::Matrix(matrix) = &given.found else { continue };
        sources.push(json!({ "name": given.file, "value": format!("SHA-256 {}", given.sha256) }));
        sources.push(json!({ "name": "seed", "value": matrix.seed.to_string() }));
        for row in &matrix.rows {
            row.techniques.iter().for_each(|id| techniques.entry(id).or_default().push(row));
        }
    }
    if sources.is_empty() {
        return Vec::new();
    }
    let text = |domain: Domain| format!("{:#}\n", layer(domain, &techniques, &sources));
    Domain::ALL.into_iter().map(|domain| (domain.names()[0], text(domain))).collect()
}

fn layer(domain: Domain, techniques: &Techniques, sources: &[Value]) -> Value {
    let [_, id, name] = domain.names();
    let of_domain = techniques.iter().filter(|(id, _)| Domain::from_id(id) == Some(domain));
    let legend = WORST_FIRST.map(|class| {
        let label = format!("worst: {} ({})", class.name(), meaning(class));
        json!({ "label": label, "color": colour_of_outcome(class.name()) })
    });
    let mut versions = json!({ "navigator": "5.1.0", "layer": "4.5" });
    let mut metadata = sources.to_vec();
    match domain {
        Domain::Atlas => metadata.push(json!({ "name": "atlas_data_version", "value": ATLAS })),
        Domain::Ics | Domain::Enterprise => versions["attack"] = ATTACK.into(),
    }
    json!({
        "name": format!("holdsafe: {name}, by outcome"),
        "versions": versions,
        "domain": id,
        "description": "Score: at least so many of a hundred trials are not unsafe in the worst run (95 %; INVALID counts as \
            unsafe). Colour: the worst class that came out. No score: no run counts for it. docs/reference/interchange.md says more.",
        "sorting": 2,
        "layout": { "layout": "side", "showID": true, "showName": true, "expandedSubtechniques": "annotated" },
        "techniques": of_domain.map(|(id, rows)| technique(id, rows)).collect::<Vec<_>>(),
        "gradient": { "colors": ["#b3001b", "#f2c94c", "#15803d"], "minValue": 0, "maxValue": 100 },
        "legendItems": legend,
        "metadata": metadata,
    })
}

fn technique(id: &str, rows: &[&MatrixRow]) -> Value {
    let runs: Vec<&MatrixRun> = rows.iter().flat_map(|row| &row.runs).filter(|run| is_evidence(run)).collect();
    let occurred = |class: &Outcome| runs.iter().any(|run| run.summary.outcomes.get(class).is_some_and(|n| *n > 0));
    let comment: Vec<String> =
        rows.iter().map(|row| format!("{} {}. Must come of it: {}", row.id, row.threat, row.containment)).collect();
    let mut object = Map::from_iter([
        ("techniqueID".to_owned(), id.into()),
        ("comment".to_owned(), comment.join("\n").into()),
        ("metadata".to_owned(), rows.iter().flat_map(|row| evidence(row)).collect::<Vec<_>>().into()),
    ]);
    if !runs.is_empty() {
        object.insert("score".to_owned(), score(&runs).into());
    }
    if let Some(class) = WORST_FIRST.iter().find(|class| occurred(class)) {
        object.insert("color".to_owned(), colour_of_outcome(class.name()).into());
    }
    object.into()
}

/// True if a run is evidence about the platform: its mechanism really runs, no check is waived, and it is no control.
fn is_evidence(run: &MatrixRun) -> bool {
    let control = run.expected.iter().any(|class| matches!(class, Outcome::Unsafe | Outcome::Invalid));
    run.counts && run.watermark.is_none() && !control && run.summary.n > 0
}

fn score(runs: &[&MatrixRun]) -> u8 {
    let worst = runs.iter().map(|run| run.summary.unsafe_upper_95_invalid_counted).fold(0.0, f64::max);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to 0..=100 just before")]
    let score = (100.0 * (1.0 - worst)).floor().clamp(0.0, 100.0) as u8;
    score
}

/// Evidence of a row: a line for each kind.
fn evidence(row: &MatrixRow) -> Vec<Value> {
    let line = |name: String, value: String| json!({ "name": name, "value": value });
    if row.kinds.is_empty() {
        let reason = row.open.as_deref().unwrap_or("not in this matrix");
        return vec![line(row.id.clone(), format!("not run: {reason}"))];
    }
    row.kinds.iter().map(|kind| line(format!("{}, {}", row.id, kind.evidence.name()), told_of(kind))).collect()
}

fn told_of(kind: &Kind) -> String {
    let ablation = if kind.ablation { "under a policy that waives checks: " } else { "" };
    let counts = if kind.counts { "" } else { "; the real mechanism does not run there" };
    format!(
        "{ablation}n {}: {}; {} not as expected; unsafe below {:.2} % in the worst run, {:.2} % with all bounds together (95 %){counts}",
        kind.n,
        class_counts(&kind.outcomes),
        kind.unexpected,
        kind.unsafe_upper_95 * 100.0,
        kind.unsafe_upper_95_simultaneous * 100.0,
    )
}

/// Colours of the Navigator's cells, which have black words on white: those that its readers' layers already have.
fn colour_of_outcome(name: &str) -> &'static str {
    match name {
        "UNSAFE" => "#b3001b",
        "INVALID" => "#6d28d9",
        "LATE" => "#c2410c",
        "FALSE_TRIP" => "#a16207",
        "STUCK" => "#713f12",
        "HOLD_SAFE" => "#1d4ed8",
        "DEGRADED" => "#0e7490",
        "REJECTED" => "#15803d",
        "UNDETECTED" => "#57534e",
        "NOMINAL" => "#a8a29e",
        _ => "#d6d3d1",
    }
}
