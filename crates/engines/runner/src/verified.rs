//! Integrity of a run's files: every byte against `held.json`, then chains, seals, signatures and heads.

use std::path::{Path, PathBuf};

use evidence::log::{Logged, by_recorder};
use evidence::verification::{Held, LogVerifier};
use link::instrument::Frame;
use live::store;
use serde::Serialize;

use crate::error::EngineError;

/// Integrity of a run's evidence.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verified {
    /// SHA-256 of `held.json`, hexadecimal: the same as when the run was made, or the whole directory may be another's.
    pub held: String,
    /// Files that are covered, each to the last byte.
    pub files: u64,
    /// Parts without cover, in a directory of a program that did not cover them.
    pub uncovered: Vec<String>,
    /// Events in the log.
    pub events: u64,
    /// Head of the chain, hexadecimal.
    pub head: String,
    /// Heads held outside the recorder that it was set against.
    pub heads: u64,
    /// True if the closing seal is there; without it the log is TRUNCATED.
    pub sealed: bool,
    /// Faults, each with its position.
    pub findings: Vec<String>,
}

/// Every entry of the recording of `run`, in the order in which it came.
///
/// # Errors
/// It is no run directory, or has no recording.
pub fn frames(run: &Path) -> Result<Vec<Frame>, EngineError> {
    readable(run)?;
    // Bytes behind those that the run left are a finding, and no part of it.
    let lengths = store::read_held(run).ok().and_then(|(held, _)| held.files).unwrap_or_default();
    let length = |name: &str| lengths.get(&format!("recording/{name}")).map(|held| held.bytes);
    link::recorded::frames_within(&run.join("recording"), length).map_err(|e| not_a_run(run.to_owned(), e.to_string()))
}

fn not_a_run(file: PathBuf, message: String) -> EngineError {
    let remedy = "name the directory of one run, with `recording/` and `held.json` in it".to_owned();
    EngineError::Unreadable { file, message, remedy }
}

/// Checks every file of the run in `run` to the last byte, then chains, seals, signatures and heads, by the trust anchors in the
/// file beside them.
pub fn verify(run: &Path) -> Result<Verified, EngineError> {
    readable(run)?;
    let (held, digest) = store::read_held(run).map_err(|e| not_a_run(run.join(store::HELD), e.to_string()))?;
    let differences = held.files.as_ref().map(|files| store::whole::differences(run, files)).transpose();
    let mut findings = differences.map_err(|e| not_a_run(run.to_owned(), e.to_string()))?.unwrap_or_default();
    let log = match logged(run, held.knows_witnesses()) {
        // A changed or missing file is among the findings already.
        Err(_) if !findings.is_empty() => Vec::new(),
        log => log?,
    };
    let mut log_verifier = LogVerifier::new(&held);
    for Logged { at, node, bytes } in &log {
        // The verifier lists every entry that does not continue its chain.
        let _noted = log_verifier.take(*at, *node, bytes);
    }
    let verification = log_verifier.close();
    findings.extend(verification.flaws.iter().map(ToString::to_string));
    Ok(Verified {
        held: digest,
        files: held.files.as_ref().map_or(0, |files| files.len() as u64),
        uncovered: uncovered(&held),
        events: verification.events as u64,
        head: verification.head,
        heads: held.heads.len() as u64,
        sealed: verification.sealed || held.cut_short,
        findings,
    })
}

/// Entries of the recorder, and behind them, where they sign them, the own logs of guards and launcher.
fn logged(run: &Path, witnesses: bool) -> Result<Vec<Logged>, EngineError> {
    let frames = frames(run)?.into_iter().filter(|frame| witnesses || by_recorder(frame.node));
    let mut log: Vec<Logged> = frames.map(|f| Logged { at: f.trace_us, node: f.node, bytes: f.bytes }).collect();
    if witnesses {
        log.extend(live::own_logs(run).map_err(|e| not_a_run(run.to_owned(), e.to_string()))?);
    }
    Ok(log)
}

/// Gaps of a directory of an earlier program.
fn uncovered(held: &Held) -> Vec<String> {
    let files = "bytes that are in no entry, and every file but the recording: held.json lists no file";
    let witnesses = "what guards saw and the launcher noted: held.json has no key and no head of theirs";
    let open = [(held.files.is_none(), files), (!held.knows_witnesses(), witnesses)];
    open.into_iter().filter(|(open, _)| *open).map(|(_, what)| what.to_owned()).collect()
}

fn readable(run: &Path) -> Result<(), EngineError> {
    if run.is_dir() {
        return Ok(());
    }
    let message = if run.exists() { "not a run directory" } else { "no such run directory" };
    let remedy = "name the directory that `run --live --out DIR` made".to_owned();
    Err(EngineError::Unreadable { file: run.to_owned(), message: message.to_owned(), remedy })
}
