//! The end of a trial in its run directory: class, receipt and findings, as the command prints them.

use std::io::Write;
use std::path::Path;

use evidence::SCHEMA_VERSION;
use evidence::trial::{Outcome, Trial};
use link::files;
use serde::{Deserialize, Serialize};

/// Name of the file.
pub const FILE: &str = "verdict.json";

/// How a trial ended: the object in the file, its fields in the order of their names.
#[derive(Debug, Serialize, Deserialize)]
pub struct Ended {
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

impl Ended {
    /// The end of this trial.
    pub fn of(trial: &Trial) -> Self {
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

    /// Writes the file.
    ///
    /// # Errors
    /// The file is there already or cannot be written.
    pub fn write(&self, directory: &Path) -> std::io::Result<()> {
        files::create(&directory.join(FILE))?.write_all(&serde_json::to_vec_pretty(self)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The golden file of version 1.
    const GOLDEN: &str = include_str!("../../tests/golden/verdict-v1.json");

    #[test]
    fn golden_file_is_read_and_written_to_the_byte() {
        let ended: Ended = serde_json::from_str(GOLDEN).unwrap();
        assert_eq!(serde_json::to_string_pretty(&ended).unwrap() + "\n", GOLDEN);
        let trial = Trial { findings: ended.findings, ..Trial::example(ended.seed, ended.outcome) };
        assert_eq!(serde_json::to_string_pretty(&Ended::of(&trial)).unwrap() + "\n", GOLDEN);
    }
}
