//! Leases and fan-out.

use sha2::{Digest, Sha256};
use wire::command::{Ack, CommandKind, Intent, Request, TimeTag};
use wire::core::Input;
use wire::id::{NodeId, Nonce, PeerId, SessionId};
use wire::mode::Mode;
use wire::policy::Policy;
use wire::refusal::Reason;
use wire::time::Span;

use crate::bench::{Bench, command, intent, signed_intent};

fn grants(bench: &mut Bench, session: SessionId, duration: Span) -> usize {
    let before = bench.units[&session].grants;
    bench.pass(duration);
    bench.units[&session].grants - before
}

#[test]
fn no_lease_before_a_units_first_report() {
    let mut bench = Bench::new(Policy::default());
    let a = bench.open(1, NodeId::UNIT_A);
    assert_eq!(bench.hello(a), None);
    assert_eq!(grants(&mut bench, a, Span::s(2)), 0);
    bench.hello(a);
    assert_eq!(bench.report(a), None);
    assert_eq!(grants(&mut bench, a, Span::ms(250)), 2);
}

#[test]
fn grants_stop_while_telemetry_is_stale() {
    let mut bench = Bench::new(Policy::default());
    let a = bench.reporting(1, NodeId::UNIT_A);
    assert!(grants(&mut bench, a, Span::ms(300)) > 0);
    assert_eq!(grants(&mut bench, a, Span::s(2)), 0);
    bench.hello(a);
    assert_eq!(bench.report(a), None);
    assert!(grants(&mut bench, a, Span::ms(300)) > 0);
}

#[test]
fn anothers_telemetry_earns_no_lease() {
    let mut bench = Bench::new(Policy::default());
    let a = bench.open(1, NodeId::UNIT_A);
    bench.hello(a);
    bench.reporting(2, NodeId::UNIT_B);
    assert_eq!(grants(&mut bench, a, Span::ms(500)), 0);
}

#[test]
fn unacknowledged_or_refused_hold_stops_grants() {
    let mut bench = Bench::new(Policy::default());
    let a = bench.reporting(1, NodeId::UNIT_A);
    let hold = signed_intent(&intent(1, CommandKind::Hold, ""));
    assert_eq!(bench.stage(&hold), None);
    let supervised = |bench: &mut Bench| {
        bench.hello(a);
        assert_eq!(bench.report(a), None);
        grants(bench, a, Span::ms(250)) > 0
    };
    assert!(!supervised(&mut bench));
    let ack =
        Ack { id: command(1), intent: Sha256::digest(&hold).into(), refused: None, mode: Mode::HoldSafe, due: None };
    bench.acknowledge(NodeId::UNIT_B, &ack);
    assert!(!supervised(&mut bench), "another unit's acknowledgement");
    bench.acknowledge(NodeId::UNIT_A, &Ack { intent: [0; 32], ..ack });
    assert!(!supervised(&mut bench), "an acknowledgement of another intent");
    bench.acknowledge(NodeId::UNIT_A, &Ack { refused: Some(Reason::Late), ..ack });
    assert!(!supervised(&mut bench), "a refusal");
    bench.acknowledge(NodeId::UNIT_A, &ack);
    assert!(supervised(&mut bench));
}

/// Neither before it is due nor by the word that it is stored is a HOLD taken for executed.
#[test]
fn hold_with_a_time_tag_stops_grants_from_its_time_on() {
    let mut bench = Bench::new(Policy::default());
    let a = bench.reporting(1, NodeId::UNIT_A);
    let tag = Some(TimeTag { after: Span::s(2), within: Span::s(1) });
    let hold = signed_intent(&Intent { tag, ..intent(1, CommandKind::Hold, "") });
    assert_eq!(bench.stage(&hold), None);
    let supervised = |bench: &mut Bench| {
        bench.hello(a);
        assert_eq!(bench.report(a), None);
        grants(bench, a, Span::ms(250)) > 0
    };
    let ack = Ack {
        id: command(1),
        intent: Sha256::digest(&hold).into(),
        refused: None,
        mode: Mode::Ready,
        due: Some(Span::s(2)),
    };
    bench.acknowledge(NodeId::UNIT_A, &ack);
    assert!(supervised(&mut bench), "it is not due");
    bench.pass(Span::s(2));
    assert!(!supervised(&mut bench), "it is due, and stored is not executed");
    bench.acknowledge(NodeId::UNIT_A, &Ack { mode: Mode::HoldSafe, due: None, ..ack });
    assert!(supervised(&mut bench));
}

/// A holder of an operator's key could else have grants resumed by HOLDs for much later.
#[test]
fn holds_for_later_push_out_none_that_is_due() {
    let mut bench = Bench::new(Policy::default());
    let a = bench.reporting(1, NodeId::UNIT_A);
    assert_eq!(bench.stage(&signed_intent(&intent(1, CommandKind::Hold, ""))), None);
    for sequence in 2..=6 {
        bench.pass(Span::s(1));
        let tag = Some(TimeTag { after: Span::s(20), within: Span::s(1) });
        let later = signed_intent(&Intent { tag, ..intent(sequence, CommandKind::Hold, "") });
        assert_eq!(bench.stage(&later), None, "{sequence}");
    }
    bench.hello(a);
    assert_eq!(bench.report(a), None);
    assert_eq!(grants(&mut bench, a, Span::ms(250)), 0);
}

#[test]
fn executed_hold_leaves_one_for_later() {
    let mut bench = Bench::new(Policy::default());
    let a = bench.reporting(1, NodeId::UNIT_A);
    let tag = Some(TimeTag { after: Span::s(2), within: Span::s(1) });
    let later = signed_intent(&Intent { tag, ..intent(1, CommandKind::Hold, "") });
    let now = signed_intent(&intent(2, CommandKind::Hold, ""));
    assert_eq!((bench.stage(&later), bench.stage(&now)), (None, None));
    let supervised = |bench: &mut Bench| {
        bench.hello(a);
        assert_eq!(bench.report(a), None);
        grants(bench, a, Span::ms(250)) > 0
    };
    let intent = Sha256::digest(&now).into();
    bench.acknowledge(NodeId::UNIT_A, &Ack { id: command(2), intent, refused: None, mode: Mode::HoldSafe, due: None });
    assert!(supervised(&mut bench), "the HOLD of now is executed");
    bench.pass(Span::s(2));
    assert!(!supervised(&mut bench), "that for later is due");
}

#[test]
fn report_goes_verbatim_to_listening_teammates_only() {
    let mut bench = Bench::new(Policy::default());
    let a = bench.reporting(1, NodeId::UNIT_A);
    let b = bench.open(2, NodeId::UNIT_B);
    let c = bench.reporting(3, NodeId::UNIT_C);
    let now = bench.now;
    let report = bench.units.get_mut(&a).unwrap().signed(now);
    assert_eq!(bench.carry(a, &report), None);
    assert!(bench.units[&b].teammates.is_empty(), "B has not said what it wants to see");
    bench.hello(b);
    let now = bench.now;
    let report = bench.units.get_mut(&a).unwrap().signed(now);
    bench.pass(Span::ms(40));
    assert_eq!(bench.carry(a, &report), None);
    let (peer, age, bytes) = bench.units[&b].teammates.last().unwrap();
    assert_eq!((*peer, bytes), (PeerId::UNIT_A, &report));
    assert!(*age >= Span::ms(40) && *age < Span::ms(45), "{age}");
    assert_eq!(bench.units[&a].teammates.len(), 1, "A has C's, not its own");
    assert!(bench.units[&c].teammates.is_empty(), "C is not in the fan-out");
}

#[test]
fn quiet_gateway_sends_nothing_but_keeps_accounting() {
    let mut bench = Bench::new(Policy::default());
    let a = bench.reporting(1, NodeId::UNIT_A);
    bench.give(&Input::Quiesce);
    let (feeds, grants_before) = (bench.feeds, bench.units[&a].grants);
    assert_eq!(bench.report(a), None);
    bench.pass(Span::s(1));
    assert_eq!((bench.feeds, bench.units[&a].grants), (feeds, grants_before));
    bench.assert_conserved();
}

#[test]
fn refusal_flood_is_counted_whole_fed_partly() {
    let mut bench = Bench::new(Policy::default());
    let a = bench.reporting(1, NodeId::UNIT_A);
    let before = bench.feeds;
    for _ in 0..500 {
        assert_eq!(bench.deliver(a, vec![0xff; 30]), Some(Reason::Schema));
    }
    assert!(bench.feeds - before <= 20);
    bench.assert_conserved();
}

/// A challenge reaches a unit that opens later with its first record.
#[test]
fn display_challenge_reaches_each_unit_at_once() {
    let mut bench = Bench::new(Policy::default());
    let a = bench.reporting(1, NodeId::UNIT_A);
    assert_eq!(bench.request(&Request::Watch(Nonce(7))), None);
    assert_eq!(bench.units[&a].watches, [Nonce(7)]);
    bench.pass(Span::s(1));
    assert_eq!(bench.units[&a].watches, [Nonce(7)], "once");
    let b = bench.reporting(2, NodeId::UNIT_B);
    bench.pass(Span::ms(200));
    assert_eq!(bench.units[&b].watches, [Nonce(7)]);
}
