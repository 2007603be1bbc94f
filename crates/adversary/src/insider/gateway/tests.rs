//! The gateway insider alone: its treatment of the feed and of the operator's requests.

use config::setup::Channel;
use ground_truth::{Action, Any, Note};
use wire::bus::{ChannelKey, HEADER_LEN, Sender, TAG_LEN};
use wire::codec::{self, Text};
use wire::command::OrderKind;
use wire::command::{CommandKind, Intent, Request};
use wire::core::{Core, Input, Output, Topic};
use wire::feed::{AcceptedReport, Feed};
use wire::id::{Boot, CommandId, NodeId, Nonce, PeerId, RecordId, Sequence, UnitId};
use wire::mode::Mode;
use wire::policy::{Policy, Waived};
use wire::report::{MAX_REPORT, Report};
use wire::sensor::Pose;
use wire::sign::{Key, Keyring, Purpose, Signed};
use wire::time::{PeerStamp, Span};
use wire::trust::BusGate;

use super::InsiderGateway;
use crate::plan::{Direction, FeedAction, FeedForgery, InsiderGatewayConfig, Timed};
use crate::testing::{at_ms, setup, turn};

const FEED: ChannelKey = ChannelKey([4; 32]);

/// The console hears the gateway's messages as the gateway's own.
#[test]
fn empty_plan_passes_the_feed_unchanged() {
    let mut insider = insider(vec![]);
    let mut gate = BusGate::new(Topic::Feed, NodeId::GATEWAY, FEED, Span::ms(300));
    for (ms, sequence) in [(100, 1), (200, 2)] {
        let out = fed(&mut insider, ms, sequence, Mode::Ready);
        let [Output::Bus { topic: Topic::Feed, bytes }] = &out[..] else { panic!("{out:?}") };
        let accepted = gate.admit::<Feed<'_>>(&Policy::default(), at_ms(ms), bytes).expect("the feed's key");
        let Feed::Accepted(message) = accepted.message() else { panic!("a report") };
        assert_eq!(message.report[..], signed(sequence, Mode::Ready)[..]);
    }
}

/// The insider has no unit's key and can still do all three.
#[test]
fn reports_are_withheld_held_and_made_younger() {
    let keep = FeedAction::Withhold { keep: Some(Mode::Ready) };
    let mut chooser = insider(vec![keep]);
    assert_eq!(fed(&mut chooser, 100, 1, Mode::HoldSafe), []);
    assert_eq!(fed(&mut chooser, 200, 2, Mode::Ready).len(), 1);

    let mut keeper = insider(vec![FeedAction::Delay { ms: 800, young: true }]);
    assert_eq!(fed(&mut keeper, 100, 1, Mode::Ready), []);
    assert_eq!(keeper.deadline(), Some(at_ms(900)));
    let out = turn(&mut keeper, at_ms(900), &Input::Timeout, &mut Vec::new());
    let message = message(&out[0]);
    let feed = codec::decode::<Feed<'_>>(&message, message.len()).unwrap();
    let Feed::Accepted(said) = feed else { panic!("a report") };
    assert_eq!((said.received, said.report[..].to_vec()), (at_ms(900), signed(1, Mode::Ready)));
    assert!(said.age.is_some_and(|age| age < Span::ms(10)), "{:?}", said.age);
}

#[test]
fn no_changed_report_carries_its_units_signature() {
    for forgery in [FeedForgery::Altered, FeedForgery::ReSigned, FeedForgery::Relabelled] {
        let mut insider = insider(vec![FeedAction::Forge { forgery, mode: Mode::HoldSafe }]);
        let out = fed(&mut insider, 100, 1, Mode::Ready);
        let message = message(&out[0]);
        let Ok(Feed::Accepted(said)) = codec::decode::<Feed<'_>>(&message, message.len()) else { panic!("a report") };
        let read = Signed::parse(said.report, MAX_REPORT).unwrap();
        let report: Report = codec::decode(read.payload, MAX_REPORT).unwrap();
        let mut ring = Keyring::default();
        assert!(ring.insert(NodeId::UNIT_A, &key().public()));
        let genuine = ring.verify(NodeId::UNIT_A, Purpose::Report, &read).is_ok();
        assert!(!(genuine && said.unit == UnitId::A), "{forgery:?}");
        assert_eq!(report.mode == Mode::HoldSafe, forgery != FeedForgery::Relabelled);
    }
}

#[test]
fn planned_requests_are_swallowed_others_pass() {
    let mut insider = insider(vec![FeedAction::Swallow { only: Some(OrderKind::Hold) }]);
    let mut events = Vec::new();
    for (kind, passed) in [(CommandKind::Hold, false), (CommandKind::Enable, true)] {
        let id = CommandId { operator: NodeId::OPERATOR, boot: Boot(1), sequence: Sequence(1) };
        let intent =
            Intent { id, unit: UnitId::A, nonce: Nonce(1), kind, reason: Text::new("why"), tag: None, shown: None };
        let intent = Key::from_bytes(&[9; 32]).sign(Purpose::Intent, &codec::encode(&intent));
        let request = codec::encode(&Request::Stage(intent.as_slice().into()));
        let mut console = Sender::new(Topic::Intents, NodeId::CONSOLE, Boot(1), ChannelKey([5; 32]));
        let bytes = console.seal(at_ms(100), &request);
        let out =
            turn(&mut insider, at_ms(100), &Input::Bus { topic: Topic::Intents, bytes: bytes.clone() }, &mut events);
        let expected = passed.then_some(Output::Bus { topic: Topic::Intents, bytes });
        assert_eq!(out, expected.into_iter().collect::<Vec<_>>(), "{kind:?}");
    }
    assert_eq!(events.iter().filter(|event| matches!(event, Any::Instrument(Note::Swallowed { .. }))).count(), 1);
}

#[test]
fn each_action_is_logged_before_it_happens() {
    let mut insider = insider(vec![FeedAction::Replay]);
    let mut events = Vec::new();
    for ms in [100, 200] {
        let bytes = honest(ms, ms / 100, Mode::Ready);
        turn(&mut insider, at_ms(ms), &Input::Bus { topic: Topic::Feed, bytes }, &mut events);
    }
    let replays =
        events.iter().filter(|event| matches!(event, Any::Instrument(Note::Attack { action: Action::Republish, .. })));
    assert_eq!(replays.count(), 0, "nothing was passed on before the window, so there is nothing old to say");
}

fn insider(actions: Vec<FeedAction>) -> InsiderGateway {
    let mut setup = setup(NodeId::INSIDER_GATEWAY, 6);
    setup.channels = vec![Channel { topic: Topic::Feed, producer: NodeId::GATEWAY, key: FEED }];
    let timed = |action| Timed { start_ms: 0, duration_ms: 10_000, direction: Direction::Both, step: None, action };
    let actions = actions.into_iter().map(timed).collect();
    InsiderGateway::new(setup, InsiderGatewayConfig { actions }, at_ms(0)).unwrap()
}

fn fed(insider: &mut InsiderGateway, ms: u64, sequence: u64, mode: Mode) -> Vec<Output> {
    let bytes = honest(ms, sequence, mode);
    turn(insider, at_ms(ms), &Input::Bus { topic: Topic::Feed, bytes }, &mut Vec::new())
}

/// A feed message of the honest half with a report of A.
fn honest(ms: u64, sequence: u64, mode: Mode) -> Vec<u8> {
    let report = signed(sequence, mode);
    let accepted = AcceptedReport {
        via: PeerId::UNIT_A,
        unit: UnitId::A,
        received: at_ms(ms),
        age: Some(Span::ms(20)),
        waived: Waived::default(),
        report: report.as_slice().into(),
    };
    let mut gateway = Sender::new(Topic::Feed, NodeId::GATEWAY, Boot(1), FEED);
    gateway.seal(at_ms(ms), &codec::encode(&Feed::Accepted(accepted)))
}

fn message(output: &Output) -> Vec<u8> {
    let Output::Bus { topic: Topic::Feed, bytes } = output else { panic!("{output:?}") };
    bytes[HEADER_LEN..bytes.len() - TAG_LEN].to_vec()
}

fn key() -> Key {
    Key::from_bytes(&[3; 32])
}

fn signed(sequence: u64, mode: Mode) -> Vec<u8> {
    let report = Report {
        mode,
        pose: Pose { x_mm: 1, y_mm: 2, yaw_mrad: 3 },
        pose_age: Span::ms(10),
        command_nonce: Nonce(1),
        ..Report::bare(
            RecordId { node: NodeId::UNIT_A, boot: Boot(1), sequence: Sequence(sequence) },
            PeerStamp(sequence * 100_000),
        )
    };
    key().sign(Purpose::Report, &codec::encode(&report))
}
