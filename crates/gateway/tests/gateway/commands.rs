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
use wire::trust::Revocation;

use crate::bench::{Bench, INTENTS, SECOND, command, intent, key_of, signed_confirmation, signed_intent};

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
fn hold_leaves_at_once_as_signed() {
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
fn away_from_safe_waits_for_second_signature() {
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

/// The display is informed again and again.
#[test]
fn session_loss_voids_staged_intents_display_is_told() {
    let mut bench = Bench::new(Policy::default());
    let enable = signed_intent(&intent(1, CommandKind::Enable, "start"));
    bench.stage(&enable);
    bench.give(&Input::SessionLost);
    assert_eq!(stages(&bench, command(1)), [CommandStage::Staged, CommandStage::Refused]);
    let confirmation = signed_confirmation(command(1), hash(&enable));
    assert_eq!(bench.request(&Request::Release(confirmation.as_slice().into())), Some(Reason::Confirmation));
    assert!(bench.published.is_empty());
    assert_eq!(bench.progress[1..], [(CommandStage::Refused, None)], "for no reason of its own");
    assert_eq!(bench.losses, [1]);
    assert_eq!(bench.request(&Request::Watch(wire::id::Nonce(9))), None);
    assert_eq!(bench.losses, [1, 1], "a message of the feed may be lost");
}

#[test]
fn every_intent_refusal_can_be_provoked() {
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
fn intent_is_taken_once_stage_holds_eight() {
    let mut bench = Bench::new(Policy::default());
    let enable = |n| signed_intent(&intent(n, CommandKind::Enable, "start"));
    assert_eq!(bench.stage(&enable(1)), None);
    assert_eq!(bench.stage(&enable(1)), Some(Reason::Duplicate));
    for n in 2..=8 {
        bench.pass(Span::ms(300));
        assert_eq!(bench.stage(&enable(n)), None);
    }
    bench.pass(Span::ms(300));
    assert_eq!(bench.stage(&enable(9)), Some(Reason::Full));
    assert_eq!(bench.stage(&signed_intent(&intent(9, CommandKind::Hold, ""))), None, "there is always room for a hold");
}

#[test]
fn foreign_or_stale_request_is_refused_on_bus() {
    let mut bench = Bench::new(Policy::default());
    let hold = signed_intent(&intent(1, CommandKind::Hold, ""));
    let body = codec::encode(&Request::Stage(hold.as_slice().into()));
    let mut insider = Sender::new(Topic::Intents, NodeId::GATEWAY, Boot(1), INTENTS);
    let bytes = insider.seal(bench.now, &body);
    bench.give(&Input::Bus { topic: Topic::Intents, bytes });
    let late = bench.console.seal(bench.now, &body);
    bench.pass(Span::s(1));
    bench.give(&Input::Bus { topic: Topic::Intents, bytes: late });
    let interface = Interface::Bus(Topic::Intents);
    assert_eq!(bench.count(Account::Refused(interface, Reason::Tag)), 1);
    assert_eq!(bench.count(Account::Refused(interface, Reason::Stale)), 1);
    assert!(bench.published.is_empty());
}

fn second_station() -> Sender {
    Sender::new(Topic::Intents, NodeId::INSIDER_OPERATOR, Boot(1), SECOND)
}

/// An intent of the second operator.
fn of_second(sequence: u64, kind: CommandKind) -> Vec<u8> {
    let mut intent = intent(sequence, kind, "for a reason");
    intent.id.operator = NodeId::OPERATOR_2;
    key_of(NodeId::OPERATOR_2).sign(Purpose::Intent, &codec::encode(&intent))
}

/// A flooding station takes neither rate nor room from another, and no place in the rate class for HOLD.
#[test]
fn flooding_station_takes_no_rate_or_room() {
    let (mut bench, mut second) = (Bench::new(Policy::default()), second_station());
    for n in 1..=100 {
        let enable = of_second(n, CommandKind::Enable);
        let refused = bench.second(&mut second, &Request::Stage(enable.as_slice().into()));
        assert_eq!(
            refused,
            match n {
                1..=8 => None,
                9..=16 => Some(Reason::Rate),
                _ => None, // Counted, and not told one by one.
            }
        );
    }
    assert_eq!(bench.count(Account::Refused(Interface::Requests, Reason::Rate)), 92);
    assert_eq!(bench.stage(&signed_intent(&intent(1, CommandKind::Enable, "start"))), None, "rate and room of its own");
    let hold = of_second(101, CommandKind::Hold);
    assert_eq!(bench.second(&mut second, &Request::Stage(hold.as_slice().into())), None, "a class of its own");
    assert_eq!(stages(&bench, CommandId { operator: NodeId::OPERATOR_2, ..command(101) }), [CommandStage::Sent]);
}

#[test]
fn stations_channel_serves_that_station_only() {
    let mut bench = Bench::new(Policy::default());
    let hold = signed_intent(&intent(1, CommandKind::Hold, ""));
    let mut impostor = Sender::new(Topic::Intents, NodeId::CONSOLE, Boot(1), SECOND);
    assert_eq!(bench.second(&mut impostor, &Request::Stage(hold.as_slice().into())), Some(Reason::Tag));
    assert!(bench.published.is_empty());
}

/// Waiting intents are void, later ones refused.
#[test]
fn revocation_voids_refuses_and_reaches_every_unit() {
    let (mut bench, mut second) = (Bench::new(Policy::default()), second_station());
    let session = bench.reporting(1, NodeId::UNIT_A);
    let enable = of_second(1, CommandKind::Enable);
    assert_eq!(bench.second(&mut second, &Request::Stage(enable.as_slice().into())), None);
    let forged = Revocation { of: NodeId::OPERATOR }.sign(&key_of(NodeId::OPERATOR_2));
    assert_eq!(bench.second(&mut second, &Request::Revoke(forged.as_slice().into())), Some(Reason::Signature));
    let signed = Revocation { of: NodeId::OPERATOR_2 }.sign(&key_of(NodeId::AUTHORITY));
    assert_eq!(bench.request(&Request::Revoke(signed.as_slice().into())), None);
    let id = CommandId { operator: NodeId::OPERATOR_2, ..command(1) };
    assert_eq!(stages(&bench, id), [CommandStage::Staged, CommandStage::Refused]);
    let expected = [(CommandStage::Staged, None), (CommandStage::Refused, Some(Reason::Revoked))];
    assert_eq!(bench.progress, expected, "and why");
    let hold = of_second(2, CommandKind::Hold);
    assert_eq!(bench.second(&mut second, &Request::Stage(hold.as_slice().into())), Some(Reason::Revoked));
    bench.pass(Span::ms(2500));
    assert_eq!(bench.units[&session].revocations, vec![signed; 3], "at once, and again each challenge period");
    assert!(bench.published.is_empty());
}

#[test]
fn revoked_teammate_is_unheard_on_standing_session() {
    let mut bench = Bench::new(Policy::default());
    let session = bench.reporting(1, NodeId::UNIT_B);
    let signed = Revocation { of: NodeId::UNIT_B }.sign(&key_of(NodeId::AUTHORITY));
    assert_eq!(bench.request(&Request::Revoke(signed.as_slice().into())), None);
    assert_eq!(bench.report(session), Some(Reason::Revoked));
    bench.assert_conserved();
}
