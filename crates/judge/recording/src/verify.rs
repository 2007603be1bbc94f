//! Verification of a run's folder: every byte against `held.json`, then chains, seals, signatures and heads.
//!
//! The log in memory is judged by [`crate::log`], the files by [`crate::anchors`]; this module puts the two together. The class of the
//! trial and the results around the run are left to [`crate::checked`].

use evidence::anchors::TrustAnchors;
use evidence::log::{Logged, by_recorder};
use serde::Serialize;

use crate::anchors::{file_differences, read_anchors};
use crate::error::RecordingError;
use crate::layout::RunFolder;
use crate::log::LogVerifier;
use crate::read::{FileDigests, check_directory, read_guard_logs, read_recording};

/// Integrity of a run's evidence.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VerifiedRun {
    /// SHA-256 of `held.json`, hexadecimal: equal to the one printed with the run, or the whole directory may be forged.
    #[serde(rename = "held")]
    pub anchors_sha256: String,
    /// Number of files that a digest covers.
    pub files: u64,
    /// Parts that no anchor covers, in a directory of an earlier program.
    pub uncovered: Vec<String>,
    /// Number of events in the log.
    pub events: u64,
    /// Head of the chain, hexadecimal.
    pub head: String,
    /// Number of heads held outside the recorder that the log was compared with.
    pub heads: u64,
    /// True if the closing seal is there; without it the log is TRUNCATED.
    pub sealed: bool,
    /// Faults, each with its position.
    pub findings: Vec<String>,
    /// Digests of its files.
    #[serde(skip)]
    pub(crate) digests: FileDigests,
}

impl VerifiedRun {
    /// True if the evidence holds: the log is closed and nothing is found.
    pub fn holds(&self) -> bool {
        self.sealed && self.findings.is_empty()
    }
}

/// Verifies every file of `run` to the last byte, then chains, seals, signatures and heads, by the trust anchors in the
/// file beside them. A run that does not verify has findings.
///
/// # Errors
/// When it is no run directory, or its trust anchors ([`RecordingError::NoAnchors`]) or its log cannot be read at all.
pub fn verify_run(run: &RunFolder) -> Result<VerifiedRun, RecordingError> {
    check_directory(run)?;
    let no_anchors =
        |error: std::io::Error| RecordingError::NoAnchors { file: run.anchors(), message: error.to_string() };
    let (anchors, anchors_sha256) = read_anchors(run).map_err(no_anchors)?;
    let differences = anchors.files.as_ref().map(|files| file_differences(run.path(), files)).transpose();
    let mut findings =
        differences.map_err(|error| RecordingError::not_a_run(run.path().to_owned(), error))?.unwrap_or_default();
    let digests = anchors.files.clone().unwrap_or_default();
    let log = match whole_log(run, &digests, anchors.knows_witnesses()) {
        // A changed or missing file is among the findings already.
        Err(_) if !findings.is_empty() => Vec::new(),
        log => log?,
    };
    let verification = LogVerifier::new(&anchors).verify(&log);
    findings.extend(verification.flaws.iter().map(ToString::to_string));
    Ok(VerifiedRun {
        anchors_sha256,
        files: digests.len() as u64,
        uncovered: uncovered(&anchors),
        events: verification.events as u64,
        head: verification.head,
        heads: anchors.heads.len() as u64,
        sealed: verification.sealed || anchors.cut_short,
        findings,
        digests,
    })
}

/// Entries of the recorder, followed by the own logs of guards and launcher, where they sign these.
fn whole_log(run: &RunFolder, digests: &FileDigests, witnesses: bool) -> Result<Vec<Logged>, RecordingError> {
    let mut log = read_recording(run, digests)?;
    log.retain(|logged| witnesses || by_recorder(logged.node));
    if witnesses {
        log.extend(read_guard_logs(run).map_err(|error| RecordingError::not_a_run(run.path().to_owned(), error))?);
    }
    Ok(log)
}

/// Gaps of a directory of an earlier program.
fn uncovered(anchors: &TrustAnchors) -> Vec<String> {
    let files = "bytes that are in no entry, and every file but the recording: held.json lists no file";
    let witnesses = "what guards saw and the launcher noted: held.json has no key and no head of theirs";
    let open = [(anchors.files.is_none(), files), (!anchors.knows_witnesses(), witnesses)];
    open.into_iter().filter(|(open, _)| *open).map(|(_, gap)| gap.to_owned()).collect()
}
