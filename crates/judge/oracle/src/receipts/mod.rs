//! Receipts: did the injection provably reach its target?
//!
//! A receipt needs two witnesses: the actor's entry, and an observation at the target by another process. The
//! adversary's own entry is never enough. For a datagram the guard's log must show the very bytes (by hash) at a fitting time;
//! for one that was dropped, that it never showed them and that a record is missing there. For a sensor fault,
//! perception or autonomy must have taken in, to the last byte, a message that would read otherwise without it
//! (`facts::sensor_fault`); its effect on them is not asked for here.
//!
//! No module of this folder reads `properties`.
//!
//! | module | receipts |
//! |---|---|
//! | `window` | the time of a planned action |
//! | `datagram`, `stream`, `broker` | the relay's actions on datagrams and on byte streams; a hostile broker's on publications |
//! | `delivery`, `feed`, `rogue`, `takeover` | messages of insiders; a gateway insider's actions on the feed; orders of a rogue; sessions that another took |
//! | `guest_bus` | attacks on the bus of a guest's own programs |
//! | `process_fault` | a kill, a hang, a share of the time, a full disk |
//! | `disguise` | objects that are made to look like another |
//! | `masked` | the obstacle that kept an injection without a receipt from arriving |

pub(crate) mod broker;
pub(crate) mod datagram;
pub(crate) mod delivery;
pub(crate) mod disguise;
pub(crate) mod feed;
pub(crate) mod guest_bus;
pub(crate) mod masked;
pub(crate) mod process_fault;
pub(crate) mod rogue;
pub(crate) mod stream;
pub(crate) mod takeover;
pub(crate) mod window;

use evidence::{Evidence, Mask, Micros, Plan, Planned};
use ground_truth::{Action, Any, Note, StepName};
use wire::id::NodeId;

use crate::facts::Facts;
use window::Window;

/// Arrival of an injection, or the obstacle that kept it from arriving; none where neither is proven.
pub(crate) type Arrival = Option<Result<Micros, Mask>>;

/// Receipts of the injections of a trial.
#[derive(Clone, Debug, Default)]
pub(crate) struct Receipts {
    /// True if at least one planned injection has both witnesses, and of each other the obstacle is known that kept it from arriving.
    pub complete: bool,
    /// Arrival of each planned injection.
    pub arrivals: Vec<(Plan, Arrival)>,
    /// The actor's first entry that has a second witness.
    pub zero: Option<Micros>,
}

/// Looks for the receipts of everything planned.
pub(crate) fn find(facts: &Facts) -> Receipts {
    let evidence = facts.evidence;
    let mut arrivals = Vec::new();
    let mut complete = true;
    for plan in &evidence.planned {
        // The begin of a step is reported by its actor alone: each action of the step needs a receipt, and only these
        // count as the start.
        if let Planned::Step(step) = plan.what {
            complete &= step_begun(evidence, step);
            continue;
        }
        let arrival = Window::from_plan(evidence, plan).and_then(|window| {
            let arrived = arrived_at(facts, plan.what, window).map(Ok);
            arrived.or_else(|| masked::obstacle(facts, plan, window).map(Err))
        });
        complete &= arrival.is_some();
        arrivals.push((*plan, arrival));
    }
    let zero = arrivals.iter().filter_map(|(_, arrival)| (*arrival)?.ok()).min();
    // Where everything was masked no injection took place, and the trial shows no result.
    Receipts { complete: complete && (arrivals.is_empty() || zero.is_some()), arrivals, zero }
}

/// Time at which an action planned within `window` was first seen to be done.
fn arrived_at(facts: &Facts, planned: Planned, window: Window) -> Option<Micros> {
    let evidence = facts.evidence;
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
        Planned::Kill(node) => process_fault::killed_at(evidence, node, window),
        Planned::Suspend(node) => process_fault::suspended_at(evidence, node, window),
        Planned::Fill(node) => process_fault::disk_filled_at(evidence, node, window),
        Planned::Disguise(object, class) => disguise::paint_seen_at(evidence, object, class, window),
        Planned::Print(object, class) => disguise::print_seen_at(evidence, object, class, window),
        Planned::Perturbation(class) => disguise::perturbed_at(evidence, class, window),
        Planned::GuestBus(attack) => guest_bus::receipt(evidence, attack, window),
        Planned::Rogue => rogue::receipt(evidence, window),
        Planned::Takeover(peer) => takeover::receipt(evidence, peer, window),
        Planned::Stream(deed) => stream::receipt(evidence, deed, window),
        Planned::Broker(action) => broker::receipt(evidence, action, window),
        Planned::Feed(action) => feed::receipt(evidence, action, window),
        Planned::Late(delay) => feed::delayed_report_at(evidence, delay, window),
        Planned::Swallowed => feed::swallowed_command_at(evidence, window),
        Planned::Fault(sensor, kind) => {
            let mut planned = facts.sensor_faults.iter().filter(|f| (f.sensor, f.kind) == (sensor, kind));
            planned.find(|f| window.contains(f.start)).map(|f| f.start)
        }
    }
}

/// True if the actor of `wanted` says that it began.
fn step_begun(evidence: &Evidence, wanted: StepName) -> bool {
    evidence
        .entries
        .iter()
        .any(|w| matches!(w.entry.event, Any::Instrument(Note::Step { step, begun: true }) if step == wanted))
}
