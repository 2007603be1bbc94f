//! `verdict.json`: how a trial ended, with class, receipt and findings as the command prints them.
//!
//! The oracle gave the class at the end of the trial. Judging is left to `oracle`, and the check that the file is unchanged to
//! [`crate::anchors`].

use std::io::Write;

use evidence::SCHEMA_VERSION;
use evidence::trial::{Outcome, Trial};
use link::files;
use serde::{Deserialize, Serialize};

use crate::layout::RunFolder;

/// The longest `verdict.json` that is read, bytes.
const MAX_VERDICT_BYTES: u64 = 1 << 20;

/// How a trial ended: the object in `verdict.json`, its fields in the order of their names.
#[derive(Debug, Serialize, Deserialize)]
pub struct RecordedVerdict {
    /// Reasons for the class.
    pub findings: Vec<String>,
    /// `verdict`.
    pub kind: String,
    /// The class that the oracle gave.
    pub outcome: Outcome,
    /// True if every injection has its receipt.
    pub receipt: bool,
    /// Version of this object.
    pub schema_version: u32,
    /// The seed that reproduces the trial.
    pub seed: u64,
}

impl RecordedVerdict {
    /// The verdict of this trial.
    pub fn from_trial(trial: &Trial) -> Self {
        let Trial { seed, outcome, receipt, findings, .. } = trial;
        Self {
            findings: findings.clone(),
            kind: "verdict".to_owned(),
            outcome: *outcome,
            receipt: *receipt,
            schema_version: SCHEMA_VERSION,
            seed: *seed,
        }
    }

    /// Writes it into the folder of the run.
    ///
    /// # Errors
    /// The file is there already or cannot be written.
    pub fn write(&self, run: &RunFolder) -> std::io::Result<()> {
        files::create(&run.verdict())?.write_all(&serde_json::to_vec_pretty(self)?)
    }
}

/// The recorded class of the trial, and the reason for which it is no evidence; `None` where there is none.
pub fn recorded_class(run: &RunFolder) -> (Option<Outcome>, Option<String>) {
    let file = run.verdict();
    if !file.exists() {
        return (None, None);
    }
    let read =
        || -> std::io::Result<RecordedVerdict> { Ok(serde_json::from_slice(&files::read(&file, MAX_VERDICT_BYTES)?)?) };
    match read() {
        Ok(RecordedVerdict { outcome: Outcome::Invalid, findings, .. }) => {
            (Some(Outcome::Invalid), Some(invalid_reason(findings.first())))
        }
        Ok(RecordedVerdict { outcome, .. }) => (Some(outcome), None),
        Err(error) => (None, Some(format!("{}: {error}: the class of the trial is not known", RunFolder::VERDICT))),
    }
}

/// The reason for which a trial that ended INVALID with this first finding is no evidence.
pub fn invalid_reason(first_finding: Option<impl std::fmt::Display>) -> String {
    let reason = first_finding.map_or_else(|| "an injection has no receipt".to_owned(), |finding| finding.to_string());
    format!("the trial itself ended INVALID: {reason}")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The golden file of version 1.
    const GOLDEN: &str = include_str!("../tests/golden/verdict-v1.json");

    #[test]
    fn golden_file_is_read_and_written_to_the_byte() {
        let verdict: RecordedVerdict = serde_json::from_str(GOLDEN).unwrap();
        assert_eq!(serde_json::to_string_pretty(&verdict).unwrap() + "\n", GOLDEN);
        let trial = Trial { findings: verdict.findings, ..Trial::example(verdict.seed, verdict.outcome) };
        assert_eq!(serde_json::to_string_pretty(&RecordedVerdict::from_trial(&trial)).unwrap() + "\n", GOLDEN);
    }
}
