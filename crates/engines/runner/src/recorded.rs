//! The log of a run, at times of that run: read back from its directory, or of a run in the twin.

use evidence::trial::Outcome;
use evidence::{Evidence, Witnessed};
use live::store;
use oracle::Verdict;
use oracle::judged::findings;
use wire::bounds::Bounds;
use wire::id::NodeId;

use super::checked::{self, Checked};
use super::engine;
use crate::error::EngineError;

/// Assumptions about a recording without `events.jsonl`.
const ASSUMED: &str = "no events.jsonl tells of the bounds and of when the run began: the ground platform's are taken, and times \
                       count from the recording's first entry";

/// A log, and the values to judge it by.
pub struct Recorded {
    /// In (time, node, counter) order; times count from the start of the run. The launcher's process faults are among them.
    pub entries: Vec<Witnessed>,
    /// Reason for which it is INVALID, or the first fault of its chains.
    pub flaw: Option<String>,
    /// Assumption where the recording lacks the value.
    pub assumed: Option<&'static str>,
    /// The bounds that were in force.
    pub bounds: Bounds,
}

impl Recorded {
    /// The recording of a run. A live one is kept at the times of its host.
    pub fn read(run: &Checked) -> Result<Recorded, EngineError> {
        let (mut entries, flaw) = engine::recorded(run)?;
        let flaw = run.invalid().map(str::to_owned).or(flaw);
        let told = store::told(run.path()).and_then(|told| Some((told.start(&entries)?, told.bounds)));
        let (start, bounds) = told.unwrap_or((entries.first().map_or(0, |w| w.at), Bounds::GROUND));
        entries.iter_mut().for_each(|w| w.at = w.at.saturating_sub(start));
        // The launcher's entries are beside a live run's recording, and not part of the verified log; the twin's log
        // has them.
        if !entries.iter().any(|w| w.entry.node == NodeId::CAMPAIGN) {
            entries.extend(store::launched(run.path()));
        }
        entries.sort_by_key(|w| (w.at, w.entry.node, w.entry.boot, w.entry.counter));
        Ok(Recorded { entries, flaw, assumed: told.is_none().then_some(ASSUMED), bounds })
    }

    /// Of a run in the twin, which lacks no value, and which may have ended INVALID.
    pub fn of(evidence: Evidence, verdict: &Verdict) -> Recorded {
        let flaw = (verdict.outcome == Outcome::Invalid).then(|| checked::ended_invalid(findings(verdict).first()));
        Recorded { entries: evidence.entries, flaw, assumed: None, bounds: evidence.bounds }
    }

    /// Prints the assumptions about `run` on stderr.
    pub fn warn(&self, run: &str) {
        if let Some(assumed) = self.assumed {
            link::note!("{run}: {assumed}");
        }
    }
}
