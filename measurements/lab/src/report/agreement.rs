//! Agreement of live runs with the twin, stratum by stratum: the object of `lab agreement`, and its table.
//!
//! Twin and live n are never added: of each sequence there is one run of either. A live run that is INVALID agrees with
//! no run; it is left out of the first bound and counted as disagreeing in the second.

use std::collections::BTreeMap;

use evidence::trial::Outcome;
use results::report::new_table;
use search::Stratum;
use serde::Serialize;
use stats::{LEVEL, rate_lower};

/// The object of `lab agreement --json`.
#[derive(Clone, Debug, Serialize)]
pub struct AgreementObject {
    /// Version of this object.
    pub schema_version: u32,
    /// Seed of each trial.
    pub seed: u64,
    /// Seed of the drawing.
    pub draws: u64,
    /// SHA-256 of the program that ran them, hexadecimal.
    pub build: String,
    /// One row each.
    pub strata: Vec<StratumRow>,
    /// One row a sequence.
    #[serde(rename = "words")]
    pub sequences: Vec<SequenceRow>,
}

/// A sequence, once in the twin and once live.
#[derive(Clone, Debug, Serialize)]
pub struct SequenceRow {
    /// Its file's name without the ending.
    pub name: String,
    /// Stratum as drawn.
    pub stratum: Stratum,
    /// The weakness, or the attack space where no check is waived.
    pub of: String,
    /// The sequence.
    #[serde(rename = "word")]
    pub sequence: String,
    /// Its class in the twin.
    pub twin: Outcome,
    /// Its class live.
    pub live: Outcome,
    /// The oracle's findings about the live run.
    pub findings: Vec<String>,
    /// The line that runs it live again; without `--live` in the twin.
    pub reproduce: String,
}

impl SequenceRow {
    /// True if it is UNSAFE live, and not in the twin.
    pub fn is_missed(&self) -> bool {
        self.live == Outcome::Unsafe && self.twin != Outcome::Unsafe
    }
}

/// One stratum.
#[derive(Clone, Debug, Serialize)]
pub struct StratumRow {
    /// Stratum.
    pub stratum: Stratum,
    /// Sequences that were run.
    #[serde(rename = "words")]
    pub sequences: u64,
    /// Number of these INVALID live.
    pub invalid: u64,
    /// Both UNSAFE, or neither.
    pub unsafe_or_not: Agreed,
    /// Both UNSAFE or LATE, or neither.
    pub broken_or_not: Agreed,
    /// Agreement in the class.
    pub same_class: Agreed,
}

/// Agreement of twin and live.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Agreed {
    /// Runs that agreed.
    pub k: u64,
    /// Valid live runs.
    pub n: u64,
    /// Exact one-sided lower 95 % bound on the rate of agreement.
    pub lower_95: f64,
    /// The bound where each INVALID run counts as disagreeing.
    pub lower_95_with_invalid: f64,
}

impl Agreed {
    /// Agreement on `sequences`: `alike` gives whether the classes in the twin and live count as the same.
    fn from_sequences(sequences: &[&SequenceRow], alike: impl Fn(Outcome, Outcome) -> bool) -> Self {
        let valid: Vec<_> = sequences.iter().filter(|sequence| sequence.live != Outcome::Invalid).collect();
        let k = valid.iter().filter(|sequence| alike(sequence.twin, sequence.live)).count() as u64;
        let (n, all) = (valid.len() as u64, sequences.len() as u64);
        Self { k, n, lower_95: rate_lower(k, n, LEVEL), lower_95_with_invalid: rate_lower(k, all, LEVEL) }
    }

    fn describe(&self) -> String {
        let percent = |rate: f64| format!("{:.1} %", rate * 100.0);
        format!("{} of {}: {} ({})", self.k, self.n, percent(self.lower_95), percent(self.lower_95_with_invalid))
    }
}

impl StratumRow {
    fn from_sequences(stratum: Stratum, sequences: &[SequenceRow]) -> Self {
        let own_rows: Vec<&SequenceRow> = sequences.iter().filter(|sequence| sequence.stratum == stratum).collect();
        let is_unsafe = |outcome: Outcome| outcome == Outcome::Unsafe;
        let broken = |outcome: Outcome| matches!(outcome, Outcome::Unsafe | Outcome::Late);
        Self {
            stratum,
            sequences: own_rows.len() as u64,
            invalid: own_rows.iter().filter(|sequence| sequence.live == Outcome::Invalid).count() as u64,
            unsafe_or_not: Agreed::from_sequences(&own_rows, |twin, live| is_unsafe(twin) == is_unsafe(live)),
            broken_or_not: Agreed::from_sequences(&own_rows, |twin, live| broken(twin) == broken(live)),
            same_class: Agreed::from_sequences(&own_rows, |twin, live| twin == live),
        }
    }
}

impl AgreementObject {
    /// Object for these sequences, in any order.
    pub fn new(seed: u64, draws: u64, build: String, sequences: Vec<SequenceRow>) -> Self {
        let strata = Stratum::ALL.map(|stratum| StratumRow::from_sequences(stratum, &sequences)).to_vec();
        Self { schema_version: evidence::SCHEMA_VERSION, seed, draws, build, strata, sequences }
    }
}

/// The table for a terminal.
pub fn agreement_table(object: &AgreementObject) -> String {
    let mut table = new_table(&[
        "stratum",
        "sequences",
        "INVALID live",
        "UNSAFE or not",
        "UNSAFE or LATE, or not",
        "the same class",
    ]);
    for row in &object.strata {
        table.add_row([
            row.stratum.name().to_owned(),
            row.sequences.to_string(),
            row.invalid.to_string(),
            row.unsafe_or_not.describe(),
            row.broken_or_not.describe(),
            row.same_class.describe(),
        ]);
    }
    let mut text = format!(
        "twin (rendered) and live, one run each, seed {}, sequences drawn with {}\n{table}\n\
         k of n: exact one-sided lower 95 % bound on how often they agree (with each INVALID run as disagreeing)\n",
        object.seed, object.draws
    );
    let missed = |sequence: &&SequenceRow| sequence.is_missed();
    let texts = object.sequences.iter().filter(missed).map(|sequence| one("UNSAFE live, not so in the twin", sequence));
    let invalid = object
        .sequences
        .iter()
        .filter(|sequence| sequence.live == Outcome::Invalid)
        .map(|sequence| one("INVALID live", sequence));
    text.extend(texts.chain(invalid));
    for ((stratum, twin, live), names) in other_differences(&object.sequences) {
        text.push_str(&format!("{}: {} in the twin, {} live: {names}\n", stratum.name(), twin.name(), live.name()));
    }
    text
}

fn one(label: &str, sequence: &SequenceRow) -> String {
    let reason = sequence.findings.join("; ");
    let SequenceRow { name, of, twin, live, .. } = sequence;
    let (twin, live) = (twin.name(), live.name());
    format!(
        "{label}: {name} ({of}): {}\n  twin {twin}, live {live}: {reason}\n  {}\n",
        sequence.sequence, sequence.reproduce
    )
}

/// The other sequences whose classes differ, by these.
fn other_differences(sequences: &[SequenceRow]) -> BTreeMap<(Stratum, Outcome, Outcome), String> {
    let mut differing: BTreeMap<_, Vec<&str>> = BTreeMap::new();
    let told = |sequence: &&SequenceRow| {
        sequence.twin == sequence.live || sequence.is_missed() || sequence.live == Outcome::Invalid
    };
    for sequence in sequences.iter().filter(|sequence| !told(sequence)) {
        differing.entry((sequence.stratum, sequence.twin, sequence.live)).or_default().push(&sequence.name);
    }
    differing.into_iter().map(|(key, names)| (key, names.join(", "))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sequence(stratum: Stratum, twin: Outcome, live: Outcome) -> SequenceRow {
        let text = |text: &str| text.to_owned();
        SequenceRow {
            name: text("finding-1"),
            stratum,
            of: text("lease-path"),
            sequence: text("cut"),
            twin,
            live,
            findings: vec![text("P4 left the geofence")],
            reproduce: text("holdsafe run finding-1.toml"),
        }
    }

    /// It is counted apart.
    #[test]
    fn invalid_live_run_lowers_the_second_bound_only() {
        let valid = (0..20).map(|_| sequence(Stratum::Safe, Outcome::HoldSafe, Outcome::HoldSafe));
        let sequences: Vec<_> = valid.chain([sequence(Stratum::Safe, Outcome::HoldSafe, Outcome::Invalid)]).collect();
        let row = StratumRow::from_sequences(Stratum::Safe, &sequences);
        assert_eq!((row.sequences, row.invalid, row.same_class.k, row.same_class.n), (21, 1, 20, 20));
        // 20 of 20: 0.05 to the power of 1/20.
        assert!((row.same_class.lower_95 - 0.8609).abs() < 5e-5);
        assert_eq!(row.same_class.lower_95_with_invalid, rate_lower(20, 21, LEVEL));
        assert!(row.same_class.lower_95_with_invalid < row.same_class.lower_95);
        assert_eq!(StratumRow::from_sequences(Stratum::Edge, &sequences).sequences, 0);
    }

    #[test]
    fn different_classes_may_agree_on_breaking() {
        let sequences = [
            sequence(Stratum::Finding, Outcome::Unsafe, Outcome::Late),
            sequence(Stratum::Finding, Outcome::Unsafe, Outcome::Late),
            sequence(Stratum::Finding, Outcome::Late, Outcome::Late),
            sequence(Stratum::Finding, Outcome::Late, Outcome::HoldSafe),
            sequence(Stratum::Finding, Outcome::Unsafe, Outcome::Degraded),
        ];
        let row = StratumRow::from_sequences(Stratum::Finding, &sequences);
        assert_eq!((row.unsafe_or_not.k, row.broken_or_not.k, row.same_class.k), (2, 3, 1));
    }

    /// Misses of the twin, with the lines that run them again.
    #[test]
    fn table_lists_missed_runs_with_their_commands() {
        let missed = sequence(Stratum::Safe, Outcome::HoldSafe, Outcome::Unsafe);
        let differs = sequence(Stratum::Edge, Outcome::Late, Outcome::HoldSafe);
        let object = AgreementObject::new(1, 1, String::new(), vec![missed, differs]);
        let text = agreement_table(&object);
        assert!(text.contains("UNSAFE live, not so in the twin: finding-1 (lease-path): cut"), "{text}");
        assert!(text.contains("P4 left the geofence") && text.contains("holdsafe run finding-1.toml"), "{text}");
        assert!(text.contains("edge: LATE in the twin, HOLD_SAFE live: finding-1"), "{text}");
    }
}
