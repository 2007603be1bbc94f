//! A trial as a campaign keeps it: the oracle's verdict, in numbers that are written and read without loss.

use evidence::trial::{Outcome, Trial};
use serde::{Deserialize, Serialize};

/// The longest finding that is kept, in characters.
const MAX_FINDING: usize = 200;

/// One trial of a campaign.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrialRow {
    /// Its number in the campaign.
    pub trial: u64,
    /// The class that the oracle gave.
    pub outcome: Outcome,
    /// True if every injection was seen at its target.
    pub receipt: bool,
    /// SHA-256 over the canonical events.
    pub log_hash: String,
    /// SHA-256 over the decisions.
    pub decision_hash: String,
    /// Times from the receipt to DEGRADED, to HOLD_SAFE and to the loss of authority, microseconds.
    pub latency_us: [Option<u64>; 3],
    /// Records delivered to the boundary.
    pub received: u64,
    /// Records that it accepted.
    pub accepted: u64,
    /// Records that it refused.
    pub refused: u64,
    /// Losses of authority or freedom without an injected fault or true hazard.
    pub false_trips: u32,
    /// Time in nominal control, microseconds.
    pub nominal_us: u64,
    /// Simulated time, microseconds.
    pub sim_us: u64,
    /// The first finding of the oracle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub finding: Option<String>,
}

impl TrialRow {
    /// Row of a trial that has just been judged, by its number in the campaign.
    pub fn from_trial(trial: u64, done: &Trial) -> Self {
        let us = |ms: f64| (ms * 1e3).round().max(0.0) as u64;
        let latency = &done.latency_ms;
        Self {
            trial,
            outcome: done.outcome,
            receipt: done.receipt,
            log_hash: done.log_hash.clone(),
            decision_hash: done.decision_hash.clone(),
            latency_us: [latency.to_degraded, latency.to_hold_safe, latency.to_authority_revoked].map(|ms| ms.map(us)),
            received: done.received,
            accepted: done.accepted,
            refused: done.dropped.values().sum(),
            false_trips: done.false_trips,
            nominal_us: us(done.nominal_seconds * 1e3),
            sim_us: us(done.sim_seconds * 1e3),
            finding: done.findings.first().map(|finding| finding.chars().take(MAX_FINDING).collect()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_read_as_it_was_written() {
        let mut done = Trial::example(3, Outcome::HoldSafe);
        done.latency_ms.to_hold_safe = Some(0.1 + 0.2);
        done.findings = vec!["P3 ".repeat(200)];
        let row = TrialRow::from_trial(7, &done);
        assert_eq!((row.latency_us, row.refused, row.sim_us), ([Some(3_000), Some(300), None], 10, 10_000_000));
        assert_eq!(row.finding.as_ref().map(|f| f.chars().count()), Some(MAX_FINDING));
        let repeated: TrialRow = serde_json::from_str(&serde_json::to_string(&row).unwrap()).unwrap();
        assert_eq!(repeated, row);
    }
}
