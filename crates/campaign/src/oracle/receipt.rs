//! Receipts: did the fault provably reach its target?
//!
//! A receipt needs two witnesses: the actor's entry, and an observation at the target by another process. The
//! adversary's word alone is none. For a datagram the guard's log must show the very bytes (by hash) at a fitting
//! time; for one that was dropped, that it never showed them and that something is missing there. For a sensor fault, perception or autonomy must have seen
//! the readings go missing. What was done to a byte stream is `stream`'s, what insiders sent `mouth`'s.

use std::collections::BTreeMap;

use wire::core::Side;
use wire::event::{Account, Action, Event, Sensor};
use wire::id::NodeId;
use wire::sensor::{Modalities, Modality};
use wire::stream::Sight;

use super::{Evidence, Micros, Planned, mouth, stream};

/// How long what a dying process had said may still be on its way into the log.
const LAST_WORDS: Micros = 100_000;
/// Longer than a link on which a record goes each way every tenth of a second is silent by itself.
const SILENCE: Micros = 350_000;
/// What a link takes by itself; so short a delay shows nothing.
const LEAST_DELAY: Micros = 10_000;

/// What was established about the injections.
#[derive(Clone, Debug, Default)]
pub(super) struct Receipt {
    /// Every planned injection has both witnesses.
    pub whole: bool,
    /// Planned injections without one.
    pub missing: Vec<Planned>,
    /// The actor's first entry that has a second witness.
    pub zero: Option<Micros>,
    /// Sensor faults with receipts: (sensor, start, end).
    pub faults: Vec<(Sensor, Micros, Micros)>,
    /// Delay imposed on a datagram, by its hash; dropped ones have `Micros::MAX`.
    pub delayed: BTreeMap<u64, Micros>,
    /// Hashes that the adversary made or changed: never timely traffic.
    pub forged: BTreeMap<u64, Micros>,
}

/// Looks for the receipts of everything planned.
pub(super) fn find(evidence: &Evidence) -> Receipt {
    let mut receipt = Receipt { faults: faults(evidence), ..Receipt::default() };
    note_datagrams(evidence, &mut receipt);
    let mut zeros = Vec::new();
    for planned in &evidence.planned {
        let zero = match *planned {
            Planned::Action(action @ (Action::Forward | Action::Forge | Action::Republish)) => {
                mouth::receipt(evidence, action, 1)
            }
            Planned::Malformed => mouth::receipt(evidence, Action::Inject, 1),
            // The original has the same bytes.
            Planned::Action(Action::RepeatCommand) => mouth::receipt(evidence, Action::RepeatCommand, 2),
            Planned::Action(Action::Kill) | Planned::Kill(_) => killed(evidence, planned),
            Planned::Action(action) => datagram(evidence, action),
            Planned::Stream(deed) => stream::receipt(evidence, deed),
            Planned::Fault(sensor) => receipt.faults.iter().find(|f| f.0 == sensor).map(|f| f.1),
        };
        match zero {
            Some(zero) => zeros.push(zero),
            None => receipt.missing.push(*planned),
        }
    }
    receipt.whole = receipt.missing.is_empty();
    receipt.zero = zeros.into_iter().min();
    receipt
}

fn note_datagrams(evidence: &Evidence, receipt: &mut Receipt) {
    for w in &evidence.entries {
        let Event::Attack { action, hash, delay, .. } = w.entry.event else { continue };
        match action {
            Action::Delay | Action::Reorder => {
                receipt.delayed.insert(hash, delay.0);
            }
            Action::Drop => {
                receipt.delayed.insert(hash, Micros::MAX);
            }
            Action::Corrupt | Action::Inject => {
                receipt.forged.insert(hash, w.at);
            }
            // The first sight of these bytes is the original; only that one counts as timely, whatever is repeated.
            Action::Duplicate
            | Action::Replay
            | Action::Reoriginate
            | Action::Forward
            | Action::RepeatCommand
            | Action::Kill
            | Action::Forge
            | Action::Republish => {}
        }
    }
}

/// Times at which any guard saw these bytes.
fn seen(evidence: &Evidence, wanted: u64) -> impl Iterator<Item = Micros> {
    evidence.entries.iter().filter_map(move |w| match w.entry.event {
        Event::GuardSaw { hash, .. } if hash == wanted => Some(w.at),
        _ => None,
    })
}

/// The first entry of `action` whose bytes the target's guard confirms.
fn datagram(evidence: &Evidence, action: Action) -> Option<Micros> {
    let entries = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Event::Attack { action: a, side, hash, delay, .. } if a == action => Some((w.at, side, hash, delay.0)),
        _ => None,
    });
    // Only a guard that kept a log and closed its account is a witness of an absence.
    let wrote = |test: &dyn Fn(&Event) -> bool| evidence.entries.iter().any(|w| test(&w.entry.event));
    let guarded = wrote(&|e| matches!(e, Event::GuardSaw { .. }))
        && wrote(&|e| matches!(e, Event::Count { account: Account::GuardIn, .. }));
    let confirmed = |at: Micros, side: Side, hash: u64, delay: Micros| match action {
        Action::Drop => guarded && seen(evidence, hash).next().is_none() && missed(evidence, side, at),
        Action::Delay | Action::Reorder => delay >= LEAST_DELAY && seen(evidence, hash).any(|s| s >= at + delay),
        Action::Duplicate | Action::Replay => seen(evidence, hash).any(|s| s >= at) && seen(evidence, hash).count() > 1,
        Action::Corrupt | Action::Inject | Action::Reoriginate => seen(evidence, hash).any(|s| s >= at),
        Action::Forward | Action::RepeatCommand | Action::Kill | Action::Forge | Action::Republish => false,
    };
    entries.into_iter().find(|(at, side, hash, delay)| confirmed(*at, *side, *hash, *delay)).map(|(at, ..)| at)
}

/// A kill counts when the dead said nothing more. The broker is heard of by its streams only: there the unit's mouth has to
/// see its own end.
fn killed(evidence: &Evidence, planned: &Planned) -> Option<Micros> {
    let silent = |node: NodeId, at: Micros| {
        let heard = |w: &super::Witnessed| w.entry.node == node && w.at > at + LAST_WORDS;
        !evidence.entries.iter().any(heard)
    };
    let cut_off = |at: Micros| {
        evidence.entries.iter().any(|w| {
            let ended = matches!(w.entry.event, Event::StreamSaw { sight: Sight::Closed | Sight::HungUp, .. });
            Some(w.entry.node) == NodeId::UNIT_A.guard() && ended && w.at >= at && w.at < evidence.duration
        })
    };
    let dead = |node: NodeId, at: Micros| silent(node, at) && (node != NodeId::BROKER || cut_off(at));
    evidence.entries.iter().find_map(|w| match (w.entry.event, planned) {
        (Event::Ended { node, killed: true }, Planned::Kill(wanted)) if node == *wanted && dead(node, w.at) => Some(w.at),
        (Event::Ended { node, killed: true }, Planned::Action(_)) if dead(node, w.at) => Some(w.at),
        _ => None,
    })
}

/// Whether something is missing at the guard of whoever `from` talks to, at about `at`: a gap in the record numbers, or
/// silence for longer than the link is ever silent by itself.
fn missed(evidence: &Evidence, from: Side, at: Micros) -> bool {
    let target = if from == Side::Client { NodeId::GATEWAY } else { NodeId::UNIT_A };
    let mut arrivals = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Event::GuardSaw { association, epoch: 1.., sequence, .. } if Some(w.entry.node) == target.guard() => {
            Some((w.at, association, sequence))
        }
        _ => None,
    });
    let mut highest: BTreeMap<u32, u64> = BTreeMap::new();
    let after = arrivals.by_ref().find(|(seen, association, sequence)| {
        let highest = highest.entry(*association).or_insert(*sequence);
        let jumped = *sequence > *highest + 1;
        *highest = (*highest).max(*sequence);
        *seen >= at && (jumped || *seen > at + SILENCE)
    });
    match after {
        Some((seen, ..)) => seen <= at + SILENCE || !arrived(evidence, target, at, at + SILENCE),
        None => at + SILENCE < evidence.duration && !arrived(evidence, target, at, at + SILENCE),
    }
}

/// Whether a record came to the guard of `target` in that time.
fn arrived(evidence: &Evidence, target: NodeId, from: Micros, to: Micros) -> bool {
    evidence.entries.iter().any(|w| {
        let record = matches!(w.entry.event, Event::GuardSaw { epoch: 1.., .. });
        Some(w.entry.node) == target.guard() && record && w.at > from && w.at <= to
    })
}

/// Sensor faults that the sim applied and that the other side saw.
fn faults(evidence: &Evidence) -> Vec<(Sensor, Micros, Micros)> {
    let mut found = Vec::new();
    for (i, w) in evidence.entries.iter().enumerate() {
        let Event::Fault { sensor, active: true, .. } = w.entry.event else { continue };
        if w.entry.node != NodeId::SIM {
            continue;
        }
        let rest = &evidence.entries[i..];
        let end = rest.iter().find_map(|e| match e.entry.event {
            Event::Fault { sensor: s, active: false, .. } if s == sensor && e.entry.node == NodeId::SIM => Some(e.at),
            _ => None,
        });
        let end = end.unwrap_or(evidence.duration);
        let observed =
            rest.iter().take_while(|e| e.at <= end.saturating_add(200_000)).any(|e| lacks(&e.entry.event, sensor));
        if observed {
            found.push((sensor, w.at, end));
        }
    }
    found
}

/// Whether the event says that `sensor`'s readings are missing at their consumer.
fn lacks(event: &Event, sensor: Sensor) -> bool {
    let without = |present: &Modalities, m: Modality| !present.has(m);
    match (event, sensor) {
        (Event::FrameSeen { present, .. }, Sensor::Rgb) => without(present, Modality::Rgb),
        (Event::FrameSeen { present, .. }, Sensor::Depth) => without(present, Modality::Depth),
        (Event::FrameSeen { present, .. }, Sensor::Thermal) => without(present, Modality::Thermal),
        (Event::FrameSeen { present, .. }, Sensor::Lidar) => without(present, Modality::Lidar),
        (Event::NavigationSeen { fix, .. }, Sensor::Localisation) => !fix,
        (Event::NavigationSeen { odometry, .. }, Sensor::Odometry) => !odometry,
        _ => false,
    }
}
