//! From the log of a run to what the oracle sees, and to the two hashes of a trial.
//!
//! `log_hash`: SHA-256 over the canonical events in (time, node, counter) order; no path, run id or file bytes, no
//! world, and none of the chain's own links (hashes, signatures, seals), which follow from the events.
//! `decision_hash`: the same over decisions alone: modes, verdicts, reasons, and when, whatever the policy waives.

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

use std::collections::{BTreeMap, BTreeSet};

use adversary::insider::{InsiderRecorder, Kept};
use sha2::{Digest, Sha256};
use wire::audit::{ChainError, Chains, Entry, Head};
use wire::codec;
use wire::event::Event;
use wire::id::{Boot, NodeId, WorldId};
use wire::policy::Waived;
use wire::sign::SharedVerifier;

use crate::custody::{Custodian, Custody, Held, HeldHead, Life};
use crate::oracle::Witnessed;

/// An encoded audit entry with the trace time at which it was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Logged {
    /// Trace time, microseconds.
    pub at: u64,
    /// Who handed it over.
    pub node: NodeId,
    /// Encoded entry.
    pub bytes: Vec<u8>,
}

/// Whether a node's entries go by way of the recorder: everybody's but the guards' and the launcher's.
pub fn by_recorder(node: NodeId) -> bool {
    node != NodeId::CAMPAIGN && !node.is_mouth()
}

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
    last.into_values().filter_map(|l| Head::of(&l.bytes)).map(HeldHead::from).collect()
}

/// Lets `hands` at what went by way of the recorder.
pub fn tamper(hands: &InsiderRecorder, log: &mut Vec<Logged>) {
    let (recorded, noted): (Vec<Logged>, Vec<Logged>) = log.drain(..).partition(|l| by_recorder(l.node));
    let mut kept: Vec<Kept> = recorded.into_iter().map(|Logged { at, node, bytes }| Kept { at, node, bytes }).collect();
    hands.lay_on(&mut kept);
    log.extend(kept.into_iter().map(|Kept { at, node, bytes }| Logged { at, node, bytes }));
    log.extend(noted);
}

/// Decodes a twin's log and follows its chains; it is set against what is `held` elsewhere, and `verifier` is that of its cores. Gives the entries in (time, node, counter) order, the first
/// problem found, and what became of the recording.
pub fn read_against(
    log: &[Logged],
    held: &Held,
    verifier: SharedVerifier,
) -> (Vec<Witnessed>, Option<String>, Custody) {
    let mut custodian = Custodian::new(held).asking(verifier);
    let (entries, problem) = follow_all(log, |l| custodian.take(l.at, l.node, &l.bytes));
    (entries, problem, custodian.close())
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
        Event::ChainBroken { node, counter } => {
            Some(format!("the recorder found the chain of {node} broken at {counter}"))
        }
        _ => None,
    });
    entries.sort_by_key(|w| (w.at, w.entry.node, w.entry.boot, w.entry.counter));
    (entries, problem.or(broken))
}

/// The two hashes of a trial, as hexadecimal.
pub fn hashes(entries: &[Witnessed]) -> (String, String) {
    let (mut log, mut decisions) = (Sha256::new(), Sha256::new());
    for w in entries {
        let Some(event) = canonical(w.entry.event) else { continue };
        let bytes = codec::encode(&Canonical { at: w.at, node: w.entry.node, event });
        log.update(&bytes);
        if let Some(event) = decision(event) {
            decisions.update(codec::encode(&Canonical { at: w.at, node: w.entry.node, event }));
        }
    }
    (hex(&log.finalize()), hex(&decisions.finalize()))
}

/// Lower-case hexadecimal.
pub fn hex(bytes: &[u8]) -> String {
    const DIGITS: [char; 16] = ['0', '1', '2', '3', '4', '5', '6', '7', '8', '9', 'a', 'b', 'c', 'd', 'e', 'f'];
    bytes.iter().flat_map(|b| [DIGITS[usize::from(b >> 4)], DIGITS[usize::from(b & 15)]]).collect()
}

/// What hashes are over.
#[derive(minicbor::Encode)]
pub(crate) struct Canonical {
    #[n(0)]
    pub(crate) at: u64,
    #[n(1)]
    pub(crate) node: NodeId,
    #[n(2)]
    pub(crate) event: Event,
}

/// The event without its world, or nothing for the chain's own links.
fn canonical(event: Event) -> Option<Event> {
    match event {
        Event::Signed { .. } | Event::Sealed { .. } => None,
        Event::Minted { world: _, authority, track, command, waived } => {
            Some(Event::Minted { world: WorldId(0), authority, track, command, waived })
        }
        Event::Acted { world: _, authority, track, command, failing } => {
            Some(Event::Acted { world: WorldId(0), authority, track, command, failing })
        }
        other => Some(other),
    }
}

/// The event without the checks that were waived: that is the policy, and no decision.
fn unwaived(event: Event) -> Event {
    match event {
        Event::Accepted { at, record, peer, age, waived: _ } => {
            Event::Accepted { at, record, peer, age, waived: Waived::default() }
        }
        Event::Minted { world, authority, track, command, waived: _ } => {
            Event::Minted { world, authority, track, command, waived: Waived::default() }
        }
        other => other,
    }
}

/// The event as a decision, whatever the policy waives and in whichever world; nothing where it is none.
pub fn decision(event: Event) -> Option<Event> {
    canonical(event).filter(is_decision).map(unwaived)
}

/// The kind of a decision in a word or two: refusals by their reason, changes of mode by where they lead.
pub fn kind_of(decision: &Event) -> String {
    match decision {
        Event::Refused { reason, .. } => format!("refused: {}", reason.name()),
        Event::Transition { to, .. } => format!("to {}", to.name()),
        other => {
            let named = serde_json::to_value(other).ok();
            named.and_then(|v| v.get("is")?.as_str().map(str::to_owned)).unwrap_or_default()
        }
    }
}

fn is_decision(event: &Event) -> bool {
    matches!(
        event,
        Event::Accepted { .. }
            | Event::Refused { .. }
            | Event::Transition { .. }
            | Event::Minted { .. }
            | Event::Revoked { .. }
            | Event::Acted { .. }
            | Event::Staged { .. }
            | Event::Executed { .. }
            | Event::Inconsistent { .. }
    )
}
