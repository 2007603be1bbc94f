//! The lines between launcher and warden: one specification in, then a report of the start and one of the end.

use std::collections::BTreeMap;
use std::io::{self, Read};
use std::path::PathBuf;

use guest::file::Limits;
use serde::{Deserialize, Serialize};

use crate::level::Level;

/// Longest line, bytes: a guest file has at most 64 words and 64 values of 4 KiB, and escapes make six bytes of one.
const MAX_LINE: usize = 4 << 20;

/// A process to start.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Spec {
    /// Program and arguments; empty to find the level of confinement and start nothing.
    pub(crate) command: Vec<String>,
    /// Working directory, absolute.
    pub(crate) folder: PathBuf,
    /// Folder that is shown empty.
    pub(crate) hidden: Option<PathBuf>,
    /// The whole environment.
    pub(crate) environment: BTreeMap<String, String>,
    /// Limits.
    pub(crate) limits: Limits,
}

/// A report of the warden.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Report {
    /// The program runs.
    Started(Level),
    /// The program cannot be started, for this reason.
    NotStarted(String),
    /// The program has ended, or is ended now.
    Ended {
        /// Exit status or signal, in words; none where the launcher ended it.
        how: Option<String>,
        /// Last bytes of its standard error.
        words: String,
    },
}

/// The next line, without its end; none at the end of the stream.
///
/// Reads byte by byte: a reader with a buffer would take bytes of the next line.
///
/// # Errors
/// The stream's, or a line beyond any specification.
pub(crate) fn line(stream: &mut impl Read) -> io::Result<Option<String>> {
    let (mut line, mut byte) = (Vec::new(), [0]);
    while line.len() < MAX_LINE {
        match stream.read(&mut byte) {
            Ok(0) => break,
            Ok(_) if byte[0] == b'\n' => return String::from_utf8(line).map(Some).map_err(io::Error::other),
            Ok(_) => line.push(byte[0]),
            Err(why) if why.kind() == io::ErrorKind::Interrupted => {}
            Err(why) => return Err(why),
        }
    }
    // A helper that panics writes text here that is no report.
    Ok((!line.is_empty()).then(|| String::from_utf8_lossy(&line).into_owned()))
}
