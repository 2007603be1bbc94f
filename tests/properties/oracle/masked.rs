//! Fate of an injection: delivered to its target or stopped, by whom, and unproven cases.

use evidence::trial::Outcome;
use evidence::{Fate, Mask, Needs, Plan, Planned, Takes};
use ground_truth::{Action, Any, FaultKind, GuardVerdict, Note, Sensor};
use wire::command::CommandKind;
use wire::core::Side;
use wire::event::Event;
use wire::id::{FrameId, NodeId};
use wire::time::Span;

use super::log::{Log, command};

/// An unanswered fault of localisation, with its reporter, and the reader that received it.
fn faulty(author: NodeId, told: FaultKind, reader: NodeId) -> Log {
    let (sensor, kind) = (Sensor::Localisation, FaultKind::Jump);
    let mut log = Log::whole();
    log.planned.push(Planned::Fault(sensor, kind).into());
    for (ms, active) in [(4000, true), (5000, false)] {
        log.add(ms, NodeId::SIM, Note::Fault { sensor, kind, active, frame: FrameId(1) });
    }
    log.altered(4000, sensor, told, reader);
    log.entries
        .iter_mut()
        .filter(|w| matches!(w.entry.event, Any::Instrument(Note::Altered { .. })))
        .for_each(|w| w.entry.node = author);
    log
}

#[test]
fn unnoticed_received_fault_is_undetected_not_invalid() {
    let (sim, unit, jump) = (NodeId::SIM, NodeId::UNIT_A, FaultKind::Jump);
    let verdict = faulty(sim, jump, unit).judge();
    assert_eq!((verdict.receipt, verdict.outcome), (true, Outcome::Undetected));
    assert_eq!(verdict.injections[0].fate, Fate::Delivered { at: 4_000_000, noticed: false });
    for (log, why) in [
        (faulty(sim, jump, NodeId::PERCEPTION), "the reading was not for it"),
        (faulty(unit, jump, unit), "whoever takes it in is no witness of what it was to be"),
        (faulty(sim, FaultKind::Drift, unit), "another fault changed it"),
    ] {
        let verdict = log.judge();
        assert_eq!((verdict.injections[0].fate, verdict.outcome), (Fate::NotProven, Outcome::Invalid), "{why}");
    }
}

/// A planned stop of perception from 5 s to 7 s.
fn stop() -> Plan {
    let running: &[NodeId] = &[NodeId::PERCEPTION];
    let needs = Needs { running, takes: None };
    Plan { from: 5_000_000, until: 7_000_000, needs, ..Plan::from(Planned::Suspend(NodeId::PERCEPTION)) }
}

/// Its death is known only if it left no mark afterwards.
#[test]
fn dead_process_cannot_be_stopped() {
    let fate = |died_ms: u64, mark_ms: Option<u64>| {
        let mut log = Log::whole();
        log.add(2000, NodeId::PERCEPTION, Event::Started).killed(died_ms, NodeId::PERCEPTION);
        mark_ms.into_iter().for_each(|ms| _ = log.add(ms, NodeId::PERCEPTION, Event::Started));
        log.planned.push(stop());
        let verdict = log.judge_with(vec![NodeId::PERCEPTION]);
        (verdict.injections[1].fate, verdict.receipt)
    };
    assert_eq!(fate(3000, None), (Fate::Masked(Mask::Gone(NodeId::PERCEPTION)), true));
    assert_eq!(fate(3000, Some(6000)), (Fate::NotProven, false), "it lived");
    assert_eq!(fate(6000, None), (Fate::NotProven, false), "it could have been stopped before");
}

#[test]
fn a_hang_does_not_keep_itself_from_arriving() {
    let mut log = Log::whole();
    log.planned.push(stop());
    for (ms, on) in [(5000, true), (7000, false)] {
        let how = ground_truth::Suspension::Hang;
        log.add(ms, NodeId::CAMPAIGN, Note::Suspended { node: NodeId::PERCEPTION, how, on });
    }
    let verdict = log.judge();
    assert_eq!((verdict.injections[0].fate, verdict.outcome), (Fate::NotProven, Outcome::Invalid));
}

/// A log in which something is delivered, and a HOLD was to be swallowed between 5 s and 7 s.
fn swallowing(delivered: bool) -> Log {
    let mut log = Log::whole();
    if delivered {
        log.planned.push(Planned::Action(Action::Replay).into());
        let (action, side) = (Action::Replay, Side::Server);
        let event = Note::Attack { action, side, length: 9, hash: 77, delay: Span::ZERO };
        log.add(4000, NodeId::RELAY_TELEMETRY, event);
        log.saw(3000, NodeId::GATEWAY, 77, GuardVerdict::Passed).saw(4001, NodeId::GATEWAY, 77, GuardVerdict::Passed);
    }
    let needs = Needs { running: &[], takes: Some(Takes::Orders(Some("hold"))) };
    log.planned.push(Plan { from: 5_000_000, until: 7_000_000, needs, ..Plan::from(Planned::Swallowed) });
    log
}

#[test]
fn without_requests_no_order_can_be_swallowed() {
    let fate = |log: &Log| {
        let verdict = log.judge();
        (verdict.injections.last().map(|injection| injection.fate), verdict.outcome)
    };
    let masked = Some(Fate::Masked(Mask::NothingAsked));
    assert_eq!(fate(&swallowing(true)), (masked, Outcome::Undetected), "judged as if it had not been planned");
    assert_eq!(fate(&swallowing(false)), (masked, Outcome::Invalid), "nothing arrived at all: no success of anybody's");

    let hold = Event::Intended { command: command(9), kind: CommandKind::Hold, tag: None };
    let mut requested = swallowing(true);
    requested.add(6900, NodeId::CONSOLE, hold);
    assert_eq!(fate(&requested).0, Some(Fate::NotProven));
    let mut later = swallowing(true);
    later.add(9900, NodeId::CONSOLE, hold);
    assert_eq!(fate(&later).0, masked, "after its time");
    let mut claimed = swallowing(true);
    claimed.add(6000, NodeId::INSIDER_GATEWAY, Note::Swallowed { command: command(9) });
    assert_eq!(fate(&claimed).0, Some(Fate::NotProven), "it says that it did, of which nobody knows");
}
