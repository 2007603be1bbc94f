//! Recorded runs as arguments of a command: found, opened by [`Checked`] and held against the results around them; the line and the exit
//! code of one that is INVALID.
//!
//! The first line of every command that reads an INVALID run says so, with the reason; so does the object of `--json`
//! (`recordings`); and the exit code is 4, or with `--unverified` the command's own. Verification is left to `recording`.

use std::path::Path;

use recording::checked::RunVerification;
use recording::find::{find_one_run, find_runs};
use recording::{Checked, RunFolder};
use serde::Serialize;

use super::failure::{Exit, Failure};
use super::{Context, claimed, out};

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

/// Opens the run in this folder, and holds it against the results around it.
///
/// # Errors
/// When it cannot be read at all.
pub fn open_run(folder: RunFolder) -> Result<Checked, Failure> {
    Ok(Checked::open(folder, claimed::contradiction)?)
}

/// Names the INVALID inputs before any other output: on stdout, or where that is for the object, on stderr.
pub fn print_marks(context: &Context, read: &[&Checked]) {
    read.iter().filter_map(|of| of.mark()).for_each(|mark| print_mark(context, &mark));
}

/// The same of one, by its line.
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
