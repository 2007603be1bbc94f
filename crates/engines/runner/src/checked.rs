//! Log verification comes first: the one way from a directory to a recorded run, for every command that reads one.
//!
//! A [`Checked`] is made here alone, after [`crate::verified::verify`]; every reader of a recording takes one. A run is
//! INVALID when its recording does not verify, or when its trial ended so. Then the first line of every command says
//! so, with the reason; so does the object of `--json` (`recordings`); and the exit code is 4, or with `--unverified`
//! the command's own.

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

use evidence::log::hex;
use evidence::trial::Outcome;
use link::files;
use live::store;
use live::store::verdict::{self, Ended};
use serde::Serialize;
use sha2::{Digest, Sha256};
use wire::plain;

use super::failure::{Exit, Failure};
use super::{Context, claimed, out, runs};
use crate::error::EngineError;
use crate::verified::Verified;

/// The most that is read of it.
const MAX_VERDICT_BYTES: u64 = 1 << 20;
/// The most that is hashed of a file of a recording without a known length.
const MAX_RECORDING_BYTES: u64 = 1 << 30;
/// The longest reason, characters.
const MAX_REASON: usize = 400;

/// Treatment of a recording that fails verification.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct Unverified {
    /// Of a recorded run that is INVALID: end with this command's own exit code and not with 4. The run is reported as
    /// INVALID all the same.
    #[arg(long)]
    unverified: bool,
}

impl Unverified {
    /// Exit code of a command that reads these and would end with `own`.
    pub fn exit(self, read: &[&Checked], own: Exit) -> Exit {
        if read.iter().all(|of| of.invalid().is_none()) { own } else { self.of_invalid(own) }
    }

    /// Exit code of a command that reads INVALID input and would end with `own`.
    pub fn of_invalid(self, own: Exit) -> Exit {
        if self.unverified { own } else { Exit::NoEvidence }
    }
}

/// Verification result of a recording.
#[derive(Clone, Debug, Serialize)]
pub struct RunVerification {
    /// The folder of its trial.
    pub run: String,
    /// SHA-256 of the recording's files, one behind the other, each as long as `held.json` says.
    pub sha256: String,
    /// It verifies, and its trial did not end INVALID.
    pub valid: bool,
    /// Reason for which it is INVALID.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// It verifies: `holdsafe inspect verify` says that the evidence holds.
    pub holds: bool,
    /// The class in which its trial ended, as recorded then.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outcome: Option<Outcome>,
    /// Events in it.
    pub events: u64,
}

/// A recorded run after verification, with any result.
#[derive(Clone, Debug)]
pub struct Checked {
    path: PathBuf,
    verification: RunVerification,
}

impl Checked {
    /// The folder of its trial.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The result.
    pub fn verification(&self) -> &RunVerification {
        &self.verification
    }

    /// Reason for which it is INVALID, if it is.
    pub fn invalid(&self) -> Option<&str> {
        self.verification.reason.as_deref()
    }

    /// The line that says so, if it is.
    pub fn mark(&self) -> Option<String> {
        Some(format!("INVALID: {}: {}", self.path.display(), self.invalid()?))
    }
}

/// Checks the one run at or below `dir`.
///
/// # Errors
/// When there is none or several, or its recording cannot be read at all.
pub fn run(dir: &Path) -> Result<Checked, Failure> {
    trial(runs::one(dir)?)
}

/// Checks every run at or below `dir`.
///
/// # Errors
/// When one cannot be read at all.
pub fn every(dir: &Path) -> Result<Vec<Checked>, Failure> {
    runs::below(dir)?.into_iter().map(trial).collect()
}

fn trial(path: PathBuf) -> Result<Checked, Failure> {
    let (events, sealed, findings, held) = match crate::verified::verify(&path) {
        Ok(Verified { events, sealed, findings, held, .. }) => (events, sealed, findings, Some(held)),
        // Without keys and heads the recording cannot be verified, which is no better than a failed verification.
        Err(EngineError::Unreadable { file, message, .. }) if file.ends_with(store::HELD) => (
            0,
            false,
            vec![format!("{}: {message}: without it nothing is verified; is the run over?", store::HELD)],
            None,
        ),
        Err(error) => return Err(error.into()),
    };
    let (outcome, ended) = ended(&path);
    let claimed = || claimed::contradiction(&path, held.as_deref(), outcome);
    let reason = unsound(sealed, &findings, &path).or(ended).or_else(claimed).map(|reason| tame(&reason));
    let (run, sha256) = (path.display().to_string(), digest(&path)?);
    let holds = sealed && findings.is_empty();
    let verification = RunVerification { run, sha256, valid: reason.is_none(), reason, holds, outcome, events };
    Ok(Checked { path, verification })
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

/// The class in which the trial ended, and the reason for which that is no evidence; `None` where it is not recorded.
pub fn ended(path: &Path) -> (Option<Outcome>, Option<String>) {
    let file = path.join(verdict::FILE);
    if !file.exists() {
        return (None, None);
    }
    let read = || -> std::io::Result<Ended> { Ok(serde_json::from_slice(&files::read(&file, MAX_VERDICT_BYTES)?)?) };
    match read() {
        Ok(Ended { outcome: Outcome::Invalid, findings, .. }) => {
            (Some(Outcome::Invalid), Some(ended_invalid(findings.first())))
        }
        Ok(Ended { outcome, .. }) => (Some(outcome), None),
        Err(why) => (None, Some(format!("{}: {why}: the class of the trial is not known", verdict::FILE))),
    }
}

/// The contradiction between the recording in `trial`, with this digest of its `held.json` and this class, and the results of
/// the command that made it, if any.
pub fn contradiction(trial: &Path, held: &str, outcome: Option<Outcome>) -> Option<String> {
    claimed::contradiction(trial, Some(held), outcome)
}

/// Reason for which a trial that ended INVALID with this first finding is no evidence.
pub fn ended_invalid(first: Option<impl std::fmt::Display>) -> String {
    let why = first.map_or_else(|| "an injection has no receipt".to_owned(), |why| why.to_string());
    format!("the trial itself ended INVALID: {why}")
}

/// SHA-256 of the recording of the trial in `path`, file by file, by number: of each as many bytes as `held.json` says, so that a file
/// that grew since costs no more.
fn digest(path: &Path) -> Result<String, Failure> {
    let mut parts: Vec<PathBuf> = Vec::new();
    for entry in fs::read_dir(path.join("recording"))? {
        let path = entry?.path();
        if path.is_file() && path.extension().is_some_and(|e| e == "mcap") {
            parts.push(path);
        }
    }
    parts.sort_by_key(|file| (file.as_os_str().len(), file.clone()));
    let lengths = store::read_held(path).ok().and_then(|(held, _)| held.files).unwrap_or_default();
    let mut digest = Sha256::new();
    for file in parts {
        let name = file.strip_prefix(path).map(|name| name.display().to_string()).unwrap_or_default();
        let most = lengths.get(&name).map_or(MAX_RECORDING_BYTES, |held| held.bytes);
        std::io::copy(&mut files::open(&file)?.take(most), &mut digest)?;
    }
    Ok(hex(&digest.finalize()))
}

/// Possibly foreign text: on one line, of bounded length, without terminal control characters.
pub(crate) fn tame(text: &str) -> String {
    text.chars().map(plain::shown).take(MAX_REASON).collect()
}

/// Names the INVALID inputs before any other output: on stdout, or where that is for the object, on stderr.
pub fn say(context: &Context, read: &[&Checked]) {
    read.iter().filter_map(|of| of.mark()).for_each(|mark| say_mark(context, &mark));
}

/// The same of one, by its line.
pub fn say_mark(context: &Context, mark: &str) {
    if context.json {
        link::note!("{mark}");
    } else {
        out::say(format_args!("{mark}"));
    }
}

/// A result, and the verification of its recordings.
#[derive(Serialize)]
struct Of<'a, T> {
    #[serde(flatten)]
    of: &'a T,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    recordings: &'a [&'a RunVerification],
}

/// Prints a result that was made of these as one JSON object on stdout.
///
/// # Errors
/// When a number in it cannot be written as JSON.
pub fn print_json(kind: &'static str, of: &impl Serialize, read: &[&Checked]) -> Result<(), Failure> {
    let recordings: Vec<&RunVerification> = read.iter().map(|checked| checked.verification()).collect();
    out::print_json(kind, &Of { of, recordings: &recordings })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checked(reason: Option<&str>) -> Checked {
        let (run, sha256, reason) = ("x".to_owned(), String::new(), reason.map(str::to_owned));
        let verification =
            RunVerification { run, sha256, valid: reason.is_none(), reason, holds: true, outcome: None, events: 0 };
        Checked { path: "x".into(), verification }
    }

    /// Exit codes without and with `--unverified`.
    #[test]
    fn invalid_input_makes_every_exit_code_4() {
        let (whole, broken) = (checked(None), checked(Some("event 7")));
        let exit = |unverified, read: &[&Checked]| Unverified { unverified }.exit(read, Exit::Unexpected);
        assert_eq!(exit(false, &[&whole]), Exit::Unexpected);
        assert_eq!(exit(false, &[&whole, &broken]), Exit::NoEvidence);
        assert_eq!(exit(true, &[&whole, &broken]), Exit::Unexpected);
        assert_eq!(broken.mark().as_deref(), Some("INVALID: x: event 7"));
    }

    #[test]
    fn recording_without_closing_seal_is_unsound() {
        let found = |sealed| unsound(sealed, &[], Path::new("x"));
        assert!(found(false).is_some_and(|why| why.contains("TRUNCATED")));
        assert_eq!(found(true), None);
    }

    #[test]
    fn foreign_words_stay_on_one_line() {
        let reason = tame(&format!("a\u{1b}[2J\nb{}", "c".repeat(1_000)));
        assert!(!reason.contains(['\n', '\u{1b}']) && reason.chars().count() == MAX_REASON, "{reason}");
    }
}
