//! The log of a run in the twin in the form of a recorded log, and the assumptions about a recorded run.
//!
//! Reading a recorded log is left to [`RecordedLog::read`].

use evidence::Evidence;
use evidence::trial::Outcome;
use oracle::Verdict;
use oracle::judged::findings;
use recording::RecordedLog;
use recording::verdict::invalid_reason;

/// The log of a run in the twin, which lacks no value; the run may have ended INVALID.
pub fn log_of_twin(evidence: Evidence, verdict: &Verdict) -> RecordedLog {
    let flaw = (verdict.outcome == Outcome::Invalid).then(|| invalid_reason(findings(verdict).first()));
    RecordedLog { entries: evidence.entries, flaw, assumed: None, bounds: evidence.bounds }
}

/// Prints the assumptions about `run` on stderr.
pub fn note_assumptions(log: &RecordedLog, run: &str) {
    if let Some(assumed) = log.assumed {
        link::note!("{run}: {assumed}");
    }
}
