//! The error of a step of confinement, or of the making of a host, that this machine refuses.

use std::ffi::NulError;
use std::io;
use std::path::PathBuf;

use nix::errno::Errno;
use rustix::process::Resource;

/// A step that this machine refuses.
#[derive(Debug, thiserror::Error)]
pub enum StepError {
    /// A step, by its name.
    #[error("{step}: {error}")]
    Step {
        /// Name of the step.
        step: &'static str,
        /// The kernel's reason.
        error: io::Error,
    },
    /// New namespaces of this process.
    #[error("{step}: {error}")]
    Namespaces {
        /// Name of the step.
        step: &'static str,
        /// The kernel's reason.
        error: Errno,
    },
    /// A file or a folder.
    #[error("{}: {error}", path.display())]
    Path {
        /// Path of the file or folder.
        path: PathBuf,
        /// The kernel's reason.
        error: io::Error,
    },
    /// A limit by number.
    #[error("limit {resource:?} of {most}: {error}")]
    Limit {
        /// Resource.
        resource: Resource,
        /// Value of the limit.
        most: u64,
        /// The kernel's reason.
        error: io::Error,
    },
    /// A request about interfaces.
    #[error("network: {0}")]
    Network(rtnetlink::Error),
    /// Local addresses on an interface.
    #[error("route_localnet of {interface}: {error}")]
    RouteLocal {
        /// Name of the interface.
        interface: String,
        /// The kernel's reason.
        error: io::Error,
    },
    /// User namespaces, which the machine refuses.
    #[error("user namespaces are refused ({reason})")]
    UserNamespaces {
        /// The kernel's reason.
        reason: String,
    },
    /// A step within a part of a host.
    #[error("{part}: {error}")]
    Part {
        /// Name of the part.
        part: &'static str,
        /// Error of the step.
        error: Box<StepError>,
    },
    /// Reading of the input, or of a file of another process.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// A specification that cannot be read.
    #[error(transparent)]
    Spec(#[from] serde_json::Error),
    /// An option of a mount with a NUL in it.
    #[error(transparent)]
    Option(#[from] NulError),
}

impl StepError {
    /// Conversion of the kernel's error to that of a step.
    pub(crate) fn of_step<E: Into<io::Error>>(step: &'static str) -> impl Fn(E) -> StepError {
        move |error| StepError::Step { step, error: error.into() }
    }

    /// Error of a step within `part`.
    pub(crate) fn in_part(part: &'static str) -> impl Fn(StepError) -> StepError {
        move |error| StepError::Part { part, error: Box::new(error) }
    }
}
