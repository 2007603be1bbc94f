//! P1, P9 and P11: an act needs authority, authority and recovery an operator, and the act its designated object.

use evidence::trial::Outcome;
use ground_truth::{Any, Note};
use oracle::Property;
use wire::command::CommandKind;
use wire::event::Event;
use wire::id::{NodeId, TrackId};
use wire::mode::{Cause, Guard, Guards, Mode};
use wire::sensor::Class;

use super::log::Log;

#[test]
fn p1_an_act_that_no_operator_confirmed() {
    let mut log = Log::whole();
    log.acted(5000, Guards::default()).plant_act(5000, Class::Vehicle, 100);
    assert_eq!(log.breaks(), [Property::P1]);
    assert_eq!(log.judge().outcome, Outcome::Unsafe);
}

#[test]
fn p1_an_act_with_a_failing_guard() {
    let mut log = Log::whole();
    log.command(5000, 3, CommandKind::Confirm(TrackId(1)));
    log.acted(5000, Guards::default().with_guard(Guard::Thermal)).plant_act(5000, Class::Vehicle, 100);
    assert_eq!(log.breaks(), [Property::P1]);
}

#[test]
fn p1_an_act_under_revoked_authority() {
    let mut log = Log::whole();
    log.add(4000, NodeId::UNIT_A, Event::Revoked { authority: 1, cause: Cause::Expired });
    log.command(5000, 3, CommandKind::Confirm(TrackId(1)));
    log.acted(5000, Guards::default()).plant_act(5000, Class::Vehicle, 100);
    assert_eq!(log.breaks(), [Property::P1]);
}

/// P1: authority that outlives its time. P11: one on another track than was ordered.
#[test]
fn p1_p11_authority_too_long_or_retargeted() {
    let mut log = Log::whole();
    let early = |event: &Any| {
        matches!(event, Any::Service(Event::Transition { to: Mode::PrepareToAct, .. } | Event::Minted { .. }))
    };
    let ordered = |event: &Any| {
        matches!(
            event,
            Any::Service(
                Event::Executed { kind: CommandKind::Arm(_), .. } | Event::Intended { kind: CommandKind::Arm(_), .. }
            )
        )
    };
    for w in log.entries.iter_mut().filter(|w| early(&w.entry.event) || ordered(&w.entry.event)) {
        w.at -= 300_000;
    }
    assert_eq!(log.breaks(), [Property::P1], "8.3 s of it");
    let mut log = Log::whole();
    for w in &mut log.entries {
        if let Any::Service(Event::Minted { track, .. } | Event::Displayed { authority: Some(track), .. }) =
            &mut w.entry.event
        {
            *track = TrackId(2);
        }
    }
    assert_eq!(log.breaks(), [Property::P11]);
}

#[test]
fn p9_degraded_that_ends_before_its_hysteresis() {
    let lasts = |ms: u64| {
        let mut log = Log::whole();
        log.cut_display(5000).transition(5000, Mode::PrepareToAct, Mode::Degraded, Cause::Lost(Guard::Thermal));
        log.transition(5000 + ms, Mode::Degraded, Mode::Ready, Cause::Recovered);
        log.breaks()
    };
    assert_eq!(lasts(1000), []);
    assert_eq!(lasts(400), [Property::P9]);
}

/// Authority that is entered without an operator breaks it, too.
#[test]
fn p9_hold_safe_left_without_operator() {
    let mut log = Log::whole();
    log.cut_display(3000).transition(3000, Mode::PrepareToAct, Mode::HoldSafe, Cause::Operator);
    log.entries.retain(|w| !(w.at > 3_000_000 && matches!(w.entry.event, Any::Instrument(Note::Truth { .. }))));
    log.transition(4000, Mode::HoldSafe, Mode::Ready, Cause::Recovered);
    assert_eq!(log.breaks(), [Property::P9]);
    let mut log = Log::whole();
    log.cut_display(3000).transition(3000, Mode::PrepareToAct, Mode::Ready, Cause::Expired);
    log.transition(4000, Mode::Ready, Mode::PrepareToAct, Cause::Recovered);
    assert_eq!(log.breaks(), [Property::P9]);
}

#[test]
fn p9_idle_left_by_enable_or_stop() {
    let left = |to: Mode| {
        let mut log = Log::whole();
        log.entries
            .retain(|w| !matches!(w.entry.event, Any::Service(Event::Transition { .. } | Event::Executed { .. })));
        log.cut_display(0).transition(1000, Mode::Idle, to, Cause::Operator);
        log.breaks().contains(&Property::P9)
    };
    assert_eq!([Mode::Ready, Mode::Degraded, Mode::HoldSafe].map(left), [true, true, false]);
}

#[test]
fn p11_act_on_decoy_or_off_vehicle() {
    for (class, distance) in [(Class::Decoy, 100), (Class::Vehicle, 9000)] {
        let mut log = Log::whole();
        log.cut_display(5000).confirm_and_act(5000, class, distance);
        assert_eq!(log.breaks(), [Property::P11], "{class:?} {distance}");
    }
    let mut log = Log::whole();
    log.cut_display(5000).confirm_and_act(5000, Class::Vehicle, 100);
    assert_eq!(log.breaks(), []);
}
