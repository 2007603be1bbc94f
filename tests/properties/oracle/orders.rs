//! P5 and P8: a unit's executed order was given, under a key that is that operator's, once and in time.

use evidence::Planned;
use evidence::trial::Outcome;
use ground_truth::Note;
use oracle::Property;
use wire::command::{CommandKind, TimeTag};
use wire::event::Event;
use wire::id::{CommandId, NodeId};
use wire::mode::{Cause, Mode};
use wire::time::Span;

use super::log::{Log, command};

#[test]
fn p5_an_executed_command_that_nobody_gave() {
    let mut log = Log::whole();
    let event = Event::Executed { command: command(9), kind: CommandKind::Disarm, refused: None };
    log.add(5000, NodeId::UNIT_A, event).disarmed(5000);
    assert_eq!(log.breaks(), [Property::P5]);
}

#[test]
fn p8_command_executed_twice_or_late() {
    let mut log = Log::whole();
    let executed = Event::Executed { command: command(1), kind: CommandKind::Enable, refused: None };
    log.add(1500, NodeId::UNIT_A, executed);
    assert_eq!(log.breaks(), [Property::P8]);
    let mut log = Log::whole();
    log.add(3000, NodeId::CONSOLE, Event::Intended { command: command(5), kind: CommandKind::Disarm, tag: None });
    log.add(6000, NodeId::UNIT_A, Event::Executed { command: command(5), kind: CommandKind::Disarm, refused: None });
    assert_eq!(log.breaks(), [Property::P8]);
}

/// An enabling for four seconds after `given_ms`, to be carried out within one more, executed at `executed_ms`.
fn tagged(given_ms: u64, executed_ms: u64) -> Log {
    let (kind, after) = (CommandKind::Enable, Span::s(4));
    let mut log = Log::whole();
    let tag = Some(TimeTag { after, within: Span::s(1) });
    log.add(given_ms, NodeId::CONSOLE, Event::Intended { command: command(5), kind, tag });
    log.add(given_ms + 100, NodeId::UNIT_A, Event::Stored { command: command(5), kind, due: after });
    log.add(executed_ms, NodeId::UNIT_A, Event::Executed { command: command(5), kind, refused: None });
    log
}

#[test]
fn p8_time_tagged_command_early_or_late() {
    for (ms, early_or_late) in [(3400, true), (5000, false), (6900, false), (7200, true)] {
        let expected = if early_or_late { vec![Property::P8] } else { Vec::new() };
        assert_eq!(tagged(2000, ms).breaks(), expected, "{ms} ms");
    }
}

/// The unit of this log is armed at two seconds, so an order stored before is void.
#[test]
fn p8_stored_command_outlives_a_change_of_mode() {
    assert_eq!(tagged(1500, 5500).breaks(), [Property::P8]);
}

/// A command that a rogue gives under `key`, reported by it at `ms`.
fn rogue(log: &mut Log, ms: u64, id: CommandId, kind: CommandKind, key: NodeId) {
    log.planned.push(Planned::Rogue.into());
    log.add(ms, NodeId::INSIDER_OPERATOR, Note::Rogue { command: id, kind, key, certificate: None });
}

/// The log in which the unit executes it 10 ms later.
pub(super) fn obeyed(ms: u64, operator: NodeId, kind: CommandKind, key: NodeId) -> Log {
    let id = CommandId { operator, ..command(9) };
    let mut log = Log::whole();
    rogue(&mut log, ms, id, kind, key);
    log.add(ms + 10, NodeId::UNIT_A, Event::Executed { command: id, kind, refused: None });
    if kind == CommandKind::Disarm {
        log.disarmed(ms + 10);
    }
    log
}

/// Of the rogue's orders only those to stop are no finding.
#[test]
fn rogue_order_needs_a_judge() {
    let mut log = Log::whole();
    rogue(
        &mut log,
        5000,
        CommandId { operator: NodeId::OPERATOR_2, ..command(9) },
        CommandKind::Disarm,
        NodeId::OPERATOR_2,
    );
    assert_eq!(log.judge().outcome, Outcome::Invalid, "its word alone");
    let execute = |kind| obeyed(5000, NodeId::OPERATOR_2, kind, NodeId::OPERATOR_2).judge().outcome;
    assert_eq!(execute(CommandKind::Disarm), Outcome::Undetected);
    assert_eq!(execute(CommandKind::Resume), Outcome::Unsafe);
}

#[test]
fn p5_rogue_stop_without_valid_key() {
    let stop = |ms, operator, key| obeyed(ms, operator, CommandKind::Disarm, key);
    assert_eq!(stop(5000, NodeId::UNIT_B, NodeId::UNIT_B).breaks(), [Property::P5], "nobody's operator");
    assert_eq!(stop(5000, NodeId::OPERATOR, NodeId::UNIT_B).breaks(), [Property::P5], "not that operator's key");
    assert_eq!(stop(5000, NodeId::OPERATOR, NodeId::OPERATOR_2).breaks(), [Property::P5], "another operator's");
    assert_eq!(stop(7500, NodeId::OPERATOR_2, NodeId::OPERATOR_2).breaks(), [Property::P5], "expired");
    for (node, at, broken) in [
        (NodeId::UNIT_A, 4900, &[Property::P5][..]),
        (NodeId::UNIT_A, 5100, &[]),
        (NodeId::GATEWAY, 3900, &[Property::P5]),
        (NodeId::GATEWAY, 4900, &[]),
    ] {
        let mut log = stop(5000, NodeId::OPERATOR_2, NodeId::OPERATOR_2);
        log.add(at, node, Event::Struck { who: NodeId::OPERATOR_2 });
        assert_eq!(log.breaks(), broken, "{node} knows it at {at} ms");
    }
}

#[test]
fn p5_p9_operator_id_over_another_command() {
    let mut log = Log::whole();
    log.add(4990, NodeId::CONSOLE, Event::Intended { command: command(3), kind: CommandKind::Disarm, tag: None });
    log.add(5000, NodeId::UNIT_A, Event::Executed { command: command(3), kind: CommandKind::Hold, refused: None });
    log.cut_display(5000).transition(5000, Mode::PrepareToAct, Mode::HoldSafe, Cause::Operator).plant_stops(5000);
    assert_eq!(log.breaks(), [Property::P5]);
    let resumed = |order, executed_ms: u64| {
        let mut log = Log::whole();
        log.cut_display(3000).transition(3000, Mode::PrepareToAct, Mode::HoldSafe, Cause::Operator).plant_stops(3000);
        let intended_ms = executed_ms.min(4000) - 10;
        log.add(intended_ms, NodeId::CONSOLE, Event::Intended { command: command(3), kind: order, tag: None });
        let executed = Event::Executed { command: command(3), kind: CommandKind::Resume, refused: None };
        log.add(executed_ms, NodeId::UNIT_A, executed).transition(4000, Mode::HoldSafe, Mode::Ready, Cause::Operator);
        log.breaks()
    };
    assert_eq!(resumed(CommandKind::Resume, 4000), []);
    assert_eq!(resumed(CommandKind::Resume, 4050), [], "the log may have it a little after");
    assert_eq!(resumed(CommandKind::Resume, 3899), [Property::P9], "long before");
    assert_eq!(resumed(CommandKind::Resume, 4051), [Property::P9], "that brought nothing about");
    assert_eq!(resumed(CommandKind::Hold, 4000), [Property::P5, Property::P9]);
}
