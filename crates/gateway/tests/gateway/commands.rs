//! The command stage: one step towards safe, two away from it.

use sha2::{Digest, Sha256};
use wire::bus::Sender;
use wire::codec;
use wire::command::{CommandKind, Order, Request};
use wire::core::{Input, Subject, Topic};
use wire::event::{Account, Event, Interface};
use wire::feed::CommandStage;
use wire::id::{Boot, CommandId, NodeId, TrackId, UnitId};
use wire::policy::Policy;
use wire::refusal::Reason;
use wire::sign::Purpose;
use wire::time::Span;

use crate::bench::{Bench, INTENTS, command, intent, key_of, signed_confirmation, signed_intent};

fn stages(bench: &Bench, of: CommandId) -> Vec<CommandStage> {
    let stage = |event: &Event| match event {
        Event::Staged { command, stage } if *command == of => Some(*stage),
        _ => None,
    };
    bench.events.iter().filter_map(stage).collect()
}

fn hash(bytes: &[u8]) -> [u8; 32] {
    Sha256::digest(bytes).into()
}

#[test]
fn a_hold_goes_out_at_once_as_the_operator_signed_it() {
    let mut bench = Bench::new(Policy::default());
    let hold = signed_intent(&intent(1, CommandKind::Hold, ""));
    assert_eq!(bench.stage(&hold), None);
    let (subject, bytes) = bench.published.last().unwrap();
    assert_eq!(*subject, Subject::Command(UnitId::A));
    let order: Order<'_> = codec::decode(bytes, 1024).unwrap();
    assert_eq!((&order.intent[..], order.confirmation), (&hold[..], None));
    assert_eq!(stages(&bench, command(1)), [CommandStage::Sent]);
}

#[test]
fn away_from_safe_nothing_goes_out_without_the_second_signature() {
    let mut bench = Bench::new(Policy::default());
    let enable = signed_intent(&intent(1, CommandKind::Enable, "start"));
    assert_eq!(bench.stage(&enable), None);
    assert!(bench.published.is_empty());
    let release = |bench: &mut Bench, bytes: &[u8]| bench.request(&Request::Release(bytes.into()));
    assert_eq!(release(&mut bench, &signed_confirmation(command(1), [0; 32])), Some(Reason::Confirmation));
    assert_eq!(release(&mut bench, &signed_confirmation(command(2), hash(&enable))), Some(Reason::Confirmation));
    assert_eq!(release(&mut bench, &enable), Some(Reason::Schema), "an intent is no confirmation");
    let forged = key_of(NodeId::UNIT_A).sign(
        Purpose::Confirmation,
        &codec::encode(&wire::command::Confirmation { id: command(1), intent: hash(&enable) }),
    );
    assert_eq!(release(&mut bench, &forged), Some(Reason::Signature));
    assert!(bench.published.is_empty());
    let confirmation = signed_confirmation(command(1), hash(&enable));
    assert_eq!(release(&mut bench, &confirmation), None);
    let order: Order<'_> = codec::decode(&bench.published.last().unwrap().1, 1024).unwrap();
    assert_eq!(order.confirmation.map(|c| c.to_vec()), Some(confirmation.clone()));
    assert_eq!(release(&mut bench, &confirmation), Some(Reason::Confirmation), "once");
    assert_eq!(bench.published.len(), 1);
}

#[test]
fn a_staged_intent_expires_without_its_confirmation() {
    let mut bench = Bench::new(Policy::default());
    let enable = signed_intent(&intent(1, CommandKind::Enable, "start"));
    bench.stage(&enable);
    bench.pass(Span::ms(5100));
    assert_eq!(stages(&bench, command(1)), [CommandStage::Staged, CommandStage::Expired]);
    let confirmation = signed_confirmation(command(1), hash(&enable));
    assert_eq!(bench.request(&Request::Release(confirmation.as_slice().into())), Some(Reason::Confirmation));
    assert!(bench.published.is_empty());
}

#[test]
fn every_reason_to_refuse_an_intent_can_be_provoked() {
    let good = intent(1, CommandKind::Enable, "start");
    let mut other_operator = good;
    other_operator.id.operator = NodeId::UNIT_B;
    let mut other_unit = good;
    other_unit.unit = UnitId::from_name("unit-d").unwrap();
    let no_reason = intent(1, CommandKind::Arm(TrackId(1)), "  ");
    let forged = key_of(NodeId::CONSOLE).sign(Purpose::Intent, &codec::encode(&good));
    let cases = [
        (Reason::Length, vec![0; 1100]),
        (Reason::Schema, vec![0xff; 30]),
        (Reason::Canonical, [signed_intent(&good), vec![0]].concat()),
        (Reason::Role, signed_intent(&other_operator)),
        (Reason::Signature, forged),
        (Reason::Unit, signed_intent(&other_unit)),
        (Reason::NoReason, signed_intent(&no_reason)),
    ];
    for (reason, bytes) in cases {
        let mut bench = Bench::new(Policy::default());
        assert_eq!(bench.stage(&bytes), Some(reason));
        assert_eq!(bench.count(Account::Refused(Interface::Requests, reason)), 1);
        assert!(bench.published.is_empty());
        assert_eq!(bench.stage(&signed_intent(&good)), None, "a refused intent uses up no id");
    }
}

#[test]
fn an_intent_is_taken_once_and_the_stage_has_room_for_eight() {
    let mut bench = Bench::new(Policy::default());
    let enable = |n| signed_intent(&intent(n, CommandKind::Enable, "start"));
    assert_eq!(bench.stage(&enable(1)), None);
    assert_eq!(bench.stage(&enable(1)), Some(Reason::Duplicate));
    for n in 2..=8 {
        assert_eq!(bench.stage(&enable(n)), None);
    }
    assert_eq!(bench.stage(&enable(9)), Some(Reason::Full));
    assert_eq!(bench.stage(&signed_intent(&intent(9, CommandKind::Hold, ""))), None, "there is always room for a hold");
}

#[test]
fn a_request_that_is_not_the_consoles_or_not_fresh_is_refused_on_the_bus() {
    let mut bench = Bench::new(Policy::default());
    let hold = signed_intent(&intent(1, CommandKind::Hold, ""));
    let body = codec::encode(&Request::Stage(hold.as_slice().into()));
    let mut insider = Sender::new(Topic::Intents, NodeId::GATEWAY, Boot(1), INTENTS);
    let bytes = insider.seal(bench.now, &body);
    bench.give(&Input::Bus { topic: Topic::Intents, bytes });
    let late = bench.console.seal(bench.now, &body);
    bench.pass(Span::s(1));
    bench.give(&Input::Bus { topic: Topic::Intents, bytes: late });
    let at = Interface::Bus(Topic::Intents);
    assert_eq!(bench.count(Account::Refused(at, Reason::Tag)), 1);
    assert_eq!(bench.count(Account::Refused(at, Reason::Stale)), 1);
    assert!(bench.published.is_empty());
}
