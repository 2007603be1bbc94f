//! Claims of the results around a recorded trial: its class, and the digest of its `held.json`.
//!
//! `result.json` of `run` names both for each trial that was kept, and so do the finished trials (`trial_store`) of a command that
//! resumes. A recording in the place of another, or a class that was changed, contradicts them. A recording without results around it has
//! no claim to fit. Verification of the recording itself is left to `recording::verify`.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use evidence::trial::Outcome;
use link::files;
use results::mode::Mode;
use serde::Deserialize;

use super::failure::Failure;
use super::trial_store;

/// Folders from that of the command to a trial's, without and with a cell.
const LEVELS: [usize; 2] = [3, 4];
/// The longest result or file of finished trials that is read, bytes.
const MAX_BYTES: u64 = 256 << 20;
/// Most files of finished trials that are read.
const MAX_FILES: usize = 10_000;

/// Reason for which the results around a recording cannot be read.
#[derive(Debug, thiserror::Error)]
enum ClaimsError {
    #[error("result.json: {0}: nothing is known of this trial")]
    Result(io::Error),
    #[error("kept: {0}: nothing is known of this trial")]
    Folder(#[from] io::Error),
    #[error("kept: {0}: nothing is known of this trial")]
    Trials(#[from] Failure),
}

/// Claims of a trial, and the name of the file that has them; no file without results.
type NamedClaims = (Option<String>, Vec<Claim>);

/// The object in `result.json`, as far as it is read: a run, or several.
#[derive(Deserialize)]
struct Ran {
    #[serde(default)]
    scenario: Option<String>,
    #[serde(default)]
    mode: Option<Mode>,
    #[serde(default)]
    trials: Vec<Claim>,
    #[serde(default)]
    runs: Vec<Ran>,
}

/// A trial, as far as it is read.
#[derive(Deserialize)]
struct Claim {
    seed: u64,
    #[serde(default)]
    cell: Option<String>,
    outcome: Outcome,
    #[serde(default)]
    held: Option<String>,
}

/// A trial by the names of its folders.
struct Place {
    command: PathBuf,
    mode: Mode,
    scenario: String,
    /// With points for slashes.
    cell: Option<String>,
    seed: u64,
}

/// The contradiction between the recording in `trial` and the results around it, if any.
pub fn contradiction(trial: &Path, held: Option<&str>, outcome: Option<Outcome>) -> Option<String> {
    let whole = fs::canonicalize(trial).ok()?;
    LEVELS
        .into_iter()
        .filter_map(|levels| Place::from_folder(&whole, levels))
        .find_map(|place| place.contradiction(held, outcome))
}

impl Place {
    /// The place of a trial's folder, `levels` below that of its command.
    fn from_folder(trial: &Path, levels: usize) -> Option<Self> {
        let command = trial.ancestors().nth(levels)?;
        let names: Vec<&str> = trial.strip_prefix(command).ok()?.iter().filter_map(|name| name.to_str()).collect();
        let (mode, scenario, cell, seed) = match names.as_slice() {
            [mode, scenario, seed] => (mode, scenario, None, seed),
            [mode, scenario, cell, seed] => (mode, scenario, Some((*cell).to_owned()), seed),
            _ => return None,
        };
        let mode = [Mode::Twin, Mode::Live].into_iter().find(|known| known.name() == *mode)?;
        let (command, scenario) = (command.to_owned(), (*scenario).to_owned());
        Some(Self { command, mode, scenario, cell, seed: seed.parse().ok()? })
    }

    fn contradiction(&self, held: Option<&str>, outcome: Option<Outcome>) -> Option<String> {
        let (file, claims) = match self.claims() {
            Ok((file, claims)) => (file, claims),
            Err(error) => return Some(error.to_string()),
        };
        let file = file?;
        let named: Vec<&Claim> = claims.iter().filter(|claim| claim.held.is_some()).collect();
        if named.is_empty() {
            return Some(format!("{file} names no recording of this trial"));
        }
        let Some(claim) = named.iter().find(|claim| claim.held.as_deref() == held) else {
            let expected = named[0].held.as_deref().unwrap_or_default();
            return Some(format!(
                "{file} names another recording of this trial, whose held.json has SHA-256 {expected}"
            ));
        };
        let recorded = outcome?;
        let differs = || format!("{file} says {}, the recording {}", claim.outcome.name(), recorded.name());
        (claim.outcome != recorded).then(differs)
    }

    fn claims(&self) -> Result<NamedClaims, ClaimsError> {
        let (result, store) = (self.command.join("result.json"), self.command.join("kept"));
        if result.is_file() {
            let read = || -> io::Result<Ran> { Ok(serde_json::from_slice(&files::read(&result, MAX_BYTES)?)?) };
            let ran = read().map_err(ClaimsError::Result)?;
            // A result of another kind names no trials.
            if ran.mode.is_some() {
                return Ok((Some("result.json".to_owned()), self.claims_in_runs(ran)));
            }
        }
        if store.is_dir() { self.claims_in_store(&store) } else { Ok((None, Vec::new())) }
    }

    fn claims_in_runs(&self, ran: Ran) -> Vec<Claim> {
        let one_or_more = if ran.runs.is_empty() { vec![ran] } else { ran.runs };
        let fits = |ran: &Ran| ran.mode == Some(self.mode) && ran.scenario.as_deref() == Some(&self.scenario);
        let trials = one_or_more.into_iter().filter(fits).flat_map(|ran| ran.trials);
        trials.filter(|claim| self.is_of(claim)).collect()
    }

    fn is_of(&self, claim: &Claim) -> bool {
        claim.seed == self.seed && claim.cell.as_ref().map(|cell| cell.replace('/', ".")) == self.cell
    }

    /// Claims of the finished trials, which are in a file for each variation, mode, policy and program.
    fn claims_in_store(&self, store: &Path) -> Result<NamedClaims, ClaimsError> {
        let (before, mode) = (format!("{}.", self.scenario), format!(".{}.", self.mode.name()));
        let mut claims = Vec::new();
        for entry in fs::read_dir(store)?.take(MAX_FILES) {
            let path = entry?.path();
            let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            if !name.starts_with(&before) || !name.contains(&mode) || !name.ends_with(".jsonl") {
                continue;
            }
            let text = files::read(&path, MAX_BYTES)?;
            for trial in trial_store::finished(&text)?.into_values() {
                let claim = Claim { seed: trial.seed, cell: trial.cell, outcome: trial.outcome, held: trial.held };
                if self.is_of(&claim) {
                    claims.push(claim);
                }
            }
        }
        Ok(((!claims.is_empty()).then(|| "kept".to_owned()), claims))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The contradiction between a recording's folder below a command's, and a result that names it with this class and digest.
    fn contradiction_of(class: &str, digest: &str, held: &str) -> Option<String> {
        let folder = tempfile::tempdir().unwrap();
        let trial = folder.path().join("twin/teammate/verbatim.present/7");
        fs::create_dir_all(&trial).unwrap();
        let result = format!(
            r#"{{"kind":"run","scenario":"teammate","mode":"twin","trials":[
                {{"seed":6,"cell":"verbatim/present","outcome":"UNSAFE","held":"{held}"}},
                {{"seed":7,"cell":"verbatim/silent","outcome":"UNSAFE","held":"{held}"}},
                {{"seed":7,"cell":"verbatim/present","outcome":"{class}","held":"{digest}"}}]}}"#
        );
        fs::write(folder.path().join("result.json"), result).unwrap();
        contradiction(&trial, Some(held), Some(Outcome::HoldSafe))
    }

    #[test]
    fn class_and_digest_of_a_result_are_compared() {
        assert_eq!(contradiction_of("HOLD_SAFE", "ab", "ab"), None);
        assert_eq!(contradiction_of("UNSAFE", "ab", "ab").unwrap(), "result.json says UNSAFE, the recording HOLD_SAFE");
        assert!(contradiction_of("HOLD_SAFE", "cd", "ab").unwrap().contains("names another recording"));
        assert!(contradiction_of("HOLD_SAFE", "", "ab").unwrap().contains("names another recording"));
    }

    #[test]
    fn recording_that_no_result_names_is_reported() {
        let folder = tempfile::tempdir().unwrap();
        let trial = folder.path().join("live/loss/3");
        fs::create_dir_all(&trial).unwrap();
        assert_eq!(contradiction(&trial, Some("ab"), None), None, "no result claims anything");
        let result = r#"{"kind":"runs","mode":"live","runs":[{"scenario":"loss","mode":"live","trials":[{"seed":4,"outcome":"LATE","held":"ab"}]}]}"#;
        fs::write(folder.path().join("result.json"), result).unwrap();
        assert_eq!(contradiction(&trial, Some("ab"), None).unwrap(), "result.json names no recording of this trial");
        fs::write(folder.path().join("result.json"), r#"{"kind":"tour"}"#).unwrap();
        assert_eq!(contradiction(&trial, Some("ab"), None), None, "a result of another kind names no trials");
    }
}
