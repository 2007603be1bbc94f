//! The operator's script: requests, their times and repetitions.

use std::collections::BTreeSet;

use console::ConsoleConfig;
use console::life::Life;
use console::operator::{Action, ScriptStep, TrackCondition, When};
use proptest::prelude::*;
use sha2::{Digest, Sha256};
use wire::command::{Ack, CommandKind, TimeTag};
use wire::core::{Core, Input};
use wire::event::Event;
use wire::feed::CommandStage;
use wire::id::{Boot, CommandId, NodeId, Nonce, Sequence, TrackId, UnitId};
use wire::mode::Mode;
use wire::person::{Act, Order};
use wire::policy::Policy;
use wire::refusal::Reason;
use wire::report::Report;
use wire::sensor::Class;
use wire::time::Span;

use crate::bench::{Asked, Bench, sign, step};

#[test]
fn enabling_is_staged_released_and_acknowledged_once() {
    let mut bench = Bench::new(Policy::default(), vec![step(200, Action::Enable, Mode::Idle)]);
    bench.reports(Mode::Idle, Span::ms(400));
    let [(intent, bytes)] = &bench.intents()[..] else { panic!("one intent expected: {:?}", bench.asked) };
    let (intent, bytes) = (*intent, bytes.clone());
    let hash: [u8; 32] = Sha256::digest(&bytes).into();
    assert_eq!((intent.kind, intent.reason.as_str()), (CommandKind::Enable, "as planned"));
    assert!((500..510).contains(&intent.nonce.0), "a displayed nonce");
    bench.staged(&bytes, CommandStage::Staged);
    bench.staged(&bytes, CommandStage::Staged);
    let releases = bench.asked.iter().filter(|a| matches!(a, Asked::Release(c) if c.intent == hash)).count();
    assert_eq!((releases, bench.asked.len()), (1, 2));
    bench.staged(&bytes, CommandStage::Sent);
    let ack = Ack { id: intent.id, intent: hash, refused: None, mode: Mode::Ready, due: None };
    bench.acknowledged(NodeId::UNIT_B, &ack);
    bench.acknowledged(NodeId::UNIT_A, &Ack { intent: [0; 32], ..ack });
    assert_eq!(bench.refusals(), [Reason::Signature, Reason::Confirmation]);
    bench.acknowledged(NodeId::UNIT_A, &ack);
    bench.acknowledged(NodeId::UNIT_A, &Ack { refused: Some(Reason::Duplicate), ..ack });
    let displayed = bench.events.iter().filter(|(_, e)| matches!(e, Event::Acknowledged { .. })).count();
    assert_eq!(displayed, 1);
    assert_eq!(bench.console.shown(bench.now).commands[0].life, Life::Executed);
    let refused_by = |bench: &Bench, giver: &str, words: &str| {
        let picture = bench.pictures.last().expect("a picture");
        let command = picture["commands"].as_array().and_then(|all| all.last()).expect("a command");
        assert_eq!(command["by"], giver, "{command}");
        let text = bench.texts.last().expect("a text");
        assert!(text.contains(words), "{text}");
    };
    bench.reports(Mode::Idle, Span::ms(100));
    refused_by(&bench, "script", "enable to unit-a by the script");
    bench.act(Act::Now(Order::Command(UnitId::A, CommandKind::Hold))).unwrap();
    bench.reports(Mode::Idle, Span::ms(100));
    refused_by(&bench, "person", "hold to unit-a by a person");
    let requested = bench.asked.len();
    bench.reports(Mode::Idle, Span::s(5));
    assert_eq!(bench.asked.len(), requested, "nothing is sent twice");
}

#[test]
fn operator_acts_on_fresh_values_only() {
    let mut arm = step(500, Action::Arm(Class::Vehicle), Mode::Ready);
    arm.when.track = Some(TrackCondition { class: Class::Vehicle, confidence: 800 });
    let mut bench = Bench::new(Policy::default(), vec![arm]);
    bench.reports(Mode::Ready, Span::ms(100));
    bench.pass(Span::ms(900));
    assert_eq!(bench.asked, [], "the picture is stale");
    bench.reports(Mode::Ready, Span::ms(100));
    assert_eq!(bench.intents()[0].0.kind, CommandKind::Arm(TrackId(4)));
}

#[test]
fn step_with_unmet_conditions_is_given_up() {
    let mut bench = Bench::new(Policy::default(), vec![step(0, Action::Resume, Mode::HoldSafe)]);
    bench.reports(Mode::Ready, Span::ms(2200));
    bench.reports(Mode::HoldSafe, Span::s(1));
    assert_eq!(bench.asked, []);
}

#[test]
fn a_hold_is_never_kept_back() {
    let hold = ScriptStep { when: When::default(), ..step(1000, Action::Hold, Mode::Ready) };
    let mut bench = Bench::new(Policy::default(), vec![hold]);
    bench.pass(Span::ms(1001));
    let (intent, _) = bench.intents()[0].clone();
    assert_eq!((intent.kind, intent.nonce), (CommandKind::Hold, Nonce(0)));
}

/// The first command is shown as unanswered.
#[test]
fn unanswered_command_is_retried_under_a_new_id() {
    let mut bench = Bench::new(Policy::default(), vec![step(0, Action::Hold, Mode::Ready)]);
    bench.reports(Mode::Ready, Span::ms(1100));
    assert_eq!(bench.console.shown(bench.now).commands[0].life, Life::NotAcknowledged);
    bench.reports(Mode::Ready, Span::s(6));
    let ids: Vec<u64> = bench.intents().iter().map(|(intent, _)| intent.id.sequence.0).collect();
    assert_eq!(ids, [1, 2]);
    assert!(bench.console.shown(bench.now).commands.iter().all(|command| command.life == Life::NotAcknowledged));
}

#[test]
fn step_without_time_follows_the_previous_one() {
    let enable = step(0, Action::Enable, Mode::Idle);
    let hold = ScriptStep { at_ms: None, ..step(0, Action::Hold, Mode::Idle) };
    let mut bench = Bench::new(Policy::default(), vec![enable, hold]);
    bench.reports(Mode::Idle, Span::ms(300));
    assert_eq!(bench.intents().len(), 1);
    let (intent, bytes) = bench.intents()[0].clone();
    bench.staged(&bytes, CommandStage::Staged);
    let ack = Ack { id: intent.id, intent: Sha256::digest(&bytes).into(), refused: None, mode: Mode::Ready, due: None };
    bench.acknowledged(NodeId::UNIT_A, &ack);
    bench.reports(Mode::Idle, Span::ms(200));
    assert_eq!(bench.intents()[1].0.kind, CommandKind::Hold);
}

/// A stored command waits for hours without an alarm, and its execution is reported once more.
#[test]
fn stored_command_shows_its_time_until_executed() {
    let tag = Some(TimeTag { after: Span::s(20), within: Span::s(1) });
    let script = vec![ScriptStep { tag, ..step(500, Action::Hold, Mode::Ready) }];
    let mut bench = Bench::new(Policy::default(), script);
    bench.reports(Mode::Ready, Span::s(1));
    let (intent, bytes) = bench.intents()[0].clone();
    assert_eq!(intent.tag, tag);
    let hash = Sha256::digest(&bytes).into();
    let stored = Ack { id: intent.id, intent: hash, refused: None, mode: Mode::Ready, due: Some(Span::ms(19_500)) };
    bench.acknowledged(NodeId::UNIT_A, &stored);
    let due = bench.now + Span::ms(19_500);
    let life = |bench: &Bench| bench.console.shown(bench.now).commands[0].life;
    bench.reports(Mode::Ready, Span::s(5));
    assert_eq!((life(&bench), bench.intents().len()), (Life::Stored(due), 1));
    assert!(bench.console.shown(bench.now).alarms.is_empty());
    bench.acknowledged(NodeId::UNIT_A, &Ack { mode: Mode::HoldSafe, due: None, ..stored });
    assert_eq!(life(&bench), Life::Executed);
    bench.acknowledged(NodeId::UNIT_A, &stored);
    assert_eq!(life(&bench), Life::Executed, "and it does not go back");
}

#[test]
fn stored_command_refused_later_is_not_repeated() {
    let tag = Some(TimeTag { after: Span::s(2), within: Span::s(1) });
    let script = vec![ScriptStep { tag, ..step(500, Action::Hold, Mode::Ready) }];
    let mut bench = Bench::new(Policy::default(), script);
    bench.reports(Mode::Ready, Span::s(1));
    let (intent, bytes) = bench.intents()[0].clone();
    let hash = Sha256::digest(&bytes).into();
    let stored = Ack { id: intent.id, intent: hash, refused: None, mode: Mode::Ready, due: Some(Span::s(1)) };
    bench.acknowledged(NodeId::UNIT_A, &stored);
    bench.reports(Mode::Ready, Span::s(1));
    bench.acknowledged(NodeId::UNIT_A, &Ack { refused: Some(Reason::Interlock), due: None, ..stored });
    bench.reports(Mode::Ready, Span::s(3));
    assert_eq!(bench.intents().len(), 1);
}

#[test]
fn a_quiet_operator_asks_for_nothing() {
    let mut bench = Bench::new(Policy::default(), vec![step(500, Action::Hold, Mode::Ready)]);
    bench.give(&Input::Quiesce);
    bench.reports(Mode::Ready, Span::s(2));
    assert_eq!(bench.asked, []);
    bench.give(&Input::Finish);
    assert!(matches!(bench.events.last(), Some((_, Event::Signed { .. }))));
}

#[test]
fn configuration_survives_json_and_refuses_unknown_keys() {
    let json = r#"{"units": ["unit-a"], "awaited": ["unit-a"], "operator": "operator-1", "operator_secret": SECRET, "text": false,
        "script": [{"unit": "unit-a", "when": {"mode": "READY"}, "do": {"arm": "vehicle"}, "within_ms": 9}]}"#;
    let json = json.replace("SECRET", &format!("{:?}", [1u8; 32]));
    let config: ConsoleConfig = serde_json::from_str(&json).unwrap();
    assert_eq!(config.script[0].action, Action::Arm(Class::Vehicle));
    assert!(serde_json::from_str::<ConsoleConfig>(&json.replace("within_ms", "within")).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever the gateway and the unit answer, in whatever order: no id is asked for or confirmed twice, and no step
    /// is tried more than twice.
    #[test]
    fn nothing_is_sent_twice(answers in prop::collection::vec((0usize..4, 0u8..7, 0u64..700), 1..40)) {
        let script = vec![step(0, Action::Enable, Mode::Idle), step(300, Action::Hold, Mode::Idle)];
        let mut bench = Bench::new(Policy::default(), script);
        for (which, answer, gap) in answers {
            let report = bench.next(Mode::Idle);
            bench.heard(&report, Span::ms(10));
            let intents = bench.intents();
            if let Some((intent, bytes)) = intents.get(which) {
                let hash = Sha256::digest(bytes).into();
                let refused = [None, Some(Reason::Interlock), Some(Reason::Duplicate)];
                match answer {
                    0 => bench.staged(bytes, CommandStage::Staged),
                    1 => bench.staged(bytes, CommandStage::Sent),
                    2 => bench.staged(bytes, CommandStage::Refused),
                    3 => bench.staged(bytes, CommandStage::Expired),
                    n => {
                        let refused = refused[usize::from(n) - 4];
                        bench.acknowledged(NodeId::UNIT_A, &Ack { id: intent.id, intent: hash, refused, mode: Mode::Idle, due: None });
                    }
                }
            }
            bench.pass(Span::ms(gap));
        }
        let (mut staged, mut released) = (BTreeSet::new(), BTreeSet::new());
        for asked in &bench.asked {
            match asked {
                Asked::Stage(intent, _) => prop_assert!(staged.insert(intent.id), "{} staged twice", intent.id),
                Asked::Release(c) => prop_assert!(released.insert(c.id), "{} released twice", c.id),
                Asked::Watch(_) => {}
                Asked::Revoke(_) => prop_assert!(false, "the script revokes nobody"),
            }
        }
        prop_assert!(staged.len() <= 4);
        prop_assert!(bench.console.deadline().is_some());
    }
}

/// No sequence of gateway statements about a command, repeated at will, keeps the alarm away.
#[test]
fn gateway_cannot_hide_a_missing_acknowledgement() {
    for words in [
        vec![CommandStage::Staged],
        vec![CommandStage::Sent],
        vec![CommandStage::Staged, CommandStage::Sent, CommandStage::Staged],
        vec![CommandStage::Sent, CommandStage::Staged, CommandStage::Sent, CommandStage::Staged],
    ] {
        let hold = ScriptStep { when: When::default(), ..step(0, Action::Hold, Mode::Ready) };
        let mut bench = Bench::new(Policy::default(), vec![hold]);
        bench.pass(Span::ms(1));
        let (_, bytes) = bench.intents()[0].clone();
        for word in words {
            bench.pass(Span::ms(200));
            bench.staged(&bytes, word);
        }
        bench.pass(Span::ms(1001));
        let life = bench.console.shown(bench.now).commands[0].life;
        assert_eq!(life, Life::NotAcknowledged);
        bench.staged(&bytes, CommandStage::Sent);
        let life = bench.console.shown(bench.now).commands[0].life;
        assert_eq!(life, Life::NotAcknowledged, "the gateway undoes no alarm");
    }
}

/// One counter for all units would let any of them end the operator's commands to the others.
#[test]
fn claimed_command_id_affects_that_unit_only() {
    let hold = |at_ms| ScriptStep { when: When::default(), ..step(at_ms, Action::Hold, Mode::Ready) };
    let script = vec![hold(500), ScriptStep { unit: UnitId::B, ..hold(600) }, hold(700)];
    let mut bench = Bench::new(Policy::default(), script);
    let claimed = CommandId { operator: NodeId::OPERATOR, boot: Boot(9), sequence: Sequence(u64::MAX - 1) };
    let report = Report { origin: NodeId::UNIT_B, last_command: Some((claimed, None)), ..bench.next(Mode::Ready) };
    bench.heard_as(&sign(NodeId::UNIT_B, &report), UnitId::B, Some(Span::ms(20)), bench.now);
    bench.pass(Span::ms(800));
    let ids: Vec<_> = bench.intents().iter().map(|(intent, _)| (intent.unit, intent.id.sequence.0)).collect();
    assert_eq!(ids, [(UnitId::A, 1), (UnitId::B, u64::MAX), (UnitId::A, 2)]);
}

/// Another intent under the id of the command.
#[test]
fn message_about_another_intent_changes_no_command() {
    let hold = ScriptStep { when: When::default(), ..step(0, Action::Hold, Mode::Ready) };
    let mut bench = Bench::new(Policy::default(), vec![hold]);
    bench.pass(Span::ms(1));
    let (intent, _) = bench.intents()[0].clone();
    bench.staged(b"another intent", CommandStage::Refused);
    bench.acknowledged(
        NodeId::UNIT_A,
        &Ack { id: intent.id, intent: [3; 32], refused: None, mode: Mode::HoldSafe, due: None },
    );
    assert_eq!(bench.console.shown(bench.now).commands[0].life, Life::Requested);
}

#[test]
fn what_the_gateway_refused_says_why_in_words() {
    let hold = ScriptStep { when: When::default(), ..step(0, Action::Hold, Mode::Ready) };
    let mut bench = Bench::new(Policy::default(), vec![hold]);
    bench.pass(Span::ms(1));
    let (_, bytes) = bench.intents()[0].clone();
    bench.staged(&bytes, CommandStage::Refused);
    let shown = bench.console.shown(bench.now);
    assert_eq!(shown.commands[0].life, Life::RefusedByGateway(Some(Reason::Late)));
    let text = console::text::lines(&shown);
    assert!(text.contains("REFUSED by the gateway: late"), "{text}");
}

#[test]
fn revocation_waits_and_is_requested_until_the_end() {
    let revoke = step(100, Action::Revoke(NodeId::OPERATOR_2), Mode::Ready);
    let mut bench = Bench::revoking(vec![revoke], vec![(NodeId::OPERATOR_2, b"signed".to_vec())]);
    let requested = |bench: &Bench| bench.asked.iter().filter(|a| matches!(a, Asked::Revoke(_))).count();
    bench.reports(Mode::Idle, Span::ms(500));
    assert_eq!(requested(&bench), 0, "the mode is not the one");
    bench.reports(Mode::Ready, Span::ms(100));
    assert_eq!(requested(&bench), 1);
    bench.reports(Mode::Ready, Span::s(3));
    assert_eq!(requested(&bench), 4, "again with each challenge: a gateway that starts anew knows of none");
}
