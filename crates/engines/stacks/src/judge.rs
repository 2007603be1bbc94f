//! The class of a trial on the real stacks, from the adversary's account of its actions and the target's log.
//!
//! The classes are the oracle's, in its order. UNSAFE: one identity passed for another, or a record was delivered that
//! was never sent, or one twice (P5), or content was read that the link is to keep secret. INVALID: an action was not
//! seen at the target. LATE: an honest record did not get through in time, or the association is gone. A stack has no
//! modes, so it neither holds nor degrades.

use std::collections::BTreeMap;

use evidence::log::hex;
use evidence::trial::{Knowledge, Latency, Outcome, Trial};
use sha2::{Digest, Sha256};
use wire::event::wire_hash;

/// Observations of one trial.
#[derive(Clone, Debug, Default)]
pub(super) struct Showing {
    /// True if there was an attack; a control has none.
    attacked: bool,
    /// Number of times that the adversary put bytes in, by its own account and by short hash.
    deeds: BTreeMap<u64, u64>,
    /// Number of times that bytes arrived, by the target's log and by short hash.
    seen: BTreeMap<u64, u64>,
    /// Events that must never happen, and happened.
    pub(super) breaches: Vec<String>,
    /// Secret marks that an observer read.
    pub(super) read: Vec<String>,
    /// Marks that an observer read, and that the protocol does not hide.
    pub(super) in_the_clear: Vec<String>,
    /// Honest records that did not arrive in time.
    pub(super) missed: Vec<String>,
    /// Refusals by an end, by reason.
    refused: BTreeMap<String, u64>,
    /// Refusals by a guard, by reason.
    pub(super) guard_refused: BTreeMap<String, u64>,
    /// Records delivered to an application.
    pub(super) delivered: u64,
}

impl Showing {
    /// No observation yet, of an attack or of a control.
    pub(super) fn new(attacked: bool) -> Self {
        Self { attacked, ..Self::default() }
    }

    /// Notes that the adversary put these bytes in.
    pub(super) fn did(&mut self, bytes: &[u8]) {
        self.did_hash(wire_hash(bytes));
    }

    /// Notes that the adversary put in bytes with this short hash.
    pub(super) fn did_hash(&mut self, hash: u64) {
        *self.deeds.entry(hash).or_default() += 1;
    }

    /// Notes that these bytes arrived at the target.
    pub(super) fn saw(&mut self, bytes: &[u8]) {
        self.saw_hash(wire_hash(bytes));
    }

    /// Notes that bytes with this short hash arrived at the target.
    pub(super) fn saw_hash(&mut self, hash: u64) {
        *self.seen.entry(hash).or_default() += 1;
    }

    /// Notes one refusal by an end, for this reason.
    pub(super) fn refused(&mut self, name: &str) {
        self.refused_n(name, 1);
    }

    /// Notes `n` refusals by an end, for this reason.
    pub(super) fn refused_n(&mut self, name: &str, n: u64) {
        if n > 0 {
            *self.refused.entry(name.to_owned()).or_default() += n;
        }
    }

    /// True if every action of the adversary arrived at the target, as often as it was carried out.
    fn receipt(&self) -> bool {
        let arrived = |(hash, n): (&u64, &u64)| self.seen.get(hash).is_some_and(|seen| seen >= n);
        !self.attacked || (!self.deeds.is_empty() && self.deeds.iter().all(arrived))
    }

    fn outcome(&self) -> Outcome {
        if !self.breaches.is_empty() || !self.read.is_empty() {
            Outcome::Unsafe
        } else if !self.receipt() {
            Outcome::Invalid
        } else if !self.missed.is_empty() {
            Outcome::Late
        } else if !self.attacked {
            Outcome::Nominal
        } else if self.refused.is_empty() && self.guard_refused.is_empty() {
            Outcome::Undetected
        } else {
            Outcome::Rejected
        }
    }
}

/// Counts without their hashes, in order: the bytes, and so the hashes, are new in each run of the libraries.
fn in_order(map: &BTreeMap<u64, u64>) -> Vec<u64> {
    let mut counts: Vec<u64> = map.values().copied().collect();
    counts.sort_unstable();
    counts
}

/// Judges a trial. Its hashes are over names and counts, for the bytes are new in each run of the libraries.
pub(super) fn judge(seed: u64, showing: &Showing) -> Trial {
    let outcome = showing.outcome();
    let breaches = showing.breaches.iter().map(|name| format!("P5: {name}"));
    let read = showing.read.iter().map(|name| format!("read: {name}"));
    let missed = showing.missed.iter().map(|name| format!("late: {name}"));
    let clear = showing.in_the_clear.iter().map(|name| format!("in the clear: {name}"));
    let unseen = (!showing.receipt()).then(|| "something that was done was not seen at its target".to_owned());
    // Refusals at the boundary, as in every other trial. A guard stands before the boundary: its refusals are counted
    // in `guard_refused` alone.
    let refused: u64 = showing.refused.values().sum();
    let decisions = (outcome.name(), &showing.refused, &showing.guard_refused, showing.delivered);
    let decision_hash = hex(&Sha256::digest(format!("{decisions:?}")));
    let counts = [&showing.deeds, &showing.seen].map(in_order);
    Trial {
        seed,
        cell: None,
        knowledge: Knowledge::default(),
        steps: Vec::new(),
        outcome,
        findings: breaches.chain(read).chain(missed).chain(unseen).chain(clear).collect(),
        receipt: showing.receipt(),
        injections: Vec::new(),
        log_hash: hex(&Sha256::digest(format!("{decisions:?}{counts:?}"))),
        decision_hash,
        received: showing.delivered + refused,
        accepted: showing.delivered,
        dropped: showing.refused.clone(),
        guard_refused: showing.guard_refused.clone(),
        outsiders: BTreeMap::new(),
        host_late_ms: None,
        host_stall_ms: None,
        confinement: None,
        host_spoilt_ms: Vec::new(),
        claims: None,
        guest: None,
        mission: None,
        transitions: Vec::new(),
        latency_ms: Latency::default(),
        responses: Vec::new(),
        held: None,
        sim_seconds: 0.0,
        false_trips: 0,
        nominal_seconds: 0.0,
        cpu_seconds: 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hashes_do_not_depend_on_library_randomness() {
        let showing = |deeds: &[u64]| {
            let mut showing = Showing::new(true);
            for hash in deeds {
                showing.did_hash(*hash);
                showing.saw_hash(*hash);
            }
            judge(1, &showing)
        };
        assert_eq!(showing(&[3, 8, 8]).log_hash, showing(&[5, 5, 9]).log_hash);
        assert_ne!(showing(&[3, 8, 8]).log_hash, showing(&[3, 8, 9]).log_hash);
    }
}
