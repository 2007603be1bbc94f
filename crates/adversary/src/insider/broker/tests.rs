//! The hostile broker alone: its deliveries, and the effect of its forgeries.

use ground_truth::{Action, Any};
use wire::codec;
use wire::command::OrderKind;
use wire::command::{Ack, CommandKind, Confirmation, Intent, MAX_ORDER, Order};
use wire::core::{Core, Input, Output, Subject};
use wire::id::{Boot, CommandId, NodeId, Nonce, PeerId, Sequence, SessionId, TrackId, UnitId};
use wire::mode::Mode;
use wire::sign::{Key, Keyring, Purpose, Signed};

use super::InsiderBroker;
use crate::plan::{AckForgery, BrokerAction, Direction, InsiderBrokerConfig, OrderForgery, Timed};
use crate::testing::{at_ms, setup, times, turn};

const COMMAND: Subject = Subject::Command(UnitId::A);
const ACK: Subject = Subject::Ack(UnitId::A);

#[test]
fn without_a_plan_it_is_a_broker() {
    let mut broker = broker(vec![]);
    assert_eq!(say(&mut broker, 10, COMMAND, b"order"), [(COMMAND, b"order".to_vec())]);
    assert_eq!(say(&mut broker, 20, ACK, b"ack"), [(ACK, b"ack".to_vec())]);
    assert_eq!(broker.deadline(), None);
}

#[test]
fn it_keeps_back_the_holds_alone() {
    let drop = action(Direction::Down, BrokerAction::Drop { only: Some(OrderKind::Hold) });
    let mut broker = broker(vec![drop]);
    let (hold, arm) = (order(1, CommandKind::Hold), order(2, CommandKind::Arm(TrackId(3))));
    assert_eq!(say(&mut broker, 10, COMMAND, &hold), []);
    assert_eq!(say(&mut broker, 20, COMMAND, &arm), [(COMMAND, arm)]);
    assert_eq!(say(&mut broker, 1_500, COMMAND, &hold), [(COMMAND, hold)], "the window is over");
}

/// A late publication is late by the plan's delay; an overtaken one comes after the next.
#[test]
fn lateness_and_overtaking_follow_the_plan() {
    let delay = action(Direction::Down, BrokerAction::Delay { ms: 300, only: None });
    let mut late = broker(vec![delay]);
    assert_eq!(say(&mut late, 10, COMMAND, b"one"), []);
    assert_eq!(late.deadline(), Some(at_ms(310)));
    assert_eq!(out(&mut late, 310, &Input::Timeout), [(COMMAND, b"one".to_vec())]);

    let reorder = action(Direction::Down, BrokerAction::Reorder { hold_ms: 500 });
    let mut broker = broker(vec![reorder]);
    let mut events = Vec::new();
    assert_eq!(say(&mut broker, 10, COMMAND, b"one"), []);
    assert_eq!(say(&mut broker, 15, ACK, b"ack"), [(ACK, b"ack".to_vec())], "the other way goes on");
    let input = Input::Published { subject: COMMAND, bytes: b"two".to_vec() };
    let published = publications(turn(&mut broker, at_ms(20), &input, &mut events));
    assert_eq!(published, [(COMMAND, b"two".to_vec()), (COMMAND, b"one".to_vec())]);
    assert_eq!(times(&events, Action::Reorder), 1);
    assert_eq!(say(&mut broker, 30, COMMAND, b"three"), []);
    assert_eq!(out(&mut broker, 530, &Input::Timeout), [(COMMAND, b"three".to_vec())], "nothing came to overtake it");
}

#[test]
fn repeats_come_at_once_later_and_on_connect() {
    let duplicate = action(Direction::Down, BrokerAction::Duplicate { copies: 2 });
    let mut doubled = broker(vec![duplicate]);
    assert_eq!(say(&mut doubled, 10, COMMAND, b"one").len(), 3);

    let replay = action(Direction::Down, BrokerAction::Replay { count: 3, every_ms: 100 });
    let mut repeated = broker(vec![Timed { start_ms: 1_000, duration_ms: 0, ..replay }]);
    for (ms, bytes) in [(10, b"1st"), (20, b"2nd")] {
        say(&mut repeated, ms, COMMAND, bytes);
    }
    for (ms, bytes) in [(1_000, b"2nd"), (1_100, b"1st"), (1_200, b"2nd")] {
        assert_eq!(out(&mut repeated, ms, &Input::Timeout), [(COMMAND, bytes.to_vec())]);
    }

    let mut retained = broker(vec![action(Direction::Both, BrokerAction::Retain)]);
    say(&mut retained, 10, COMMAND, b"order");
    say(&mut retained, 20, ACK, b"ack");
    let opened = |peer| Input::Opened { session: SessionId(1), peer };
    assert_eq!(out(&mut retained, 30, &opened(PeerId::UNIT_A)), [(COMMAND, b"order".to_vec())]);
    assert_eq!(out(&mut retained, 40, &opened(PeerId::GATEWAY)), [(ACK, b"ack".to_vec())]);
    assert_eq!(out(&mut retained, 50, &opened(PeerId::UNIT_B)), []);
}

#[test]
fn no_invented_order_carries_two_operator_signatures() {
    for forgery in [OrderForgery::OwnKey, OrderForgery::Altered, OrderForgery::Spliced] {
        let invent = BrokerAction::Invent { kind: OrderKind::Confirm, forgery, count: 1, every_ms: 0 };
        let mut broker = broker(vec![Timed { start_ms: 500, duration_ms: 0, ..action(Direction::Down, invent) }]);
        say(&mut broker, 10, COMMAND, &order(1, CommandKind::Enable));
        say(&mut broker, 20, COMMAND, &order(2, CommandKind::Arm(TrackId(3))));
        let invented = out(&mut broker, 500, &Input::Timeout);
        let [(COMMAND, bytes)] = &invented[..] else { panic!("{forgery:?}: {invented:?}") };
        let read: Order<'_> = codec::decode(bytes, MAX_ORDER).expect("well formed");
        let signed = Signed::parse(read.intent, MAX_ORDER).expect("well formed");
        let intent: Intent = codec::decode(signed.payload, MAX_ORDER).expect("well formed");
        let by_operator = operators().verify(NodeId::OPERATOR, Purpose::Intent, &signed).is_ok();
        let confirmation = Signed::parse(read.confirmation.expect("two steps"), MAX_ORDER).expect("well formed");
        let about: Confirmation = codec::decode(confirmation.payload, MAX_ORDER).expect("well formed");
        let confirmed =
            about.id == intent.id && operators().verify(NodeId::OPERATOR, Purpose::Confirmation, &confirmation).is_ok();
        assert!(!(by_operator && confirmed), "{forgery:?}");
        assert_eq!(intent.nonce, Nonce(40), "the newest that it saw: it is not late");
    }
}

/// None is the unit's own and about that order.
#[test]
fn no_forged_acknowledgement_verifies_for_that_order() {
    let hold = order(7, CommandKind::Hold);
    for forgery in [AckForgery::OwnKey, AckForgery::Altered, AckForgery::Replayed] {
        let drop = action(Direction::Down, BrokerAction::Drop { only: Some(OrderKind::Hold) });
        let forge = Timed { start_ms: 500, ..action(Direction::Up, BrokerAction::Forge { forgery }) };
        let mut broker = broker(vec![drop, forge]);
        say(&mut broker, 10, COMMAND, &order(1, CommandKind::Enable));
        say(&mut broker, 20, ACK, &ack(1));
        let forged = say(&mut broker, 600, COMMAND, &hold);
        let [(ACK, bytes)] = &forged[..] else { panic!("{forgery:?}: {forged:?}") };
        let signed = Signed::parse(bytes, MAX_ORDER).expect("well formed");
        let read: Ack = codec::decode(signed.payload, MAX_ORDER).expect("well formed");
        let by_unit = units().verify(NodeId::UNIT_A, Purpose::Ack, &signed).is_ok();
        assert!(!(by_unit && read.id == id(7)), "{forgery:?}");
    }
}

fn broker(actions: Vec<Timed<BrokerAction>>) -> InsiderBroker {
    InsiderBroker::new(setup(NodeId::INSIDER_BROKER, 5), InsiderBrokerConfig { actions }, at_ms(0)).unwrap()
}

fn action(direction: Direction, action: BrokerAction) -> Timed<BrokerAction> {
    Timed { step: None, start_ms: 0, duration_ms: 1_000, direction, action }
}

fn say(broker: &mut InsiderBroker, ms: u64, subject: Subject, bytes: &[u8]) -> Vec<(Subject, Vec<u8>)> {
    out(broker, ms, &Input::Published { subject, bytes: bytes.to_vec() })
}

fn out(broker: &mut InsiderBroker, ms: u64, input: &Input) -> Vec<(Subject, Vec<u8>)> {
    let mut events: Vec<Any> = Vec::new();
    publications(turn(broker, at_ms(ms), input, &mut events))
}

fn publications(out: Vec<Output>) -> Vec<(Subject, Vec<u8>)> {
    let publication =
        |output| if let Output::Publish { subject, bytes } = output { Some((subject, bytes)) } else { None };
    out.into_iter().filter_map(publication).collect()
}

fn id(sequence: u64) -> CommandId {
    CommandId { operator: NodeId::OPERATOR, boot: Boot(1), sequence: Sequence(sequence) }
}

fn operator() -> Key {
    Key::from_bytes(&[9; 32])
}

fn operators() -> Keyring {
    let mut ring = Keyring::default();
    assert!(ring.insert(NodeId::OPERATOR, &operator().public()));
    ring
}

fn units() -> Keyring {
    let mut ring = Keyring::default();
    assert!(ring.insert(NodeId::UNIT_A, &Key::from_bytes(&[8; 32]).public()));
    ring
}

fn order(sequence: u64, kind: CommandKind) -> Vec<u8> {
    use sha2::{Digest, Sha256};
    let nonce = Nonce(20 * sequence);
    let intent = Intent {
        id: id(sequence),
        unit: UnitId::A,
        nonce,
        kind,
        reason: codec::Text::new("why"),
        tag: None,
        shown: None,
    };
    let intent = operator().sign(Purpose::Intent, &codec::encode(&intent));
    let confirmation = Confirmation { id: id(sequence), intent: Sha256::digest(&intent).into() };
    let confirmation = operator().sign(Purpose::Confirmation, &codec::encode(&confirmation));
    let confirmation = (!kind.towards_safe()).then(|| confirmation.as_slice().into());
    codec::encode(&Order { intent: intent.as_slice().into(), confirmation })
}

fn ack(sequence: u64) -> Vec<u8> {
    let ack = Ack { id: id(sequence), intent: [1; 32], refused: None, mode: Mode::Ready, due: None };
    Key::from_bytes(&[8; 32]).sign(Purpose::Ack, &codec::encode(&ack))
}
