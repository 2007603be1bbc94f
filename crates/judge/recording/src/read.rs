//! Raw readers of a run's folder: log entries before their verification.
//!
//! They stay inside this crate, and [`crate::verify`] judges their entries. A command reads a log through
//! [`crate::checked::Checked`]; only the planned site is read during a run. Bytes beyond the lengths in `held.json` are a finding of the
//! verification and no part of the log.

use std::collections::BTreeMap;
use std::io::{Error, ErrorKind, Read};
use std::path::PathBuf;

use evidence::anchors::FileDigest;
use evidence::log::Logged;
use ground_truth::Entry;
use link::instrument::Frame;
use link::{files, mcap_frames, witness};
use serde::de::DeserializeOwned;
use wire::id::NodeId;

use crate::error::RecordingError;
use crate::layout::RunFolder;

/// The longest `site.json` that is read, bytes.
const MAX_SITE_BYTES: u64 = 1 << 20;

/// The planned site of a run, which may still be running.
///
/// # Errors
/// When the file is missing, no regular file, or holds no site.
pub fn read_site<T: DeserializeOwned>(run: &RunFolder) -> std::io::Result<T> {
    Ok(serde_json::from_reader(files::open(&run.site())?.take(MAX_SITE_BYTES))?)
}

/// Digests of a run's files by their path below its folder, as its trust anchors state them; empty without anchors.
pub(crate) type FileDigests = BTreeMap<String, FileDigest>;

/// Every entry of the recorder's files, in recorded order; of each file as many bytes as its digest states.
///
/// # Errors
/// When it is no run directory, or has no recording.
pub(crate) fn read_recording(run: &RunFolder, lengths: &FileDigests) -> Result<Vec<Logged>, RecordingError> {
    check_directory(run)?;
    let length = |name: &str| lengths.get(&format!("{}/{name}", RunFolder::RECORDING)).map(|file| file.bytes);
    let frames = mcap_frames::frames_within_lengths(&run.recording(), length)
        .map_err(|error| RecordingError::not_a_run(run.path().to_owned(), error))?;
    Ok(frames.into_iter().map(|Frame { trace_us: at, node, bytes }| Logged { at, node, bytes }).collect())
}

/// The logs that guards and launcher keep themselves, file by file in the order of their names.
///
/// # Errors
/// When a file cannot be read.
pub(crate) fn read_guard_logs(run: &RunFolder) -> std::io::Result<Vec<Logged>> {
    let mut files: Vec<PathBuf> = match std::fs::read_dir(run.guard_logs()) {
        Ok(files) => files.map(|file| file.map(|file| file.path())).collect::<Result<_, _>>()?,
        Err(error) if error.kind() == ErrorKind::NotFound => Vec::new(),
        Err(error) => return Err(error),
    };
    files.sort_by_key(|file| (file.as_os_str().len(), file.clone()));
    let (mut log, mut room) = (Vec::new(), mcap_frames::MAX_MEMORY);
    for file in files {
        let unreadable = |error: Error| Error::new(error.kind(), format!("{}: {error}", file.display()));
        let entries = witness::read_entries(&file).map_err(unreadable)?;
        let size: usize = entries.iter().map(|bytes| bytes.len() + size_of::<Logged>()).sum();
        let left = room.checked_sub(size);
        room = left.ok_or_else(|| unreadable(Error::other("more entries than any run of ours writes")))?;
        log.extend(entries.into_iter().map(from_own_log));
    }
    Ok(log)
}

/// An entry from its writer's own log: the time of its handover is the time of its writing.
fn from_own_log(bytes: Vec<u8>) -> Logged {
    // An entry that cannot be decoded stays in the log, under any node, for the verifier to report.
    let (written, node) = Entry::decode(&bytes).map_or((0, NodeId::CAMPAIGN), |entry| (entry.at.0, entry.node));
    Logged { at: written, node, bytes }
}

/// Checks that the path of a run is a directory.
pub(crate) fn check_directory(run: &RunFolder) -> Result<(), RecordingError> {
    if run.path().is_dir() {
        return Ok(());
    }
    let message = if run.path().exists() { "not a run directory" } else { "no such run directory" };
    let remedy = "name the directory that `run --live --out DIR` made".to_owned();
    Err(RecordingError::Unreadable { file: run.path().to_owned(), message: message.to_owned(), remedy })
}
