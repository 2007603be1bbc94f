//! The error of a guest's start that this machine refuses.

use std::io;
use std::path::PathBuf;

use nix::errno::Errno;
use rustix::process::Resource;
use sandbox::StepError;

/// A guest cannot be started, or watched.
#[derive(Debug, thiserror::Error)]
pub(super) enum StartError {
    #[error("{step}: {error}")]
    Step { step: &'static str, error: io::Error },
    #[error("signals: {0}")]
    Signals(Errno),
    #[error("{}: {error}", path.display())]
    Folder { path: PathBuf, error: io::Error },
    #[error("limit {resource:?} of {most}: {error}")]
    Limit { resource: Resource, most: u64, error: io::Error },
    #[error("loopback interface: {0}")]
    Loopback(StepError),
    #[error(transparent)]
    Namespaces(#[from] StepError),
    #[error("specification: {0}")]
    Spec(serde_json::Error),
    /// `folders` says where the program was looked for.
    #[error("{program}: not found{folders}")]
    NoProgram { program: String, folders: String },
    #[error("{program}: the program that it asks for in its first line is not found")]
    NoInterpreter { program: String },
    #[error("{program}: {error}")]
    Program { program: String, error: io::Error },
    #[error(transparent)]
    Report(#[from] serde_json::Error),
    #[error(transparent)]
    Kernel(#[from] io::Error),
    #[error(transparent)]
    Signal(#[from] Errno),
}

impl From<rustix::io::Errno> for StartError {
    fn from(error: rustix::io::Errno) -> Self {
        StartError::Kernel(error.into())
    }
}

impl StartError {
    /// Conversion of the kernel's error to that of a step.
    pub(super) fn of_step<E: Into<io::Error>>(step: &'static str) -> impl Fn(E) -> StartError {
        move |error| StartError::Step { step, error: error.into() }
    }
}
