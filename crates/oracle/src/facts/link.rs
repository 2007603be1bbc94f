//! The telemetry link of the unit under test, as the guards at its two ends saw it: P3 when no timely record comes through, and
//! the missing records when the relay says that it dropped some.
//!
//! Others have associations at the gateway too; their records are no sign of the unit. The owner of an association is told by its guard
//! from the certificate that the handshake showed.

use std::collections::{BTreeMap, BTreeSet};

use evidence::{Evidence, Finding, Micros, Property};
use instrument::{Any, GuardVerdict, Note};
use wire::core::Side;
use wire::id::{NodeId, PeerId};
use wire::mode::Mode;

use crate::arrived::Receipt;
use crate::timeline::Timeline;
use crate::{contact, finding, life, process_fault, stale};

/// Longer than a link on which a record goes each way every tenth of a second is silent by itself.
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
fn arrivals(evidence: &Evidence, target: NodeId) -> Vec<Arrival> {
    let other = if target == NodeId::GATEWAY { evidence.under.peer() } else { PeerId::GATEWAY };
    let mut peers: BTreeMap<u32, PeerId> = BTreeMap::new();
    let mut found = Vec::new();
    for w in evidence.entries.iter().filter(|w| Some(w.entry.node) == target.guard()) {
        match w.entry.event {
            Any::Instrument(Note::Associated { association, peer }) => {
                peers.insert(association, peer);
            }
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

/// Times at which records of that link came to the guard of `target`.
pub(crate) fn came(evidence: &Evidence, target: NodeId) -> Vec<Micros> {
    arrivals(evidence, target).into_iter().map(|a| a.at).collect()
}

/// P3: when no timely record has come through for *Th*, in either direction, the unit holds; after the end of a planned contact, soon after the
/// next one has begun.
///
/// A timely record passed the guard at the target, was not made or changed by the adversary, and came within *Tf* of being
/// taken by the relay, if it was: all from the relay's and the guards' logs. A dead unit changes no mode, and the response owed of a dead end is
/// `process_fault`'s to judge: from the end of either to its next start, none is asked for here.
pub(crate) fn trust(evidence: &Evidence, line: &Timeline, receipt: &Receipt) -> Vec<Finding> {
    let th = evidence.bounds.to_hold_safe_ms * 1000;
    let mut found = Vec::new();
    for node in [NodeId::GATEWAY, evidence.under.node()] {
        for (before, at) in silences(evidence, receipt, node) {
            let due = contact::spans(evidence, before).unwrap_or(before + th);
            if at <= due {
                continue;
            }
            // A unit that did not run judges when it runs again; until then its plant's lease stands for it.
            let mode = line.mode_at(process_fault::can_judge(evidence, evidence.under.node(), due));
            if !matches!(mode, Mode::HoldSafe | Mode::Idle) {
                let silent = (due - before) / 1000;
                let what = format!("nothing timely at {node} for {silent} ms and still {}", mode.name());
                found.push(finding(Property::P3, due, what));
            }
        }
    }
    found
}

/// Times of timely records at the guard of `node`, before the end of the run.
pub(crate) fn timely(evidence: &Evidence, receipt: &Receipt, node: NodeId) -> Vec<Micros> {
    let limit = stale::limit(evidence);
    let mut firsts = BTreeSet::new();
    let timely = arrivals(evidence, node).into_iter().filter(|a| {
        let held = receipt.taken.get(&a.hash).map_or(0, |taken| a.at.saturating_sub(*taken));
        let passed = a.verdict == GuardVerdict::Passed;
        passed && firsts.insert(a.hash) && held <= limit && !receipt.forged.contains_key(&a.hash)
    });
    timely.map(|a| a.at).filter(|at| *at < evidence.duration).collect()
}

/// The times between which no timely record came to the guard of `node`, one after the other; without those in which either end
/// was dead.
pub(crate) fn silences(evidence: &Evidence, receipt: &Receipt, node: NodeId) -> Vec<(Micros, Micros)> {
    let mut times = timely(evidence, receipt, node);
    let dead: BTreeSet<(Micros, Micros)> =
        [node, evidence.under.node()].into_iter().flat_map(|n| life::dead(evidence, n)).collect();
    for (from, to) in &dead {
        times.retain(|at| at < from || at > to);
        times.extend([*from, *to].into_iter().filter(|at| *at < evidence.duration));
    }
    times.extend([0, evidence.duration]);
    times.sort_unstable();
    let lived = |(before, at): &(Micros, Micros)| !dead.iter().any(|(from, to)| before >= from && at <= to);
    times.windows(2).map(|pair| (pair[0], pair[1])).filter(lived).collect()
}

/// True if a record is missing at the guard of the peer that `from` talks to, at about `at`: a gap in the record numbers, or
/// silence for longer than the link is ever silent by itself.
pub(crate) fn missed(evidence: &Evidence, from: Side, at: Micros) -> bool {
    let target = if from == Side::Client { NodeId::GATEWAY } else { evidence.under.node() };
    let arrivals = arrivals(evidence, target);
    let came = arrivals.iter().any(|a| a.at > at && a.at <= at + SILENCE);
    let mut highest: BTreeMap<u32, u64> = BTreeMap::new();
    let after = arrivals.iter().find(|a| {
        let highest = highest.entry(a.association).or_insert(a.sequence);
        let jumped = a.sequence > *highest + 1;
        *highest = (*highest).max(a.sequence);
        a.at >= at && (jumped || a.at > at + SILENCE)
    });
    match after {
        Some(a) => a.at <= at + SILENCE || !came,
        None => at + SILENCE < evidence.duration && !came,
    }
}
