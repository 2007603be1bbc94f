//! Reasons for which a recorded run is not found or cannot be read.
//!
//! A run that can be read and does not verify is no error: its findings are in [`crate::verify::VerifiedRun`]. Exit codes are left to
//! the command.

use std::io;
use std::path::PathBuf;

/// Remedy of a path that leads to no folder of a run.
pub(crate) const NAME_ONE_RUN: &str = "name the directory of one run, with `recording/` and `held.json` in it";

/// A recorded run is not found, or cannot be read at all.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The path leads to no recorded run, or to several where one is required.
    #[error("{}: {message}", path.display())]
    NotOneRun {
        /// The path as it was given.
        path: PathBuf,
        /// The fault and its remedy.
        message: String,
    },
    /// More folders are below the path than the search reads.
    #[error("more than {most} folders below {}; name the directory of one run", path.display())]
    TooManyFolders {
        /// The path, or the folder below it at which the search ended.
        path: PathBuf,
        /// Folders that the search reads at most.
        most: usize,
    },
    /// `held.json` cannot be read: nothing of the run can be verified.
    #[error("{}: {message}; {NAME_ONE_RUN}", file.display())]
    NoAnchors {
        /// Its path.
        file: PathBuf,
        /// The fault.
        message: String,
    },
    /// Another file of the run cannot be used.
    #[error("{}: {message}; {remedy}", file.display())]
    Unreadable {
        /// The file or folder.
        file: PathBuf,
        /// The fault, with the line or offset.
        message: String,
        /// Remedy.
        remedy: String,
    },
    /// The operating system refused to read a file of the recording.
    #[error(transparent)]
    Io(#[from] io::Error),
}

impl RecordingError {
    /// A file or folder that is not of a run.
    pub(crate) fn not_a_run(file: PathBuf, error: impl std::fmt::Display) -> Self {
        Self::Unreadable { file, message: error.to_string(), remedy: NAME_ONE_RUN.to_owned() }
    }
}
