//! Reasons for which a live run fails. The reasons of its parts are beside them: `child`, `hosts`, `detector`, `spec`.

use std::io;
use std::path::PathBuf;

use link::mcap_frames::McapFramesError;
use link::pki::PkiError;
use nix::sys::signal::Signal;
use sandbox::Level;
use wire::id::NodeId;

use super::child::StartError;
use super::spec::SpecificationError;

/// Reason for a failed live run. Except for [`LiveError::Stopped`] the host lacks something, or a service did not come up.
#[derive(Debug, thiserror::Error)]
pub enum LiveError {
    /// The user stopped it before it began.
    #[error("stopped")]
    Stopped,
    /// The host gives no random bytes for the run's secret.
    #[error("no randomness from the host: {0}")]
    Randomness(io::Error),
    /// The mark by which later runs find its remains cannot be made.
    #[error("cannot mark the run: {0}")]
    Mark(io::Error),
    /// A folder of the run cannot be made.
    #[error("cannot make {}: {error}", folder.display())]
    Folder {
        /// The run's folder.
        folder: PathBuf,
        /// Error of the host.
        error: io::Error,
    },
    /// The planned site cannot be written.
    #[error("cannot write to {}: {error}", folder.display())]
    Site {
        /// The run's folder.
        folder: PathBuf,
        /// Error of the host.
        error: io::Error,
    },
    /// No certificates.
    #[error(transparent)]
    Credentials(#[from] PkiError),
    /// The rights on the buses cannot be signed or written.
    #[error("{0}")]
    Enclaves(String),
    /// The list of remains cannot be encoded for the janitor.
    #[error(transparent)]
    Remains(#[from] serde_json::Error),
    /// A process cannot be started.
    #[error(transparent)]
    Start(#[from] StartError),
    /// A specification lacks something.
    #[error(transparent)]
    Specification(#[from] SpecificationError),
    /// A restart of a node that is no member.
    #[error("no such member")]
    NoMember,
    /// A service was not ready in time.
    #[error("{node} did not become ready within {seconds} s")]
    Late {
        /// The service.
        node: NodeId,
        /// The time limit.
        seconds: u64,
    },
    /// A service is less confined than the user requires.
    #[error("--require-confinement: {node} reaches {level}")]
    Level {
        /// The service.
        node: NodeId,
        /// Its level.
        level: Level,
    },
    /// A service refused to start.
    #[error("{node} did not start: {reason}")]
    Refused {
        /// The service.
        node: NodeId,
        /// Its own reason.
        reason: String,
    },
    /// A service ended before it was ready.
    #[error("{node} {} before it was ready", ended_by(*signal))]
    Ended {
        /// The service.
        node: NodeId,
        /// The signal that ended it, if one did.
        signal: Option<Signal>,
    },
    /// The console's window cannot be opened.
    #[error("{0}")]
    Window(String),
    /// The console's window was closed too early.
    #[error("the window was closed before the run began")]
    WindowClosed,
    /// No service runs any more.
    #[error("every service ended")]
    AllEnded,
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] McapFramesError),
    /// A file or folder of the records cannot be written.
    #[error("{}: {error}", path.display())]
    Unwritable {
        /// The file or folder.
        path: PathBuf,
        /// Error of the host.
        error: io::Error,
    },
    /// The recording that an insider altered cannot be written.
    #[error("{} cannot be written again", folder.display())]
    NotRewritten {
        /// Folder of the recording.
        folder: PathBuf,
    },
}

fn ended_by(signal: Option<Signal>) -> String {
    signal.map_or_else(|| "ended by itself".to_owned(), |signal| format!("was ended by {signal}"))
}
