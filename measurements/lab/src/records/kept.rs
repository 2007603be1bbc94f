//! One measurement as it is kept: its figures, its origin, and the digest of the results that they come from.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

/// Version of the form.
pub const VERSION: u32 = 1;

/// A record.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kept {
    /// [`VERSION`].
    pub version: u32,
    /// The commands as they were run.
    pub run: Vec<String>,
    /// The commit of the program, with a plus where its sources were changed.
    pub commit: String,
    /// SHA-256 over the sources of the program.
    pub sources: String,
    /// Processor, cores, and memory.
    pub host: String,
    /// First seed.
    pub seed: u64,
    /// Day on which it ended, in UTC: `2026-11-29`.
    pub day: String,
    /// Duration.
    pub seconds: f64,
    /// One of each command's results.
    pub results: Vec<Raw>,
    /// The sentence, with its numbers.
    pub figure: String,
    /// Sample and interval.
    pub sample: String,
    /// Each comparison of the list, with its truth.
    pub claims: Vec<Claim>,
    /// Sentences of other pages, with their numbers.
    pub quotes: Vec<Quoted>,
}

/// A command's results.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Raw {
    /// Exit code.
    pub exit: i32,
    /// Length in bytes.
    pub bytes: u64,
    /// SHA-256 of what it printed.
    pub sha256: String,
}

/// A comparison that the list asks for.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Claim {
    /// The comparison.
    pub claim: String,
    /// Its truth.
    pub holds: bool,
}

/// A sentence of another page.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quoted {
    /// The page, below the repository.
    pub page: String,
    /// The sentence.
    pub text: String,
}

/// File of the record `name` in this folder.
pub fn file(folder: &Path, name: &str) -> PathBuf {
    folder.join("records").join(format!("{name}.json"))
}

/// The record `name`, if it was taken.
///
/// # Errors
/// The file is no record.
pub fn read(folder: &Path, name: &str) -> Result<Option<Kept>, String> {
    let path = file(folder, name);
    match fs::read_to_string(&path) {
        Ok(text) => serde_json::from_str(&text).map(Some).map_err(|error| format!("{}: {error}", path.display())),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(format!("{}: {error}", path.display())),
    }
}
