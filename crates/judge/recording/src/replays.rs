//! `replay.json`: results of replaying the input journal of every core of a live run, and the thinning of the journals afterwards.
//!
//! The replay is done right after the run, since the signing keys of the cores are gone afterwards. Making the cores and feeding them is
//! left to `live::journals`.

use std::io::{BufReader, BufWriter};
use std::path::Path;

use link::{files, input_journal};
use serde::{Deserialize, Serialize};
use wire::id::{Boot, NodeId};

use crate::checked::Checked;
use crate::error::RecordingError;
use crate::layout::RunFolder;

/// The longest `replay.json` that is read, bytes.
const MAX_REPLAY_BYTES: u64 = 1 << 20;

/// Result of one core's replay.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CoreReplay {
    /// Node of the core.
    pub node: NodeId,
    /// Inputs fed.
    pub inputs: u64,
    /// Outputs compared and found equal.
    pub outputs: u64,
    /// Reason for which the replay is not whole, where it is not.
    pub difference: Option<String>,
}

impl CoreReplay {
    /// The difference, with its core; `None` where the replay is exact.
    pub fn named_difference(&self) -> Option<String> {
        let difference = self.difference.as_ref()?;
        Some(format!("{}, replayed from its input journal: {difference}", self.node))
    }
}

/// Writes the results of replaying the input journals.
///
/// # Errors
/// When the file cannot be written.
pub fn write_replays(run: &RunFolder, replays: &[CoreReplay]) -> std::io::Result<()> {
    std::fs::write(run.replays(), serde_json::to_vec_pretty(replays)?)
}

/// Results of replaying every input journal of `run` in its core, as they were right after the run.
///
/// # Errors
/// When it is a run of the twin, which leaves no input journals, or the results cannot be read.
pub fn read_replays(run: &Checked) -> Result<Vec<CoreReplay>, RecordingError> {
    let file = run.folder().replays();
    if !run.folder().has_input_journals() {
        let message = "a run in the twin, which leaves no input journals".to_owned();
        let remedy = "its seed gives every byte again: `holdsafe inspect replay SCENARIO --seed N`".to_owned();
        return Err(RecordingError::Unreadable { file: run.path().to_owned(), message, remedy });
    }
    let unreadable = |message: String| RecordingError::Unreadable {
        file: file.clone(),
        message,
        remedy: "name the directory of one live trial, as `run SCENARIO --live --out DIR` makes below DIR/live"
            .to_owned(),
    };
    let text = files::read(&file, MAX_REPLAY_BYTES).map_err(|e| unreadable(e.to_string()))?;
    serde_json::from_slice(&text).map_err(|e| unreadable(e.to_string()))
}

/// Removes all sets of frames but each `every`-th from the input journals of `run` ([`input_journal::thin`]), for each core whose first
/// life was replayed without a difference: the exact bytes are no longer needed, and they are most of a recording. A journal with any
/// other result stays as it is.
///
/// # Errors
/// When a journal cannot be read or its copy cannot be written; the journal then stays as it is.
pub fn thin_journals(run: &RunFolder, replays: &[CoreReplay], every: u32) -> std::io::Result<()> {
    let identical = replays.iter().filter(|r| r.difference.is_none());
    let with_frames = identical.filter(|r| matches!(r.node, NodeId::SIM | NodeId::PERCEPTION));
    for journal in with_frames.map(|r| run.input_journal(r.node, Boot(1))) {
        let copy = journal.with_extension("new");
        thin(&journal, &copy, every).and_then(|()| std::fs::rename(&copy, &journal)).inspect_err(|_| {
            // A part of a copy is of no use, and the failure is reported.
            let _ = std::fs::remove_file(&copy);
        })?;
    }
    Ok(())
}

fn thin(journal: &Path, copy: &Path, every: u32) -> std::io::Result<()> {
    let source = input_journal::Reader::new(BufReader::new(files::open(journal)?)).map_err(std::io::Error::other)?;
    let copy = BufWriter::new(files::create(copy)?);
    input_journal::thin(source, copy, every).map(|_| ()).map_err(std::io::Error::other)
}
