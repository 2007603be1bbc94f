//! The log of a recorded run, at times of that run, with the values to judge it by.
//!
//! The events come from the verified recording; bounds, start and the launcher's process faults, which it lacks, come from
//! [`crate::events`]. Explaining and judging the log are left to `explain` and `oracle`.

use evidence::Witnessed;
use wire::bounds::Bounds;
use wire::id::NodeId;

use crate::checked::Checked;
use crate::error::RecordingError;
use crate::events::{read_facts, read_launcher_notes};
use crate::log::read_log;
use crate::read::read_recording;

/// Assumptions about a recording without `events.jsonl`.
const ASSUMED: &str = "no events.jsonl tells of the bounds and of when the run began: the ground platform's are taken, and times \
                       count from the recording's first entry";

/// A log, and the values to judge it by.
pub struct RecordedLog {
    /// Entries in (time, node, counter) order, with the launcher's process faults; times count from the start of the run, microseconds.
    pub entries: Vec<Witnessed>,
    /// Reason for which it is INVALID, or the first fault of its chains.
    pub flaw: Option<String>,
    /// Assumption where the recording lacks the value.
    pub assumed: Option<&'static str>,
    /// The bounds that were in force.
    pub bounds: Bounds,
}

impl RecordedLog {
    /// Reads the log of a run. The recording of a live run has the times of its host.
    ///
    /// # Errors
    /// When the recording cannot be read.
    pub fn read(run: &Checked) -> Result<Self, RecordingError> {
        let (mut entries, flaw) = read_log(&read_recording(run.folder(), run.digests())?);
        let flaw = run.invalid().map(str::to_owned).or(flaw);
        let facts = read_facts(run.folder()).and_then(|facts| Some((facts.start(&entries)?, facts.bounds)));
        let (start, bounds) = facts.unwrap_or((entries.first().map_or(0, |w| w.at), Bounds::GROUND));
        entries.iter_mut().for_each(|w| w.at = w.at.saturating_sub(start));
        // The launcher's entries are beside a live run's recording, and not part of the verified log; the twin's log
        // has them.
        if !entries.iter().any(|w| w.entry.node == NodeId::CAMPAIGN) {
            entries.extend(read_launcher_notes(run.folder()));
        }
        entries.sort_by_key(|w| (w.at, w.entry.node, w.entry.boot, w.entry.counter));
        Ok(Self { entries, flaw, assumed: facts.is_none().then_some(ASSUMED), bounds })
    }
}
