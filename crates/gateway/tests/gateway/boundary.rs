//! The trust boundary: every refusal provoked, the table of forwarded reports, and conservation.

use gateway::GatewayConfig;
use wire::codec;
use wire::command::Ack;
use wire::core::{Core, Input};
use wire::crop::{Crop, PIXELS, Pixels};
use wire::event::{Account, Event, Interface};
use wire::id::{Boot, FrameId, NodeId, Nonce, PeerId, SessionId, TrackId, UnitId};
use wire::mode::Mode;
use wire::policy::{Check, Policy};
use wire::refusal::Reason;
use wire::sensor::ProductMode;
use wire::session::{SessionBody, SessionMessage, Teammate};
use wire::time::{PeerStamp, Span};

use crate::bench::{Bench, Unit, command, setup, sign, waiving};

#[test]
fn session_needs_our_echo_and_nonce_first() {
    let mut bench = Bench::new(Policy::default());
    let a = bench.open(1, NodeId::UNIT_A);
    let mut deaf = bench.units[&a].session_message_at(PeerStamp(0), SessionBody::Hello(Nonce(7)));
    deaf.echo = None;
    deaf.sequence = wire::id::Sequence(1);
    assert_eq!(bench.deliver(a, codec::encode(&deaf)), Some(Reason::NoEcho));
    assert_eq!(bench.hello(a), None);
    assert_eq!(bench.report(a), None);
    bench.assert_conserved();
}

/// Spoils the next report of a unit that is otherwise in order.
type Spoil = fn(&mut Unit, wire::time::Instant) -> Vec<u8>;

fn spoilt_message(unit: &mut Unit, now: wire::time::Instant, spoil: fn(&mut SessionMessage<'_>)) -> Vec<u8> {
    let report = unit.signed(now);
    unit.sequence += 1;
    let mut outer = unit.session_message_at(unit.clock(now), SessionBody::Report(report.as_slice().into()));
    spoil(&mut outer);
    codec::encode(&outer)
}

/// Each provoked record gets exactly one refusal.
#[test]
fn every_record_refusal_can_be_provoked() {
    let cases: [(Reason, Spoil); 15] = [
        (Reason::Length, |unit, now| vec![0; unit.report(now).len() + 1200]),
        (Reason::Schema, |_, _| vec![0xff; 40]),
        (Reason::Canonical, |unit, now| [unit.report(now), vec![0]].concat()),
        (Reason::Version, |unit, now| spoilt_message(unit, now, |outer| outer.version = 2)),
        (Reason::Stale, |unit, now| {
            spoilt_message(unit, now, |outer| outer.stamp = PeerStamp(outer.stamp.0 - 400_000))
        }),
        (Reason::NoEcho, |unit, now| {
            spoilt_message(unit, now, |outer| outer.stamp = PeerStamp(outer.stamp.0 + 9_000_000))
        }),
        (Reason::Session, |unit, now| spoilt_message(unit, now, |outer| outer.session = Nonce(1))),
        (Reason::Epoch, |unit, now| spoilt_message(unit, now, |outer| outer.boot = Boot(0))),
        (Reason::Jump, |unit, now| spoilt_message(unit, now, |outer| outer.sequence.0 += 601)),
        (Reason::Replayed, |unit, now| spoilt_message(unit, now, |outer| outer.sequence.0 = 1)),
        (Reason::Role, |unit, now| unit.session_message(now, SessionBody::Grant(Span::s(9)))),
        (Reason::Role, |unit, now| {
            let report = unit.signed(now);
            let teammate = Teammate { via: PeerId::UNIT_C, age: Span::ZERO, report: report.as_slice().into() };
            unit.session_message(now, SessionBody::Teammate(teammate))
        }),
        (Reason::Signature, |unit, now| {
            let report = sign(NodeId::UNIT_C, &unit.next_report(now));
            unit.session_message(now, SessionBody::Report(report.as_slice().into()))
        }),
        (Reason::Product, |unit, now| {
            unit.product = ProductMode::Replay;
            unit.report(now)
        }),
        (Reason::Origin, |unit, now| {
            let mut report = unit.next_report(now);
            report.origin = NodeId::UNIT_C;
            let report = sign(NodeId::UNIT_C, &report);
            unit.session_message(now, SessionBody::Report(report.as_slice().into()))
        }),
    ];
    for (reason, spoil) in cases {
        let mut bench = Bench::new(Policy::default());
        let a = bench.reporting(1, NodeId::UNIT_A);
        let before = bench.count(Account::Accepted(Interface::Uplink));
        let now = bench.now;
        let bytes = spoil(bench.units.get_mut(&a).unwrap(), now);
        assert_eq!(bench.deliver(a, bytes), Some(reason));
        assert_eq!(bench.count(Account::Accepted(Interface::Uplink)), before);
        assert_eq!(bench.count(Account::Refused(Interface::Uplink, reason)), 1);
        bench.assert_conserved();
    }
}

#[test]
fn report_repeated_in_new_session_is_replay() {
    let mut bench = Bench::new(Policy::default());
    let a = bench.open(1, NodeId::UNIT_A);
    bench.hello(a);
    let now = bench.now;
    let report = bench.units.get_mut(&a).unwrap().signed(now);
    assert_eq!(bench.carry(a, &report), None);
    assert_eq!(bench.carry(a, &report), Some(Reason::Replayed));
    let repeated = bench.open(2, NodeId::UNIT_A);
    assert_eq!(bench.hello(repeated), None);
    assert_eq!(bench.carry(repeated, &report), Some(Reason::Replayed));
}

#[test]
fn delay_on_either_path_makes_reports_stale() {
    let mut bench = Bench::new(Policy::default());
    let a = bench.reporting(1, NodeId::UNIT_A);
    for (held, verdict) in [(Span::ms(250), None), (Span::ms(350), Some(Reason::Stale))] {
        let now = bench.now;
        let bytes = bench.units.get_mut(&a).unwrap().report(now);
        bench.pass(held);
        assert_eq!(bench.deliver(a, bytes), verdict, "held for {held}");
    }
    bench.pass(Span::s(4));
    let now = bench.now;
    let unit = bench.units.get_mut(&a).unwrap();
    unit.echo = None;
    let bytes = unit.report(now);
    assert_eq!(bench.deliver(a, bytes), Some(Reason::NoEcho), "no echo for longer than the limit");
}

/// Unit B carries statements of unit C, in the three forms.
#[derive(Clone, Copy, Debug)]
enum Form {
    Verbatim,
    Relabelled,
    Resigned,
}

fn forward(bench: &mut Bench, session: SessionId, form: Form) -> Option<Reason> {
    let now = bench.now;
    let c = bench.units.values_mut().find(|unit| unit.node == NodeId::UNIT_C).unwrap();
    let told = c.next_report(now);
    let signed_by_c = sign(NodeId::UNIT_C, &told);
    let b = bench.units.get_mut(&session).unwrap();
    let claimed = wire::report::Report { pose: told.pose, ..b.next_report(now) };
    let report = match form {
        Form::Verbatim => signed_by_c,
        Form::Relabelled => {
            let signature = &signed_by_c[signed_by_c.len() - 64..];
            let mut relabelled = sign(NodeId::UNIT_B, &claimed);
            let index = relabelled.len() - 64;
            relabelled[index..].copy_from_slice(signature);
            relabelled
        }
        Form::Resigned => sign(NodeId::UNIT_B, &claimed),
    };
    bench.carry(session, &report)
}

#[test]
fn forwarded_reports_meet_each_policy_by_table() {
    use Form::{Relabelled, Resigned, Verbatim};
    let session_only = [Check::Origin, Check::Signature];
    let table: [(&str, &[Check], Form, Option<Reason>); 9] = [
        ("session-only", &session_only, Verbatim, None),
        ("session-only", &session_only, Relabelled, None),
        ("session-only", &session_only, Resigned, None),
        ("session-bound", &[Check::Signature], Verbatim, Some(Reason::Origin)),
        ("session-bound", &[Check::Signature], Relabelled, None),
        ("session-bound", &[Check::Signature], Resigned, None),
        ("origin-signed", &[], Verbatim, Some(Reason::Origin)),
        ("origin-signed", &[], Relabelled, Some(Reason::Signature)),
        ("origin-signed", &[], Resigned, None),
    ];
    for (name, waived, form, expected) in table {
        for c_present in [false, true] {
            let mut bench = Bench::new(waiving(waived));
            let b = bench.reporting(1, NodeId::UNIT_B);
            let c = bench.open(2, NodeId::UNIT_C);
            if c_present {
                bench.hello(c);
                assert_eq!(bench.report(c), None);
            }
            assert_eq!(forward(&mut bench, b, form), expected, "{name}, {form:?}, C present: {c_present}");
            bench.assert_conserved();
        }
    }
}

#[test]
fn accepted_record_names_each_waived_check() {
    let mut bench = Bench::new(waiving(&[Check::Origin, Check::Signature]));
    let b = bench.reporting(1, NodeId::UNIT_B);
    bench.open(2, NodeId::UNIT_C);
    assert_eq!(forward(&mut bench, b, Form::Verbatim), None);
    let accepted = bench.events.iter().rev().find_map(|event| match event {
        Event::Accepted { record, peer, waived, .. } => Some((record.node, *peer, waived.iter().collect::<Vec<_>>())),
        _ => None,
    });
    assert_eq!(accepted, Some((NodeId::UNIT_C, PeerId::UNIT_B, vec![Check::Origin, Check::Signature])));
}

/// The gap: another unit's report, held back for long, crosses as fresh where the policy waives its origin.
#[test]
fn waived_origin_lets_held_report_pass_fresh() {
    for (waived, verdict) in [(vec![Check::Origin], None), (vec![], Some(Reason::Origin))] {
        let mut bench = Bench::new(waiving(&waived));
        let b = bench.reporting(1, NodeId::UNIT_B);
        bench.open(2, NodeId::UNIT_C);
        let now = bench.now;
        let old = bench.units.values_mut().find(|u| u.node == NodeId::UNIT_C).unwrap().signed(now);
        for _ in 0..10 {
            bench.pass(Span::s(1));
            bench.hello(b);
        }
        assert_eq!(bench.carry(b, &old), verdict);
    }
}

#[test]
fn keyless_or_vehicleless_origin_is_refused_even_waived() {
    let mut bench = Bench::new(waiving(&[Check::Origin]));
    let b = bench.reporting(1, NodeId::UNIT_B);
    let now = bench.now;
    for (name, reason) in [("unit-d", Reason::Signer), ("console", Reason::Role)] {
        let mut report = bench.units.get_mut(&b).unwrap().next_report(now);
        report.origin = NodeId::from_name(name).unwrap();
        assert_eq!(bench.carry(b, &sign(NodeId::UNIT_B, &report)), Some(reason));
    }
}

/// Neither is heard.
#[test]
fn superseded_and_unknown_peer_sessions_are_ended() {
    let mut bench = Bench::new(Policy::default());
    let old = bench.reporting(1, NodeId::UNIT_A);
    bench.open(2, NodeId::UNIT_A);
    assert_eq!(bench.report(old), Some(Reason::Session));
    let stranger = bench.open(3, NodeId::CONSOLE);
    assert_eq!(bench.deliver(stranger, vec![1, 2, 3]), Some(Reason::Role));
    assert_eq!(bench.deliver(SessionId(99), vec![1, 2, 3]), Some(Reason::Session));
    assert_eq!(bench.ended, [old, stranger]);
    bench.give(&Input::Closed { session: SessionId(2) });
    bench.assert_conserved();
}

#[test]
fn whatever_a_flipped_bit_does_the_account_balances() {
    let mut bench = Bench::new(Policy::default());
    let a = bench.reporting(1, NodeId::UNIT_A);
    let now = bench.now;
    let good = bench.units.get_mut(&a).unwrap().report(now);
    let mut accepted = 0;
    for bit in 0..good.len() * 8 {
        let mut bad = good.clone();
        bad[bit / 8] ^= 1 << (bit % 8);
        accepted += u32::from(bench.deliver(a, bad).is_none());
    }
    // The report is signed and appears once; at most the flips of the session layer's free fields get it through.
    assert!(accepted <= 1, "{accepted} accepted");
    bench.assert_conserved();
}

#[test]
fn a_fork_goes_on_as_the_original_does() {
    let units = vec![UnitId::A];
    let config = GatewayConfig {
        units,
        interests: vec![],
        operators: vec![NodeId::OPERATOR],
        mandates: vec![],
        contacts: vec![],
    };
    let mut now = wire::time::Instant(0);
    let mut one = gateway::Gateway::new(setup(Policy::default()), config, now).unwrap();
    one.handle(now, &Input::Opened { session: SessionId(1), peer: PeerId::UNIT_A });
    let mut other = one.clone();
    for _ in 0..20 {
        now = one.deadline().unwrap();
        assert_eq!(other.deadline(), Some(now));
        one.handle(now, &Input::Timeout);
        other.handle(now, &Input::Timeout);
        while let Some(output) = one.output() {
            assert_eq!(other.output(), Some(output));
        }
    }
}

/// Records at the rate of a peer with a session for two seconds, and one of another kind among them.
#[test]
fn refusal_flood_is_bounded_with_exact_count() {
    let mut bench = Bench::new(Policy::default());
    let session = bench.reporting(1, NodeId::UNIT_A);
    bench.refusals.clear();
    let flood = 100_000;
    for n in 0..flood {
        bench.now += Span(20);
        bench.give(&Input::Record { session, bytes: vec![0xff; 40] });
        if n == flood / 2 {
            bench.acknowledge(
                NodeId::UNIT_B,
                &Ack { id: command(1), intent: [0; 32], refused: None, mode: Mode::Idle, due: None },
            );
        }
    }
    bench.pass(Span::s(2));
    let refusals =
        |reason| bench.refusals.iter().filter(move |refusal| refusal.0 == reason).map(|refusal| refusal.2).max();
    assert_eq!(refusals(Reason::Schema), Some(flood));
    assert_eq!(refusals(Reason::Confirmation), Some(1), "not crowded out: {:?}", bench.refusals);
    assert!(bench.refusals.len() <= 5 * 20, "{} told", bench.refusals.len());
    assert_eq!(bench.gateway.deadline().filter(|time| *time <= bench.now), None, "nothing is left to tell");
}

/// The gateway does not look into it any further: the unit's report says which are its own.
#[test]
fn crops_reach_the_display_as_they_came() {
    let mut bench = Bench::new(Policy::default());
    let a = bench.reporting(1, NodeId::UNIT_A);
    let pixels = Pixels::Depth(900, 1_200, [3; PIXELS].into());
    let crop = codec::encode(&Crop { track: TrackId(1), frame: FrameId(9), scale: 1, pixels });
    let now = bench.now;
    let send = |bench: &mut Bench, bytes: &[u8]| {
        let record = bench.units.get_mut(&a).unwrap().session_message(now, SessionBody::Crop(bytes.into()));
        bench.deliver(a, record)
    };
    assert_eq!(send(&mut bench, &crop), None);
    assert_eq!(send(&mut bench, &crop[1..]), Some(Reason::Schema));
    assert_eq!(send(&mut bench, &[&crop[..], &[0]].concat()), Some(Reason::Canonical));
    assert_eq!(bench.crops, [(UnitId::A, crop)]);
    bench.assert_conserved();
}
