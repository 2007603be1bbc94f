//! Receipts: did the fault provably reach its target?
//!
//! A receipt needs two witnesses: the actor's entry, and an observation at the target by another process. The
//! adversary's word alone is none. For a datagram the guard's log must show the very bytes (by hash) at a fitting time;
//! for one that was dropped, that it never showed them and that something is missing there. For a sensor fault,
//! perception or autonomy must have taken in, to the last byte, a message that would read otherwise without it; its
//! effect on them is not asked here. A missing message that provably could not arrive is `masked`'s. Actions on a byte
//! stream are `stream`'s, on publications `planes`', messages of insiders `delivery`'s, disguises `disguise`'s, process
//! faults `life`'s.

pub(crate) mod broker;
pub(crate) mod datagram;
pub(crate) mod delivery;
pub(crate) mod disguise;
pub(crate) mod feed;
pub(crate) mod masked;
pub(crate) mod process_fault;
pub(crate) mod rogue;
pub(crate) mod stream;
pub(crate) mod window;

use evidence::{Evidence, Micros, Planned};
use instrument::{Action, Any, Note, Sensor, StepName};
use wire::id::NodeId;

use crate::arrived::{Befallen, Receipt};
use crate::window::Window;
use crate::{datagram, delivery, disguise, life, masked, orders, planes, stream, takeover, view};

/// Looks for the receipts of everything planned.
pub(crate) fn find(evidence: &Evidence) -> Receipt {
    let mut receipt = Receipt { faults: faults(evidence), ..Receipt::default() };
    note_datagrams(evidence, &mut receipt);
    let mut whole = true;
    for plan in &evidence.planned {
        // That a step began is its actor's word; what it did needs its own receipt, and only that counts as the start.
        if let Planned::Step(step) = plan.what {
            whole &= begun(evidence, step);
            continue;
        }
        let fate = Window::of(evidence, plan).and_then(|window| {
            let arrived = of(evidence, plan.what, window, &receipt.faults).map(Ok);
            arrived.or_else(|| masked::by(evidence, plan, window, &receipt.faults).map(Err))
        });
        whole &= fate.is_some();
        receipt.plans.push((*plan, fate));
    }
    receipt.zero = receipt.plans.iter().filter_map(|(_, fate)| (*fate)?.ok()).min();
    // Where everything was masked nothing was injected, and the trial shows nothing.
    receipt.whole = whole && (receipt.plans.is_empty() || receipt.zero.is_some());
    receipt
}

/// Time at which an action planned within `window` was first seen to be done.
fn of(evidence: &Evidence, planned: Planned, window: Window, faults: &[Befallen]) -> Option<Micros> {
    match planned {
        Planned::Step(_) => None,
        Planned::Action(action @ (Action::Forward | Action::Resend | Action::Lie | Action::Confuse)) => {
            delivery::receipt(evidence, action, window, &[NodeId::INSIDER_B])
        }
        Planned::Action(action @ (Action::Forge | Action::Republish)) => {
            delivery::receipt(evidence, action, window, &[NodeId::INSIDER_PERCEPTION, NodeId::IMPOSTOR])
        }
        Planned::Malformed => delivery::receipt(evidence, Action::Inject, window, &[NodeId::INSIDER_B]),
        Planned::Action(action) => datagram::receipt(evidence, action, window),
        Planned::Kill(node) => life::killed(evidence, node, window),
        Planned::Suspend(node) => life::suspended(evidence, node, window),
        Planned::Fill(node) => life::filled(evidence, node, window),
        Planned::Disguise(object, class) => disguise::receipt(evidence, object, class, window),
        Planned::Print(object, class) => disguise::printed(evidence, object, class, window),
        Planned::Perturbation(class) => disguise::perturbed(evidence, class, window),
        Planned::Rogue => orders::receipt(evidence, window),
        Planned::Takeover(peer) => takeover::receipt(evidence, peer, window),
        Planned::Stream(deed) => stream::receipt(evidence, deed, window),
        Planned::Broker(action) => planes::broker(evidence, action, window),
        Planned::Feed(action) => view::feed(evidence, action, window),
        Planned::Late(by) => view::late(evidence, by, window),
        Planned::Swallowed => view::swallowed(evidence, window),
        Planned::Fault(sensor, kind) => {
            let mut mine = faults.iter().filter(|f| (f.sensor, f.kind) == (sensor, kind) && window.has(f.start));
            mine.next().map(|f| f.start)
        }
    }
}

fn note_datagrams(evidence: &Evidence, receipt: &mut Receipt) {
    for w in &evidence.entries {
        let Any::Instrument(Note::Attack { action, hash, .. }) = w.entry.event else { continue };
        match action {
            // What was dropped may be put back by another part of the same attack: it was held until then.
            Action::Delay | Action::Reorder | Action::Drop => {
                receipt.taken.entry(hash).or_insert(w.at);
            }
            Action::Corrupt | Action::Inject => {
                receipt.forged.insert(hash, w.at);
            }
            // Only the first that comes of these bytes can be timely (`link::silences`), whatever is repeated.
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

/// True if the actor of `wanted` says that it began.
fn begun(evidence: &Evidence, wanted: StepName) -> bool {
    evidence
        .entries
        .iter()
        .any(|w| matches!(w.entry.event, Any::Instrument(Note::Step { step, begun: true }) if step == wanted))
}

/// Sensor faults that the sim applied and with readings that the other side took in.
fn faults(evidence: &Evidence) -> Vec<Befallen> {
    let mut found = Vec::new();
    for (i, w) in evidence.entries.iter().enumerate() {
        let Any::Instrument(Note::Fault { sensor, kind, active: true, .. }) = w.entry.event else { continue };
        if w.entry.node != evidence.under.sim {
            continue;
        }
        let rest = &evidence.entries[i..];
        let end = rest.iter().find_map(|e| match e.entry.event {
            Any::Instrument(Note::Fault { sensor: s, kind: k, active: false, .. })
                if (s, k) == (sensor, kind) && e.entry.node == evidence.under.sim =>
            {
                Some(e.at)
            }
            _ => None,
        });
        let end = end.unwrap_or(evidence.duration);
        // What a fault changed is told of while it lasts, and may come in a little later.
        let changed = rest.iter().take_while(|e| e.at <= end).filter_map(|e| match e.entry.event {
            Any::Instrument(Note::Altered { sensor: s, kind: k, hash })
                if (s, k) == (sensor, kind) && e.entry.node == evidence.under.sim =>
            {
                Some((e.at, hash))
            }
            _ => None,
        });
        let arrived =
            changed.into_iter().any(|(at, hash)| delivery::took(evidence, consumer(evidence, sensor), hash, at));
        if arrived {
            found.push(Befallen { sensor, kind, start: w.at, end });
        }
    }
    found
}

/// Receiver of the readings of `sensor`.
fn consumer(evidence: &Evidence, sensor: Sensor) -> NodeId {
    match sensor {
        Sensor::Rgb | Sensor::Depth | Sensor::Thermal | Sensor::Lidar => evidence.under.perception,
        Sensor::Odometry | Sensor::Localisation | Sensor::Height => evidence.under.node(),
    }
}
