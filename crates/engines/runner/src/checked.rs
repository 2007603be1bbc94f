//! Recorded runs as arguments of a command: found, opened by [`Checked`] and compared with the results around them; the line and the exit
//! code of an INVALID one.
//!
//! The first line of every command that reads an INVALID run reports it with the reason, as the object of `--json` does (`recordings`). The
//! exit code is 4, or with `--unverified` that of the command. Verification is left to `recording`.

use std::path::Path;

use recording::checked::RunVerification;
use recording::find::{find_one_run, find_runs};
use recording::{Checked, RunFolder};
use serde::Serialize;

use super::failure::{Exit, Failure};
use super::{Context, claims, out};

/// Treatment of a recording that fails verification.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct Unverified {
    /// Of a recorded run that is INVALID: end with this command's own exit code and not with 4. The run is reported as
    /// INVALID all the same.
    #[arg(long)]
    unverified: bool,
}

impl Unverified {
    /// Exit code of a command that reads these and would end with `valid`.
    pub fn exit(self, read: &[&Checked], valid: Exit) -> Exit {
        if read.iter().all(|run| run.invalid().is_none()) { valid } else { self.with_invalid(valid) }
    }

    /// Exit code of a command that reads INVALID input and would end with `valid`.
    pub fn with_invalid(self, valid: Exit) -> Exit {
        if self.unverified { valid } else { Exit::NoEvidence }
    }
}

/// Opens the one run at or below `dir`.
///
/// # Errors
/// When there is none or several, or its recording cannot be read at all.
pub fn open_one_run(dir: &Path) -> Result<Checked, Failure> {
    open_run(find_one_run(dir)?)
}

/// Opens every run at or below `dir`.
///
/// # Errors
/// When one cannot be read at all.
pub fn open_runs(dir: &Path) -> Result<Vec<Checked>, Failure> {
    find_runs(dir)?.into_iter().map(open_run).collect()
}

/// Opens the run in this folder, and compares it with the results around it.
///
/// # Errors
/// When it cannot be read at all.
pub fn open_run(folder: RunFolder) -> Result<Checked, Failure> {
    Ok(Checked::open(folder, claims::contradiction)?)
}

/// Prints the INVALID inputs before any other output: on stdout, or on stderr where stdout is for the object.
pub fn print_marks(context: &Context, read: &[&Checked]) {
    read.iter().filter_map(|run| run.mark()).for_each(|mark| print_mark(context, &mark));
}

/// Prints the line of one INVALID input.
pub fn print_mark(context: &Context, mark: &str) {
    if context.json {
        link::note!("{mark}");
    } else {
        out::say(format_args!("{mark}"));
    }
}

/// A result, and the verification of its recordings.
#[derive(Serialize)]
struct WithRecordings<'a, T> {
    #[serde(flatten)]
    result: &'a T,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    recordings: &'a [&'a RunVerification],
}

/// Prints a result that was made of these as one JSON object on stdout.
///
/// # Errors
/// When a number in it cannot be written as JSON.
pub fn print_json(kind: &'static str, result: &impl Serialize, read: &[&Checked]) -> Result<(), Failure> {
    let recordings: Vec<&RunVerification> = read.iter().map(|checked| checked.verification()).collect();
    out::print_json(kind, &WithRecordings { result, recordings: &recordings })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Exit codes without and with `--unverified`.
    #[test]
    fn invalid_input_makes_every_exit_code_4() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("recording")).unwrap();
        let broken = open_run(RunFolder::new(folder.path())).unwrap();
        assert!(broken.invalid().is_some(), "without keys and heads nothing is verified");
        let exit = |unverified, read: &[&Checked]| Unverified { unverified }.exit(read, Exit::Unexpected);
        assert_eq!(exit(false, &[]), Exit::Unexpected);
        assert_eq!(exit(false, &[&broken]), Exit::NoEvidence);
        assert_eq!(exit(true, &[&broken]), Exit::Unexpected);
    }
}
