//! Isolation of requests: one station, one unit or the broker cannot affect another's.

use sha2::{Digest, Sha256};
use wire::bus::Sender;
use wire::command::{Ack, CommandKind, Request};
use wire::core::Topic;
use wire::event::{Account, Interface};
use wire::id::{Boot, NodeId, Nonce};
use wire::mode::Mode;
use wire::policy::Policy;
use wire::refusal::Reason;
use wire::time::Span;
use wire::trust::Revocation;

use crate::bench::{Bench, SECOND, command, intent, key_of, signed_confirmation, signed_intent};

fn second_station() -> Sender {
    Sender::new(Topic::Intents, NodeId::INSIDER_OPERATOR, Boot(1), SECOND)
}

fn executed(signed: &[u8]) -> Ack {
    Ack { id: command(1), intent: Sha256::digest(signed).into(), refused: None, mode: Mode::HoldSafe, due: None }
}

/// A holder of the operator's key can have another order executed under the HOLD's id.
#[test]
fn hold_is_done_by_its_own_execution_only() {
    let (mut bench, mut second) = (Bench::new(Policy::default()), second_station());
    let session = bench.reporting(1, NodeId::UNIT_A);
    let hold = signed_intent(&intent(1, CommandKind::Hold, ""));
    let disarm = signed_intent(&intent(1, CommandKind::Disarm, ""));
    assert_eq!(bench.stage(&hold), None);
    assert_eq!(bench.second(&mut second, &Request::Stage(disarm.as_slice().into())), None);
    let grants = bench.units[&session].grants;
    for (order, granted) in [(&disarm, false), (&hold, true)] {
        bench.acknowledge(NodeId::UNIT_A, &executed(order));
        assert_eq!(bench.report(session), None);
        bench.pass(Span::ms(300));
        assert_eq!(bench.units[&session].grants > grants, granted);
    }
}

#[test]
fn only_the_display_challenges_and_not_too_often() {
    let (mut bench, mut second) = (Bench::new(Policy::default()), second_station());
    let session = bench.reporting(1, NodeId::UNIT_A);
    assert_eq!(bench.request(&Request::Watch(Nonce(5))), None);
    assert_eq!(bench.second(&mut second, &Request::Watch(Nonce(6))), Some(Reason::Role));
    assert_eq!(bench.request(&Request::Watch(Nonce(7))), Some(Reason::Rate));
    bench.pass(Span::s(1));
    assert_eq!(bench.request(&Request::Watch(Nonce(8))), None);
    assert_eq!(bench.units[&session].watches, [Nonce(5), Nonce(8)]);
}

#[test]
fn refused_request_says_nothing_about_claimed_command() {
    let (mut bench, mut second) = (Bench::new(Policy::default()), second_station());
    let hold = signed_intent(&intent(1, CommandKind::Hold, ""));
    assert_eq!(bench.stage(&hold), None);
    let feeds = bench.feeds;
    let garbage = signed_confirmation(command(1), Sha256::digest(&hold).into());
    let requested = [Request::Release(garbage.as_slice().into()), Request::Stage(hold.as_slice().into())];
    assert_eq!(
        requested.map(|request| bench.second(&mut second, &request)),
        [Some(Reason::Confirmation), Some(Reason::Duplicate)]
    );
    assert_eq!(bench.feeds - feeds, 2, "that two requests were refused, and nothing else");
}

#[test]
fn repeated_acknowledgement_is_not_verified_or_passed() {
    let mut bench = Bench::new(Policy::default());
    let hold = signed_intent(&intent(1, CommandKind::Hold, ""));
    assert_eq!(bench.stage(&hold), None);
    let feeds = bench.feeds;
    for _ in 0..50 {
        bench.acknowledge(NodeId::UNIT_A, &executed(&hold));
    }
    assert_eq!(bench.feeds - feeds, 1);
    assert_eq!(bench.count(Account::Accepted(Interface::Acks)), 50);
}

/// A hostile broker can repeat and damage the messages it carries as fast as it likes.
#[test]
fn forged_acknowledgements_are_counted_and_told_boundedly() {
    let mut bench = Bench::new(Policy::default());
    let hold = signed_intent(&intent(1, CommandKind::Hold, ""));
    assert_eq!(bench.stage(&hold), None);
    let feeds = bench.feeds;
    for _ in 0..200 {
        bench.acknowledge(NodeId::UNIT_B, &executed(&hold));
    }
    assert_eq!(bench.count(Account::Refused(Interface::Acks, Reason::Confirmation)), 200);
    assert!(bench.feeds - feeds <= 8, "{} told", bench.feeds - feeds);
    let garbage = signed_intent(&intent(2, CommandKind::Enable, ""));
    assert_eq!(bench.stage(&garbage), Some(Reason::NoReason), "the display's own is told all the same");
}

#[test]
fn revoked_teammate_hears_no_others_either() {
    let mut bench = Bench::new(Policy::default());
    let (a, b) = (bench.reporting(1, NodeId::UNIT_A), bench.reporting(2, NodeId::UNIT_B));
    assert_eq!(bench.report(a), None);
    let heard = bench.units[&b].teammates.len();
    assert!(heard > 0, "as long as it stands");
    let signed = Revocation { of: NodeId::UNIT_B }.sign(&key_of(NodeId::AUTHORITY));
    assert_eq!(bench.request(&Request::Revoke(signed.as_slice().into())), None);
    let grants = bench.units[&b].grants;
    assert_eq!(bench.report(a), None);
    assert_eq!(bench.request(&Request::Watch(Nonce(5))), None);
    bench.pass(Span::s(1));
    let revoked = &bench.units[&b];
    assert_eq!((revoked.teammates.len(), revoked.grants, revoked.watches.len()), (heard, grants, 0));
}

#[test]
fn restarted_unit_hears_revocations_on_first_exchange() {
    let mut bench = Bench::new(Policy::default());
    let signed = Revocation { of: NodeId::OPERATOR_2 }.sign(&key_of(NodeId::AUTHORITY));
    assert_eq!(bench.request(&Request::Revoke(signed.as_slice().into())), None);
    let session = bench.open(1, NodeId::UNIT_A);
    bench.hello(session);
    assert_eq!(bench.units[&session].revocations, [signed]);
}
