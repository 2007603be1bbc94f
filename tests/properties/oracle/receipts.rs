//! Receipts: an injection counts as arrived where another party than the actor observed it, at the planned place.

use evidence::trial::Outcome;
use evidence::{Plan, Planned};
use ground_truth::{Action, Any, FaultKind, GuardVerdict, Note, Sensor, Sight, StreamEffect, Suspension};
use oracle::Verdict;
use wire::codec::Text;
use wire::command::CommandKind;
use wire::core::{Side, Topic};
use wire::event::{Account, Event, Interface};
use wire::id::NodeId;
use wire::mode::Mode;
use wire::refusal::Reason;
use wire::time::Span;

use super::log::{Log, record};
use super::orders::obeyed;

#[test]
fn injection_without_receipt_is_invalid() {
    let mut log = Log::whole();
    log.planned.push(Planned::Action(Action::Replay).into());
    let event = Note::Attack { action: Action::Replay, side: Side::Server, length: 9, hash: 77, delay: Span::ZERO };
    log.add(4000, NodeId::RELAY_TELEMETRY, event);
    assert_eq!(log.judge().outcome, Outcome::Invalid, "the adversary's word alone is no receipt");
    log.saw(3000, NodeId::GATEWAY, 77, GuardVerdict::Passed).saw(4001, NodeId::GATEWAY, 77, GuardVerdict::Passed);
    assert_eq!(log.judge().outcome, Outcome::Undetected);
}

#[test]
fn drop_needs_a_guards_closed_account() {
    let mut log = Log::whole();
    log.planned.push(Planned::Action(Action::Drop).into());
    let event = Note::Attack { action: Action::Drop, side: Side::Server, length: 9, hash: 77, delay: Span::ZERO };
    log.add(4000, NodeId::RELAY_TELEMETRY, event);
    assert_eq!(log.judge().outcome, Outcome::Invalid);
}

#[test]
fn unlogged_bus_refusals_count_by_account() {
    let refused_in_all = |n: u64, came_ms: u64| {
        let at = Interface::Bus(Topic::Tracks);
        let reason = Reason::Tag;
        let mut log = Log::whole();
        log.planned.push(Planned::Action(Action::Forge).into());
        for _ in 0..256 {
            log.add(3000, NodeId::UNIT_A, Event::Refused { at, peer: None, reason, detail: Text::new("tag") });
        }
        // What is refused elsewhere is no part of this account.
        let at_the_link = Interface::Downlink;
        log.add(1500, NodeId::UNIT_A, Event::Refused { at: at_the_link, peer: None, reason, detail: Text::new("tag") });
        let side = Side::Server;
        let event = Note::Attack { action: Action::Forge, side, length: 9, hash: 77, delay: Span::ZERO };
        log.add(came_ms, NodeId::INSIDER_PERCEPTION, event);
        let sight = Note::MouthSaw { reader: NodeId::UNIT_A, at, length: 9, hash: 77 };
        log.add(came_ms + 1, NodeId::CAMPAIGN, sight);
        log.add(9990, NodeId::UNIT_A, Event::Count { account: Account::Refused(at, reason), n });
        log.judge().outcome
    };
    assert_eq!(
        refused_in_all(256, 4000),
        Outcome::Undetected,
        "all that were refused are written, and none is this one"
    );
    assert_eq!(refused_in_all(257, 4000), Outcome::Rejected);
    assert_eq!(refused_in_all(257, 2000), Outcome::Undetected, "while refusals were written this one was none");
}

/// A log in which the relay says at 4 s that it did `deed` to ten bytes at 100 of the direction to the unit, and the
/// witness there reports `seen`, by milliseconds.
fn tampered(deed: StreamEffect, delay_ms: u64, seen: &[(u64, Sight, u64, u32, u64)]) -> Log {
    let mut log = Log::whole();
    log.planned.push(Planned::Stream(deed).into());
    let (side, stream, hash, delay) = (Side::Client, 5, 77, Span::ms(delay_ms));
    let event = Note::Tampered { deed, side, stream, offset: 100, length: 10, hash, delay };
    log.add(4000, NodeId::RELAY_COMMAND, event);
    for (ms, sight, offset, length, hash) in seen.iter().copied() {
        log.add(ms, NodeId::UNIT_A.guard().expect("a guard"), Note::StreamSaw { sight, stream, offset, length, hash });
    }
    log
}

#[test]
fn stream_attack_needs_the_far_ends_witness() {
    use Sight::{Arrived, Closed, HungUp};
    type Seen<'a> = &'a [(u64, Sight, u64, u32, u64)];
    let cases: &[(StreamEffect, u64, Seen<'_>, bool)] = &[
        (StreamEffect::Held, 500, &[], false),
        (StreamEffect::Held, 500, &[(4100, Arrived, 100, 10, 77)], false),
        (StreamEffect::Held, 500, &[(4501, Arrived, 100, 10, 77)], true),
        (StreamEffect::Held, 500, &[(4100, Arrived, 90, 20, 1), (4501, Arrived, 110, 10, 2)], false),
        (StreamEffect::Damaged, 0, &[(4001, Arrived, 100, 10, 78)], false),
        (StreamEffect::Damaged, 0, &[(3999, Arrived, 100, 10, 77)], false),
        (StreamEffect::Damaged, 0, &[(4001, Arrived, 100, 10, 77)], true),
        (StreamEffect::Reset, 0, &[(3990, Closed, 100, 0, 0)], false),
        (StreamEffect::Reset, 0, &[(4001, HungUp, 100, 0, 0), (4002, Closed, 100, 0, 0)], false),
        (StreamEffect::Reset, 0, &[(10_001, Closed, 100, 0, 0)], false),
        (StreamEffect::Reset, 0, &[(4001, Arrived, 100, 10, 3), (4500, Closed, 110, 0, 0)], false),
        (StreamEffect::Reset, 0, &[(4001, Closed, 90, 0, 0)], true),
        (StreamEffect::HalfClosed, 0, &[(4001, Closed, 90, 0, 0)], false),
        (StreamEffect::HalfClosed, 0, &[(4001, Closed, 100, 0, 0)], true),
    ];
    for (i, (deed, delay, seen, receipt)) in cases.iter().enumerate() {
        assert_eq!(tampered(*deed, *delay, seen).judge().receipt, *receipt, "case {i}: {deed:?} {seen:?}");
    }
}

/// A claim of another relay, or at another time, is no receipt.
#[test]
fn stream_receipt_needs_its_own_relay_and_time() {
    let seen = [(4001, Sight::Closed, 100, 0, 0)];
    let injection = |author: NodeId, from_ms: u64| {
        let mut log = tampered(StreamEffect::HalfClosed, 0, &seen);
        log.entries.iter_mut().filter(|w| w.entry.node == NodeId::RELAY_COMMAND).for_each(|w| w.entry.node = author);
        let window = Plan { from: from_ms * 1000, ..Plan::from(Planned::Stream(StreamEffect::HalfClosed)) };
        log.planned = vec![window];
        log.judge().receipt
    };
    assert!(injection(NodeId::RELAY_COMMAND, 4000));
    assert!(!injection(NodeId::RELAY_TELEMETRY, 4000), "it has no stream");
    assert!(!injection(NodeId::RELAY_COMMAND, 5000), "before its window");
}

#[test]
fn hang_ending_as_another_begins_stays() {
    let (node, how) = (NodeId::PERCEPTION, Suspension::Hang);
    let mut log = Log::whole();
    log.planned = vec![Plan { from: 4_000_000, ..Plan::from(Planned::Suspend(node)) }];
    for (at, on) in [(3500, true), (4000, false), (4000, true), (6000, false)] {
        log.add(at, NodeId::CAMPAIGN, Note::Suspended { node, how, on });
    }
    for t in (1000..9000).step_by(25).filter(|t| !(3500..4000).contains(t) && !(4000..6000).contains(t)) {
        log.add(t, NodeId::CAMPAIGN, Note::Ran { node });
    }
    log.add(4000, NodeId::CAMPAIGN, Note::Ran { node });
    assert_eq!((log.judge().receipt, log.judge().zero), (true, Some(4_000_000)));
}

/// A log in which perception is said to be halted for half of each 100 ms from 4 s to 6 s; its core is fed at `fed`.
fn slowed(fed: impl Fn(u64) -> bool) -> Verdict {
    let node = NodeId::PERCEPTION;
    let how = Suspension::Slow { quota: 500, period: Span::ms(100) };
    let mut log = Log::whole();
    log.planned.push(Planned::Suspend(node).into());
    log.add(4000, NodeId::CAMPAIGN, Note::Suspended { node, how, on: true });
    for from in (4000..6000).step_by(100) {
        log.add(from, NodeId::CAMPAIGN, Note::Halted { node, on: true });
        log.add(from + 50, NodeId::CAMPAIGN, Note::Halted { node, on: false });
    }
    log.add(6000, NodeId::CAMPAIGN, Note::Suspended { node, how, on: false });
    for t in (2000..8000).step_by(25).filter(|t| fed(*t)) {
        log.add(t, NodeId::CAMPAIGN, Note::Ran { node });
    }
    log.judge()
}

#[test]
fn slow_process_needs_inputs_between_stops_only() {
    let stopped = |t: u64| (4000..6000).contains(&t) && t % 100 < 50;
    assert_eq!((slowed(|t| !stopped(t)).receipt, slowed(|t| !stopped(t)).zero), (true, Some(4_000_000)));
    assert!(!slowed(|_| true).receipt, "it runs on");
    assert!(!slowed(|t| !stopped(t) || t == 5025).receipt, "once is enough");
    assert!(!slowed(|_| false).receipt, "silent by itself");
    assert!(!slowed(|t| t < 4000).receipt, "it never runs again");
    assert!(!slowed(|t| t % 2000 == 1000).receipt, "so seldom that nothing is missing");
}

#[test]
fn claimed_broker_hang_must_delay_a_message() {
    let hung = |given_ms: u64, delivered: u64| {
        let (node, how) = (NodeId::BROKER, Suspension::Hang);
        let mut log = Log::whole();
        log.planned.push(Planned::Suspend(node).into());
        log.add(4000, NodeId::CAMPAIGN, Note::Suspended { node, how, on: true });
        log.add(6000, NodeId::CAMPAIGN, Note::Suspended { node, how, on: false });
        log.command(given_ms, 7, CommandKind::Hold);
        let event = Note::StreamSaw { sight: Sight::Delivered, stream: 1, offset: 0, length: 9, hash: 1 };
        log.add(delivered, NodeId::GATEWAY.guard().expect("a guard"), event);
        log.judge().receipt
    };
    assert!(hung(5000, 6010));
    assert!(!hung(5000, 5010), "it is handed on");
    assert!(!hung(3000, 6010), "nothing was given to it");
}

/// A gateway insider claims at 4 s that it keeps a report for 800 ms; the console received its message at `arrived_ms`, and
/// the report was on the display at once where `shown`.
fn late(arrived_ms: u64, shown: bool) -> Verdict {
    let mut log = Log::whole();
    log.planned.push(Planned::Late(800_000).into());
    log.add(4001, NodeId::INSIDER_GATEWAY, Note::Withheld { record: record(4000) });
    if !shown {
        log.entries.retain(|w| {
            !(w.at > 4_000_000 && w.at < 4_850_000 && matches!(w.entry.event, Any::Service(Event::Displayed { .. })))
        });
    }
    log.displayed(4250, Mode::PrepareToAct, 3900);
    let (action, side, delay) = (Action::Delay, Side::Server, Span::ms(800));
    log.add(4200, NodeId::INSIDER_GATEWAY, Note::Attack { action, side, length: 9, hash: 77, delay });
    let (reader, at) = (NodeId::CONSOLE, Interface::Bus(Topic::Feed));
    log.add(arrived_ms, NodeId::CAMPAIGN, Note::MouthSaw { reader, at, length: 9, hash: 77 });
    log.judge()
}

#[test]
fn claimed_late_report_must_be_late() {
    assert_eq!((late(4802, false).receipt, late(4802, false).zero), (true, Some(4_001_000)));
    assert!(!late(4802, true).receipt, "it was on the display at once");
    assert!(!late(4300, false).receipt, "half a second early, whatever delay was claimed");
    assert!(!late(5500, false).receipt, "that was another one");
}

#[test]
fn each_table_needs_a_receipt_in_its_window() {
    let window = |planned, ms: u64| Plan { from: ms * 1000, until: ms * 1000 + 200_000, ..Plan::from(planned) };
    let mut log = obeyed(4000, NodeId::OPERATOR, CommandKind::Disarm, NodeId::OPERATOR);
    log.planned = vec![window(Planned::Rogue, 4000), window(Planned::Rogue, 6000)];
    assert!(!log.judge().receipt);
    log.planned[1] = window(Planned::Rogue, 3900);
    assert!(log.judge().receipt);
    let mut log = Log::whole();
    log.thermal_fault(4000, 4200);
    let fault = Planned::Fault(Sensor::Thermal, FaultKind::Dropout);
    for (plan, receipt) in [
        (window(fault, 4000), true),
        (window(fault, 6000), false),
        (window(Planned::Fault(Sensor::Thermal, FaultKind::Freeze), 4000), false),
    ] {
        log.planned = vec![plan];
        assert_eq!(log.judge().receipt, receipt, "{plan:?}");
    }
}

#[test]
fn memory_rogue_is_no_gateway_receipt() {
    let forged = |node| {
        let mut log = Log::whole();
        log.planned.push(Planned::Feed(Action::Forge).into());
        let (action, side, delay) = (Action::Forge, Side::Server, Span::ZERO);
        log.add(4000, node, Note::Attack { action, side, length: 9, hash: 77, delay });
        let (reader, at) = (NodeId::CONSOLE, Interface::Bus(Topic::Feed));
        log.add(4001, NodeId::CAMPAIGN, Note::MouthSaw { reader, at, length: 9, hash: 77 });
        log.judge().receipt
    };
    assert!(forged(NodeId::INSIDER_GATEWAY));
    assert!(!forged(NodeId::IMPOSTOR));
}
