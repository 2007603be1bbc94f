//! Verification before reading: the only way by which a command reads a recorded run.
//!
//! Only this module constructs a [`Checked`], after [`verify_run`]; every reader of a recorded log takes one. A run is
//! INVALID when its recording does not verify, when its trial ended INVALID, or when the results around it contradict it. Finding the
//! run is left to [`crate::find`]; messages and the exit code are left to the command.

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

use evidence::log::hex;
use evidence::trial::Outcome;
use link::files;
use serde::Serialize;
use sha2::{Digest, Sha256};
use wire::plain;

use crate::error::RecordingError;
use crate::layout::RunFolder;
use crate::read::FileDigests;
use crate::verdict::recorded_class;
use crate::verify::{VerifiedRun, verify_run};

/// Bytes that are hashed at most of a file of a recording without a known length.
const MAX_RECORDING_BYTES: u64 = 1 << 30;
/// The longest reason, characters.
const MAX_REASON: usize = 400;

/// Verification result of a recording.
#[derive(Clone, Debug, Serialize)]
pub struct RunVerification {
    /// The folder of its trial.
    pub run: String,
    /// SHA-256 of the recording's files, one behind the other, each as long as `held.json` says; hexadecimal.
    pub sha256: String,
    /// True if it verifies and its trial did not end INVALID.
    pub valid: bool,
    /// Reason for which it is INVALID.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// True if it verifies: `holdsafe inspect verify` reports that the evidence holds.
    pub holds: bool,
    /// The class in which its trial ended, as recorded then.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outcome: Option<Outcome>,
    /// Number of events in it.
    pub events: u64,
}

/// A recorded run after verification, with any result.
#[derive(Clone, Debug)]
pub struct Checked {
    folder: RunFolder,
    anchors_sha256: Option<String>,
    verification: RunVerification,
    digests: FileDigests,
}

impl Checked {
    /// Verifies the run in `folder`. `contradiction` returns the contradiction between a run and the results of the command around it, if
    /// any; it gets the path of the run, the SHA-256 of its `held.json` and its recorded class. Commands pass `runner::claims::contradiction`.
    ///
    /// # Errors
    /// When the run cannot be read at all. A run that does not verify, and one without trust anchors, is INVALID and no error.
    pub fn open(
        folder: RunFolder,
        contradiction: impl FnOnce(&Path, Option<&str>, Option<Outcome>) -> Option<String>,
    ) -> Result<Self, RecordingError> {
        let (events, sealed, findings, anchors_sha256, digests) = match verify_run(&folder) {
            Ok(VerifiedRun { events, sealed, findings, anchors_sha256, digests, .. }) => {
                (events, sealed, findings, Some(anchors_sha256), digests)
            }
            // Without keys and heads the recording cannot be verified, which is no better than a failed verification.
            Err(RecordingError::NoAnchors { message, .. }) => {
                (0, false, vec![no_anchors(&message)], None, FileDigests::new())
            }
            Err(error) => return Err(error),
        };
        let (outcome, ended_invalid) = recorded_class(&folder);
        let contradiction = || contradiction(folder.path(), anchors_sha256.as_deref(), outcome);
        let reason = unsound(sealed, &findings, folder.path()).or(ended_invalid).or_else(contradiction);
        let reason = reason.map(|reason| on_one_line(&reason));
        let (run, sha256) = (folder.path().display().to_string(), recording_sha256(&folder, &digests)?);
        let holds = sealed && findings.is_empty();
        let verification = RunVerification { run, sha256, valid: reason.is_none(), reason, holds, outcome, events };
        Ok(Self { folder, anchors_sha256, verification, digests })
    }

    /// The folder of the run.
    pub fn folder(&self) -> &RunFolder {
        &self.folder
    }

    /// The path of that folder.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Digests of its files, as they were verified.
    pub(crate) fn digests(&self) -> &FileDigests {
        &self.digests
    }

    /// SHA-256 of its `held.json`, hexadecimal; `None` where that cannot be read.
    pub fn anchors_sha256(&self) -> Option<&str> {
        self.anchors_sha256.as_deref()
    }

    /// The result.
    pub fn verification(&self) -> &RunVerification {
        &self.verification
    }

    /// Reason for which it is INVALID, if it is.
    pub fn invalid(&self) -> Option<&str> {
        self.verification.reason.as_deref()
    }

    /// The line that reports an INVALID run, if it is one.
    pub fn mark(&self) -> Option<String> {
        Some(format!("INVALID: {}: {}", self.path().display(), self.invalid()?))
    }
}

/// The finding of a run whose trust anchors cannot be read.
fn no_anchors(message: &str) -> String {
    format!("{}: {message}: without it nothing is verified; is the run over?", RunFolder::ANCHORS)
}

/// Faults of a recording.
fn unsound(sealed: bool, findings: &[String], path: &Path) -> Option<String> {
    let first = findings.first().map(String::as_str);
    let first = first.or((!sealed).then_some("TRUNCATED: no closing seal"))?;
    let more = match findings.len() {
        0 | 1 => String::new(),
        n => format!("; {} more: `holdsafe inspect verify {}`", n - 1, path.display()),
    };
    Some(format!("the recording does not verify: {first}{more}"))
}

/// SHA-256 of the log's files, in the order of their numbers, each up to the length in `held.json`: a file that grew since costs no more
/// time.
fn recording_sha256(run: &RunFolder, digests: &FileDigests) -> Result<String, RecordingError> {
    let mut parts: Vec<PathBuf> = Vec::new();
    for entry in fs::read_dir(run.recording())? {
        let path = entry?.path();
        if path.is_file() && path.extension().is_some_and(|e| e == "mcap") {
            parts.push(path);
        }
    }
    // The shorter name first: `audit-10` comes after `audit-9`.
    parts.sort_by_key(|file| (file.as_os_str().len(), file.clone()));
    let mut digest = Sha256::new();
    for file in parts {
        let name = file.strip_prefix(run.path()).map(|name| name.display().to_string()).unwrap_or_default();
        let most = digests.get(&name).map_or(MAX_RECORDING_BYTES, |file| file.bytes);
        std::io::copy(&mut files::open(&file)?.take(most), &mut digest)?;
    }
    Ok(hex(&digest.finalize()))
}

/// Text of possibly foreign origin on one line, of bounded length, without terminal control characters.
pub fn on_one_line(text: &str) -> String {
    text.chars().map(plain::shown).take(MAX_REASON).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recording_without_closing_seal_is_unsound() {
        let found = |sealed| unsound(sealed, &[], Path::new("x"));
        assert!(found(false).is_some_and(|reason| reason.contains("TRUNCATED")));
        assert_eq!(found(true), None);
    }

    #[test]
    fn run_without_anchors_is_invalid() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("recording")).unwrap();
        let checked = Checked::open(RunFolder::new(folder.path()), |_, _, _| None).unwrap();
        assert!(checked.mark().unwrap().starts_with("INVALID: ") && checked.invalid().unwrap().contains("held.json"));
        assert!(!checked.verification().valid && checked.anchors_sha256().is_none());
    }

    #[test]
    fn foreign_words_stay_on_one_line() {
        let reason = on_one_line(&format!("a\u{1b}[2J\nb{}", "c".repeat(1_000)));
        assert!(!reason.contains(['\n', '\u{1b}']) && reason.chars().count() == MAX_REASON, "{reason}");
    }
}
