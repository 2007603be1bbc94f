//! Writing of the parts of a run that a launcher knows before or without the processes: its log in the twin, its plan live.
//!
//! The evidence as JSON lines is left to [`crate::events`], the verdict to [`crate::verdict`], the replays to [`crate::replays`]
//! and the trust anchors, last of all, to [`crate::anchors`].

use std::fs::File;
use std::io::{Error, Result, Write};

use evidence::log::Logged;
use link::bus::enclave::{Enclaves, SignedEnclaves};
use link::instrument::Frame;
use link::recorder::Recording;
use serde::Serialize;
use wire::sign::Key;

use crate::layout::RunFolder;

/// Writes a log as the MCAP files of `run`, as a live run's recorder would.
///
/// # Errors
/// When not every entry is on file.
pub fn write_log(run: &RunFolder, log: &[Logged]) -> Result<()> {
    let mut recording = Recording::new(run.recording());
    for logged in log {
        let frame = Frame { trace_us: logged.at, node: logged.node, bytes: logged.bytes.clone() };
        recording.write(frame);
    }
    let is_whole = recording.finish().lost == 0;
    is_whole.then_some(()).ok_or_else(|| Error::other("the recording cannot be written"))
}

/// Writes the planned site as JSON, before the run. It has no secret: spectators read it during the run.
///
/// # Errors
/// When the file is there already or cannot be written.
pub fn write_site(run: &RunFolder, site: &impl Serialize) -> Result<()> {
    // The file of another run in this folder is never overwritten.
    File::create_new(run.site())?.write_all(&serde_json::to_vec(site)?)
}

/// Signs the rights on the buses of a run, and writes document and signature.
///
/// # Errors
/// When they cannot be signed, or a file is there already or cannot be written; as text.
pub fn write_enclaves(
    run: &RunFolder,
    enclaves: &Enclaves,
    authority: &Key,
) -> std::result::Result<SignedEnclaves, String> {
    let signed = enclaves.sign(authority).map_err(|error| error.to_string())?;
    let write = |file, bytes: &[u8]| File::create_new(file)?.write_all(bytes);
    let written = write(run.enclaves(), signed.document.as_bytes())
        .and_then(|()| write(run.enclaves_signature(), &signed.signature));
    written.map_err(|error| format!("cannot write to {}: {error}", run.path().display()))?;
    Ok(signed)
}
