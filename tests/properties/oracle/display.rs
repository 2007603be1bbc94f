//! P5 and P7: what the display shows was accepted, is as fresh as it says, and is so.

use campaign::oracle::{Planned, Property};
use wire::core::Side;
use wire::event::{Action, Event, ShownAs};
use wire::id::NodeId;
use wire::mode::Mode;
use wire::time::Span;

use super::log::{Log, command};

#[test]
fn p7_a_record_accepted_after_it_was_held_back_too_long() {
    let held = |ms: u64| {
        let mut log = Log::whole();
        let hash = 5000 << 8 | NodeId::GATEWAY.index() as u64;
        let delay = Span::ms(ms);
        let event = Event::Attack { action: Action::Delay, side: Side::Server, length: 100, hash, delay };
        log.add(5000 - ms, NodeId::RELAY_TELEMETRY, event);
        log.planned.push(Planned::Action(Action::Delay).into());
        log.breaks()
    };
    assert_eq!(held(250), []);
    assert_eq!(held(350), [Property::P7]);
}

#[test]
fn p5_a_displayed_record_that_was_never_accepted() {
    let mut log = Log::whole();
    log.displayed(5050, Mode::PrepareToAct, 5001);
    assert_eq!(log.breaks(), [Property::P5]);
}

#[test]
fn p7_a_value_shown_fresh_beyond_its_limit() {
    let mut log = Log::whole();
    log.displayed(5900, Mode::PrepareToAct, 5000);
    assert_eq!(log.breaks(), [Property::P7]);
}

#[test]
fn p7_a_mode_shown_fresh_that_the_unit_has_left() {
    let mut log = Log::whole();
    log.displayed(5005, Mode::Idle, 5000);
    assert_eq!(log.breaks(), [Property::P7]);
}

#[test]
fn a_command_shown_as_executed_that_the_unit_did_not_execute_breaks_p7() {
    let shown = |shown| Event::CommandShown { command: command(9), shown };
    let mut log = Log::whole();
    log.add(7000, NodeId::CONSOLE, shown(ShownAs::Requested)).add(7400, NodeId::CONSOLE, shown(ShownAs::Executed));
    assert_eq!(log.breaks(), [Property::P7]);
    let mut log = Log::whole();
    log.add(7000, NodeId::CONSOLE, shown(ShownAs::Requested)).add(7400, NodeId::CONSOLE, shown(ShownAs::Refused));
    assert_eq!(log.breaks(), []);
}

#[test]
fn a_command_shown_as_under_way_for_more_than_a_second_breaks_p7() {
    let shown = |shown| Event::CommandShown { command: command(9), shown };
    for late in [ShownAs::Requested, ShownAs::Sent] {
        let mut log = Log::whole();
        log.add(6000, NodeId::CONSOLE, shown(ShownAs::Requested)).add(6100, NodeId::CONSOLE, shown(late));
        log.add(7500, NodeId::CONSOLE, shown(ShownAs::NotAcknowledged));
        assert_eq!(log.breaks(), [Property::P7], "{late:?}: the alarm comes too late");
    }
    let mut log = Log::whole();
    log.add(6000, NodeId::CONSOLE, shown(ShownAs::Requested)).add(
        7000,
        NodeId::CONSOLE,
        shown(ShownAs::NotAcknowledged),
    );
    assert_eq!(log.breaks(), []);
    let mut log = Log::whole();
    log.add(6000, NodeId::CONSOLE, shown(ShownAs::Released));
    assert_eq!(log.breaks(), [Property::P7], "no alarm at all");
}
