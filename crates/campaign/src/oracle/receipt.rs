//! Receipts: did the fault provably reach its target?
//!
//! A receipt needs two witnesses: the actor's entry, and an observation at the target by another process. The
//! adversary's word alone is none. For a datagram the guard's log must show the very bytes (by hash) at a fitting
//! time; for one that was dropped, that it never showed them and that something is missing there. For a sensor fault,
//! perception or autonomy must have seen the readings go missing, or off by what was imposed (`place`). What was done to a
//! byte stream is `stream`'s, to publications `planes`', what insiders sent `mouth`'s.

use std::collections::BTreeMap;

use wire::core::Side;
use wire::event::{Account, Action, Event, FaultKind, Sensor, Suspension};
use wire::id::NodeId;
use wire::sensor::{Modalities, Modality};
use wire::step::StepName;
use wire::stream::Sight;

use super::{Evidence, Micros, Planned, Witnessed, mouth, orders, place, planes, stream, view};

/// How long after a process is stopped its last entry may still be written.
const UNDER_WAY: Micros = 20_000;

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
    /// Sensor faults with receipts.
    pub faults: Vec<Befallen>,
    /// Delay imposed on a datagram, by its hash; dropped ones have `Micros::MAX`.
    pub delayed: BTreeMap<u64, Micros>,
    /// Hashes that the adversary made or changed: never timely traffic.
    pub forged: BTreeMap<u64, Micros>,
}

/// A sensor fault that provably arrived.
#[derive(Clone, Copy, Debug)]
pub(super) struct Befallen {
    /// Which sensor.
    pub sensor: Sensor,
    /// What befell it.
    pub kind: FaultKind,
    /// From.
    pub start: Micros,
    /// To.
    pub end: Micros,
}

/// Looks for the receipts of everything planned.
pub(super) fn find(evidence: &Evidence) -> Receipt {
    let mut receipt = Receipt { faults: faults(evidence), ..Receipt::default() };
    note_datagrams(evidence, &mut receipt);
    let mut zeros = Vec::new();
    for planned in &evidence.planned {
        // That a step began is its actor's word; what it did needs its own receipt, and only that counts as the start.
        if let Planned::Step(step) = planned {
            if !begun(evidence, *step) {
                receipt.missing.push(*planned);
            }
            continue;
        }
        let zero = match *planned {
            Planned::Step(_) => None,
            Planned::Action(action @ (Action::Forward | Action::Forge | Action::Republish)) => {
                mouth::receipt(evidence, action, 1)
            }
            Planned::Action(action @ (Action::Resend | Action::Lie | Action::Confuse)) => {
                mouth::receipt(evidence, action, 1)
            }
            Planned::Malformed => mouth::receipt(evidence, Action::Inject, 1),
            Planned::Action(Action::Kill) | Planned::Kill(_) => killed(evidence, planned),
            Planned::Action(action) => datagram(evidence, action),
            Planned::Rogue => orders::receipt(evidence),
            Planned::Suspend(node) => suspended(evidence, node),
            Planned::Stream(deed) => stream::receipt(evidence, deed),
            Planned::Broker(action) => planes::broker(evidence, action),
            Planned::Feed(action) => view::feed(evidence, action),
            Planned::Swallowed => view::swallowed(evidence),
            Planned::Fault(sensor) => receipt.faults.iter().find(|f| f.sensor == sensor).map(|f| f.start),
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
            | Action::Kill
            | Action::Forge
            | Action::Republish
            | Action::Resend
            | Action::Lie
            | Action::Confuse => {}
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
        Action::Forward | Action::Kill | Action::Forge | Action::Republish => false,
        Action::Resend | Action::Lie | Action::Confuse => false,
    };
    entries.into_iter().find(|(at, side, hash, delay)| confirmed(*at, *side, *hash, *delay)).map(|(at, ..)| at)
}

/// A kill counts when the dead said nothing more. The broker is heard of by its streams only: there the unit's mouth has to
/// see its own end.
fn killed(evidence: &Evidence, planned: &Planned) -> Option<Micros> {
    let silent = |node: NodeId, at: Micros| {
        let mut of = evidence.entries.iter().filter(|w| w.entry.node == node);
        // Who is started again speaks under another boot.
        let boot = of.clone().take_while(|w| w.at <= at).last().map(|w| w.entry.boot);
        !of.any(|w| Some(w.entry.boot) == boot && w.at > at + LAST_WORDS)
    };
    let cut_off = |at: Micros| {
        evidence.entries.iter().any(|w| {
            let ended = matches!(w.entry.event, Event::StreamSaw { sight: Sight::Closed | Sight::HungUp, .. });
            Some(w.entry.node) == NodeId::UNIT_A.guard() && ended && w.at >= at && w.at < evidence.duration
        })
    };
    let dead = |node: NodeId, at: Micros| silent(node, at) && (node != NodeId::BROKER || cut_off(at));
    evidence.entries.iter().find_map(|w| match (w.entry.event, planned) {
        (Event::Ended { node, killed: true }, Planned::Kill(wanted)) if node == *wanted && dead(node, w.at) => {
            Some(w.at)
        }
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

/// Whether the actor of `wanted` says that it began.
fn begun(evidence: &Evidence, wanted: StepName) -> bool {
    evidence.entries.iter().any(|w| matches!(w.entry.event, Event::Step { step, begun: true } if step == wanted))
}

/// That a process was kept from running counts when it wrote nothing while it hung. A slow one goes on writing, so the
/// word of who slowed it has to do: live, that is given once the kernel's process table shows the process stopped.
fn suspended(evidence: &Evidence, wanted: NodeId) -> Option<Micros> {
    let begins = |w: &Witnessed| match w.entry.event {
        Event::Suspended { node, how, on: true } if node == wanted => Some((w.at, how)),
        _ => None,
    };
    let ends = |from: Micros| {
        let over = |w: &&Witnessed| {
            w.at > from && matches!(w.entry.event, Event::Suspended { node, on: false, .. } if node == wanted)
        };
        evidence.entries.iter().find(over).map_or(Micros::MAX, |w| w.at)
    };
    // What was on its way when it was stopped may still come out; what comes as it goes on is its own again.
    let silent = |from: Micros| {
        let to = ends(from);
        let wrote = |w: &Witnessed| w.entry.node == wanted && w.at > from + UNDER_WAY && w.at < to;
        !evidence.entries.iter().any(wrote)
    };
    let suspensions: Vec<(Micros, Suspension)> = evidence.entries.iter().filter_map(begins).collect();
    let hangs = suspensions.iter().filter(|(_, how)| *how == Suspension::Hang);
    if hangs.into_iter().any(|(from, _)| !silent(*from)) {
        return None;
    }
    suspensions.first().map(|(from, _)| *from)
}

/// Sensor faults that the sim applied and that the other side saw.
fn faults(evidence: &Evidence) -> Vec<Befallen> {
    let mut found = Vec::new();
    for (i, w) in evidence.entries.iter().enumerate() {
        let Event::Fault { sensor, kind, active: true, .. } = w.entry.event else { continue };
        if w.entry.node != NodeId::SIM {
            continue;
        }
        let rest = &evidence.entries[i..];
        let end = rest.iter().find_map(|e| match e.entry.event {
            Event::Fault { sensor: s, kind: k, active: false, .. }
                if (s, k) == (sensor, kind) && e.entry.node == NodeId::SIM =>
            {
                Some(e.at)
            }
            _ => None,
        });
        let end = end.unwrap_or(evidence.duration);
        let missed =
            rest.iter().take_while(|e| e.at <= end.saturating_add(200_000)).any(|e| lacks(&e.entry.event, sensor));
        if missed || sensor == Sensor::Localisation && place::arrived(evidence, kind, w.at, end) {
            found.push(Befallen { sensor, kind, start: w.at, end });
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
