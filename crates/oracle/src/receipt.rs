//! Receipts: did the fault provably reach its target?
//!
//! A receipt needs two witnesses: the actor's entry, and an observation at the target by another process. The
//! adversary's word alone is none. For a datagram the guard's log must show the very bytes (by hash) at a fitting
//! time; for one that was dropped, that it never showed them and that something is missing there. For a sensor fault,
//! the mouth of perception or autonomy must have taken in, to the last byte, a message that would read otherwise without it; whether they
//! made anything of it is not asked here. What is missing and provably could not arrive is `masked`'s. What was done to a byte stream is `stream`'s, to publications `planes`', what insiders sent
//! `mouth`'s, what stands there in disguise `disguise`'s, what befell processes `life`'s.

use std::collections::BTreeMap;

use evidence::{Evidence, Mask, Micros, Plan, Planned};
use wire::core::Side;
use wire::event::{Account, Action, Event, FaultKind, GuardVerdict, Sensor};
use wire::id::NodeId;
use wire::step::StepName;

use super::window::Window;
use super::{disguise, life, link, masked, mouth, orders, planes, stream, takeover, view};

/// How close together a guard logs the pieces of one datagram, and how long a datagram is on its way.
const TOGETHER: Micros = 500;
const ON_THE_WAY: Micros = 200_000;
/// What a link takes by itself; so short a delay shows nothing.
const LEAST_DELAY: Micros = 10_000;

/// What was established about the injections.
#[derive(Clone, Debug, Default)]
pub(super) struct Receipt {
    /// One planned injection at least has both witnesses, and of each other it is known what kept it from arriving.
    pub whole: bool,
    /// When each planned injection arrived, or what kept it from arriving; nothing where neither is proven.
    pub plans: Vec<(Plan, Option<Result<Micros, Mask>>)>,
    /// The actor's first entry that has a second witness.
    pub zero: Option<Micros>,
    /// Sensor faults with receipts.
    pub faults: Vec<Befallen>,
    /// When the relay took a datagram off its way, by its hash: to send it later, or never.
    pub taken: BTreeMap<u64, Micros>,
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

impl Befallen {
    /// Whether the unit is without the sensor: it gives nothing, or shows the past under fresh stamps. Nothing rests on
    /// odometry alone while fixes come, and what a frozen fix comes to is `place`'s.
    pub(super) fn is_loss(&self) -> bool {
        match self.kind {
            FaultKind::Dropout => self.sensor != Sensor::Odometry,
            FaultKind::Freeze | FaultKind::Skew => !matches!(self.sensor, Sensor::Odometry | Sensor::Localisation),
            FaultKind::Noise | FaultKind::Occlusion | FaultKind::Drift | FaultKind::Jump => false,
            FaultKind::TimeStep | FaultKind::TimeDrift | FaultKind::Chaff | FaultKind::Perturbation => false,
        }
    }
}

/// Looks for the receipts of everything planned.
pub(super) fn find(evidence: &Evidence) -> Receipt {
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

/// When something planned within `window` was first seen to be done.
fn of(evidence: &Evidence, planned: Planned, window: Window, faults: &[Befallen]) -> Option<Micros> {
    match planned {
        Planned::Step(_) => None,
        Planned::Action(action @ (Action::Forward | Action::Resend | Action::Lie | Action::Confuse)) => {
            mouth::receipt(evidence, action, window, &[NodeId::INSIDER_B])
        }
        Planned::Action(action @ (Action::Forge | Action::Republish)) => {
            mouth::receipt(evidence, action, window, &[NodeId::INSIDER_PERCEPTION, NodeId::IMPOSTOR])
        }
        Planned::Malformed => mouth::receipt(evidence, Action::Inject, window, &[NodeId::INSIDER_B]),
        Planned::Action(action) => datagram(evidence, action, window),
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
        let Event::Attack { action, hash, .. } = w.entry.event else { continue };
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

/// Times at which any guard saw these bytes.
fn seen(evidence: &Evidence, wanted: u64) -> impl Iterator<Item = Micros> {
    evidence.entries.iter().filter_map(move |w| match w.entry.event {
        Event::GuardSaw { hash, .. } if hash == wanted => Some(w.at),
        _ => None,
    })
}

/// The relay's first entry of `action` within `window` whose bytes the target's guard confirms.
pub(super) fn datagram(evidence: &Evidence, action: Action, window: Window) -> Option<Micros> {
    let entries = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Event::Attack { action: a, side, length, hash, delay }
            if a == action && w.entry.node == NodeId::RELAY_TELEMETRY && window.has(w.at) =>
        {
            Some((w.at, side, length, hash, delay.0))
        }
        _ => None,
    });
    // Only a guard that kept a log and closed its account is a witness of an absence.
    let wrote = |test: &dyn Fn(&Event) -> bool| evidence.entries.iter().any(|w| test(&w.entry.event));
    let guarded = wrote(&|e| matches!(e, Event::GuardSaw { .. }))
        && wrote(&|e| matches!(e, Event::Count { account: Account::GuardIn, .. }));
    let confirmed = |(at, side, length, hash, delay): (Micros, Side, u16, u64, Micros)| match action {
        Action::Drop => guarded && seen(evidence, hash).next().is_none() && link::missed(evidence, side, at),
        Action::Delay | Action::Reorder => delay >= LEAST_DELAY && seen(evidence, hash).any(|s| s >= at + delay),
        Action::Duplicate | Action::Replay => seen(evidence, hash).any(|s| s >= at) && seen(evidence, hash).count() > 1,
        Action::Corrupt => seen(evidence, hash).any(|s| s >= at) || in_pieces(evidence, at, side, length),
        Action::Inject | Action::Reoriginate => seen(evidence, hash).any(|s| s >= at),
        Action::Forward | Action::Kill | Action::Forge | Action::Republish => false,
        Action::Resend | Action::Lie | Action::Confuse => false,
    };
    entries.into_iter().find(|claim| confirmed(*claim)).map(|(at, ..)| at)
}

/// Whether a guard took a datagram of this length apart, just after `at`, and refused a piece of it: it logs records, and
/// what was made longer or put together of two is no longer one.
fn in_pieces(evidence: &Evidence, at: Micros, side: Side, length: u16) -> bool {
    let target = if side == Side::Server { NodeId::GATEWAY } else { NodeId::UNIT_A };
    let pieces = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Event::GuardSaw { length, verdict, .. } if Some(w.entry.node) == target.guard() && w.at >= at => {
            Some((w.at, u32::from(length), verdict != GuardVerdict::Passed))
        }
        _ => None,
    });
    let pieces: Vec<(Micros, u32, bool)> = pieces.take_while(|(seen, ..)| *seen <= at + ON_THE_WAY).collect();
    pieces.chunk_by(|a, b| b.0 - a.0 <= TOGETHER).any(|datagram| {
        let whole: u32 = datagram.iter().map(|(_, length, _)| length).sum();
        datagram.len() > 1 && whole == u32::from(length) && datagram.iter().any(|(.., refused)| *refused)
    })
}

/// Whether the actor of `wanted` says that it began.
fn begun(evidence: &Evidence, wanted: StepName) -> bool {
    evidence.entries.iter().any(|w| matches!(w.entry.event, Event::Step { step, begun: true } if step == wanted))
}

/// Sensor faults that the sim applied and whose readings the other side took in.
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
        // What a fault changed is told of while it lasts, and may come in a little later.
        let changed = rest.iter().take_while(|e| e.at <= end).filter_map(|e| match e.entry.event {
            Event::Altered { sensor: s, kind: k, hash } if (s, k) == (sensor, kind) && e.entry.node == NodeId::SIM => {
                Some((e.at, hash))
            }
            _ => None,
        });
        let arrived = changed.into_iter().any(|(at, hash)| mouth::took(evidence, consumer(sensor), hash, at));
        if arrived {
            found.push(Befallen { sensor, kind, start: w.at, end });
        }
    }
    found
}

/// Who the readings of `sensor` are for.
fn consumer(sensor: Sensor) -> NodeId {
    match sensor {
        Sensor::Rgb | Sensor::Depth | Sensor::Thermal | Sensor::Lidar => NodeId::PERCEPTION,
        Sensor::Odometry | Sensor::Localisation => NodeId::UNIT_A,
    }
}
