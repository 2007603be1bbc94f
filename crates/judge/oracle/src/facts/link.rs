//! The telemetry link of the unit under test, as the guards at its two ends saw it: timely records, silences, and missing records.
//!
//! A timely record passed the guard at the target, was not made or changed by the adversary, and came within *Tf* of being
//! taken by the relay, if it was: all from the relay's and the guards' logs. Other units have associations at the gateway too; their
//! records are no sign of this unit. The owner of an association is stated by its guard from the certificate that the handshake showed.

use std::collections::{BTreeMap, BTreeSet};

use evidence::{Evidence, Micros};
use ground_truth::{Any, GuardVerdict, Note};
use wire::core::Side;
use wire::id::{NodeId, PeerId};

use super::{Facts, Span, process};

/// Longest silence that the link shows by itself, at a record each way every tenth of a second.
pub(crate) const SILENCE: Micros = 350_000;

/// A protected record at one end.
#[derive(Clone, Copy)]
struct Arrival {
    at: Micros,
    association: u32,
    sequence: u64,
    hash: u64,
    verdict: GuardVerdict,
}

/// The records of the link between the unit and the gateway that came to the guard of `target`.
fn record_arrivals(evidence: &Evidence, target: NodeId) -> Vec<Arrival> {
    let other = if target == NodeId::GATEWAY { evidence.under.peer() } else { PeerId::GATEWAY };
    let mut peers: BTreeMap<u32, PeerId> = BTreeMap::new();
    let mut found = Vec::new();
    for w in evidence.entries.iter().filter(|w| Some(w.entry.node) == target.guard()) {
        match w.entry.event {
            Any::Instrument(Note::Associated { association, peer }) => {
                peers.insert(association, peer);
            }
            // Epoch 0 is the handshake, which carries no record. Without the owner of the association, records of a teammate
            // would hide the silence of this unit.
            Any::Instrument(Note::GuardSaw { association, epoch: 1.., sequence, hash, verdict, .. })
                if peers.get(&association) == Some(&other) =>
            {
                found.push(Arrival { at: w.at, association, sequence, hash, verdict });
            }
            _ => {}
        }
    }
    found
}

/// Times at which records of the link came to the guard of `target`.
pub(crate) fn record_times(evidence: &Evidence, target: NodeId) -> Vec<Micros> {
    record_arrivals(evidence, target).into_iter().map(|a| a.at).collect()
}

/// Difference that two clocks and two logs may have.
const CLOCKS: Micros = 1_000;

/// Time that a record may have spent between the relay's log and a guard's, at most, to be fresh.
pub(crate) fn fresh_for(evidence: &Evidence) -> Micros {
    evidence.bounds.freshness_ms * 1000 + CLOCKS
}

/// Times of timely records at the guard of `node`, before the end of the run.
pub(crate) fn timely_times(facts: &Facts, node: NodeId) -> Vec<Micros> {
    let Facts { evidence, relayed, .. } = facts;
    let limit = fresh_for(evidence);
    let mut firsts = BTreeSet::new();
    let timely = record_arrivals(evidence, node).into_iter().filter(|a| {
        let held = relayed.taken.get(&a.hash).map_or(0, |taken_at| a.at.saturating_sub(*taken_at));
        let passed = a.verdict == GuardVerdict::Passed;
        // A repeated record is no sign of life, so that a replay cannot keep a silent link timely.
        passed && firsts.insert(a.hash) && held <= limit && !relayed.forged.contains_key(&a.hash)
    });
    timely.map(|a| a.at).filter(|time| *time < evidence.duration).collect()
}

/// Spans without a timely record at the guard of `node`, in order; without spans in which either end was dead.
pub(crate) fn silences(facts: &Facts, node: NodeId) -> Vec<Span> {
    let evidence = facts.evidence;
    let mut times = timely_times(facts, node);
    let dead: BTreeSet<Span> =
        [node, evidence.under.node()].into_iter().flat_map(|n| process::dead_spans(evidence, n)).collect();
    // P3 applies again after a restart: only the time in which an end was dead is left out.
    for (from, to) in &dead {
        times.retain(|time| time < from || time > to);
        times.extend([*from, *to].into_iter().filter(|time| *time < evidence.duration));
    }
    times.extend([0, evidence.duration]);
    times.sort_unstable();
    let lived = |(begin, end): &Span| !dead.iter().any(|(from, to)| begin >= from && end <= to);
    times.windows(2).map(|pair| (pair[0], pair[1])).filter(lived).collect()
}

/// True if a record is missing at the guard of the peer that `from` talks to, at about `time`: a gap in the record numbers, or
/// silence for longer than the link is ever silent by itself.
pub(crate) fn record_missing(evidence: &Evidence, from: Side, time: Micros) -> bool {
    let target = if from == Side::Client { NodeId::GATEWAY } else { evidence.under.node() };
    let arrivals = record_arrivals(evidence, target);
    let followed = arrivals.iter().any(|a| a.at > time && a.at <= time + SILENCE);
    let mut highest: BTreeMap<u32, u64> = BTreeMap::new();
    let sign = arrivals.iter().find(|a| {
        // Each association counts from its first record.
        let highest = highest.entry(a.association).or_insert(a.sequence);
        let jumped = a.sequence > *highest + 1;
        *highest = (*highest).max(a.sequence);
        a.at >= time && (jumped || a.at > time + SILENCE)
    });
    match sign {
        Some(a) => a.at <= time + SILENCE || !followed,
        None => time + SILENCE < evidence.duration && !followed,
    }
}
