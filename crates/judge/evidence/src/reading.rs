//! From the log of a run to the events that the oracle sees, in order, with their flaws.

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

use std::collections::{BTreeMap, BTreeSet};

use ground_truth::{Any, Entry};
use wire::audit::{ChainError, Chains, Head};
use wire::event::Event;
use wire::id::{Boot, NodeId};
use wire::sign::SharedVerifier;

use crate::log::Logged;
use crate::verification::{Held, HeldHead, Life, LogVerifier, Verification};
use crate::witnessed::Witnessed;

/// The head of each life's chain, from the log before it was in anybody's hands. The recorder's own is no witness against it.
pub fn heads(log: &[Logged]) -> Vec<HeldHead> {
    let (mut last, mut first_life) = (BTreeMap::<Life, &Logged>::new(), BTreeSet::new());
    // From the end: what comes before the last entry of a node's first life is of no use.
    for logged in log.iter().rev().filter(|l| l.node != NodeId::RECORDER) {
        if first_life.contains(&logged.node) {
            continue;
        }
        let Ok(entry) = Entry::decode(&logged.bytes) else { continue };
        last.entry(Life::of(&entry)).or_insert(logged);
        if entry.node == logged.node && entry.boot == Boot(1) {
            first_life.insert(logged.node);
        }
    }
    last.into_values().filter_map(|l| Head::from_last::<Any>(&l.bytes)).map(HeldHead::from).collect()
}

/// Decodes a twin's log and follows its chains; it is set against the trust anchors `held` elsewhere, and `verifier` is
/// that of its cores. Gives the entries in (time, node, counter) order, the first problem found, and the result for the
/// recording.
pub fn read_against(
    log: &[Logged],
    held: &Held,
    verifier: SharedVerifier,
) -> (Vec<Witnessed>, Option<String>, Verification) {
    let mut log_verifier = LogVerifier::new(held).asking(verifier);
    let (entries, problem) = follow_all(log, |l| log_verifier.take(l.at, l.node, &l.bytes));
    (entries, problem, log_verifier.close())
}

/// Decodes a log and follows its chains. Gives the entries in (time, node, counter) order and the first problem found.
pub fn read(log: &[Logged]) -> (Vec<Witnessed>, Option<String>) {
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
