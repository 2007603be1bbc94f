//! The log of a run in memory: from encoded entries to events in order, and the verification of their writers.
//!
//! [`read_log`] decodes a log and follows its chains, [`verify_log`] compares it with trust anchors too, `verifier` follows it
//! entry by entry, `clock` judges its times, [`sweep`] measures the detection of manipulations. No function here opens a
//! file: the folder of a run is left to [`crate::verify`].

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

mod clock;
pub mod sweep;
mod verifier;

use std::collections::{BTreeMap, BTreeSet};

use evidence::Witnessed;
use evidence::anchors::{HeadAnchor, Life, TrustAnchors};
use evidence::log::Logged;
use ground_truth::{Any, Entry};
use wire::audit::{ChainError, Chains, Head};
use wire::event::Event;
use wire::id::{Boot, NodeId};
use wire::sign::SharedVerifier;

pub use verifier::{LogVerifier, Verification};

/// The head of each life's chain, from a log that nobody could change yet. The recorder's own head is left out: it is no witness against
/// the recorder.
pub fn chain_heads(log: &[Logged]) -> Vec<HeadAnchor> {
    let (mut last, mut first_life) = (BTreeMap::<Life, &Logged>::new(), BTreeSet::new());
    // Backwards, since only the last entry of each life counts: none is needed before the last entry of a node's first life.
    for logged in log.iter().rev().filter(|l| l.node != NodeId::RECORDER) {
        if first_life.contains(&logged.node) {
            continue;
        }
        let Ok(entry) = Entry::decode(&logged.bytes) else { continue };
        last.entry(Life::from_entry(&entry)).or_insert(logged);
        if entry.node == logged.node && entry.boot == Boot(1) {
            first_life.insert(logged.node);
        }
    }
    last.into_values().filter_map(|l| Head::from_last::<Any>(&l.bytes)).map(HeadAnchor::from).collect()
}

/// Decodes the log of a twin, follows its chains and compares it with its trust anchors; `verifier` is shared with its cores.
/// Returns the entries in (time, node, counter) order, the first problem found, and the verification.
pub fn verify_log(
    log: &[Logged],
    anchors: &TrustAnchors,
    verifier: SharedVerifier,
) -> (Vec<Witnessed>, Option<String>, Verification) {
    let mut log_verifier = LogVerifier::new(anchors).with_shared_verifier(verifier);
    let (entries, problem) = follow_all(log, |l| log_verifier.take(l.at, l.node, &l.bytes));
    (entries, problem, log_verifier.close())
}

/// Decodes a log and follows its chains. Returns the entries in (time, node, counter) order and the first problem found.
pub fn read_log(log: &[Logged]) -> (Vec<Witnessed>, Option<String>) {
    let mut chains = Chains::default();
    follow_all(log, |l| chains.follow(&l.bytes).map(|(entry, _)| entry))
}

fn follow_all(
    log: &[Logged],
    mut follow: impl FnMut(&Logged) -> Result<Entry, ChainError>,
) -> (Vec<Witnessed>, Option<String>) {
    let mut entries = Vec::with_capacity(log.len());
    let mut problem = None;
    for logged in log {
        match follow(logged) {
            Ok(entry) => entries.push(Witnessed { at: logged.at, entry }),
            Err(error) => {
                problem.get_or_insert_with(|| error.to_string());
            }
        }
    }
    let broken = entries.iter().find_map(|w| match w.entry.event {
        Any::Service(Event::ChainBroken { node, counter }) => {
            Some(format!("the recorder found the chain of {node} broken at {counter}"))
        }
        _ => None,
    });
    entries.sort_by_key(|w| (w.at, w.entry.node, w.entry.boot, w.entry.counter));
    (entries, problem.or(broken))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_recording_of_a_living_recorder_is_flawed() {
        assert!(!LogVerifier::new(&TrustAnchors::default()).verify(&[]).flaws.is_empty());
    }
}
