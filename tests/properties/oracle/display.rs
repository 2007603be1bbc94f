//! P5 and P7: displayed values were accepted, are as fresh as labelled, and are true.

use evidence::Planned;
use ground_truth::{Action, Any, Note};
use oracle::Property;
use wire::core::Side;
use wire::event::{Event, ShownAs};
use wire::id::{NodeId, TrackId};
use wire::mode::{Guard, Guards, Mode};
use wire::time::Span;

use super::log::{Log, command};

#[test]
fn p7_record_accepted_after_long_delay() {
    let held = |ms: u64| {
        let mut log = Log::whole();
        let hash = 5000 << 8 | NodeId::GATEWAY.index() as u64;
        let delay = Span::ms(ms);
        let event = Note::Attack { action: Action::Delay, side: Side::Server, length: 100, hash, delay };
        log.add(5000 - ms, NodeId::RELAY_TELEMETRY, event);
        log.planned.push(Planned::Action(Action::Delay).into());
        log.breaks()
    };
    assert_eq!(held(250), []);
    assert_eq!(held(301), [], "what two clocks may differ by is no finding");
    assert_eq!(held(302), [Property::P7]);
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
fn p7_stale_mode_shown_fresh() {
    let mut log = Log::whole();
    log.displayed(5005, Mode::Idle, 5000);
    assert_eq!(log.breaks(), [Property::P7]);
}

#[test]
fn p7_authority_shown_or_hidden_wrongly() {
    let shown = |ms: u64| {
        let mut log = Log::whole();
        for w in log.entries.iter_mut().filter(|w| w.at == ms * 1000) {
            if let Any::Service(Event::Displayed { authority, .. }) = &mut w.entry.event {
                *authority = if authority.is_some() { None } else { Some(TrackId(1)) };
            }
        }
        log.breaks()
    };
    assert_eq!(shown(1505), [Property::P7], "shown");
    assert_eq!(shown(5005), [Property::P7], "hidden");
    assert_eq!(shown(2105), [], "it had none just before");
}

#[test]
fn p7_authority_shown_over_the_wrong_track() {
    let mut log = Log::whole();
    for w in log.entries.iter_mut().filter(|w| w.at == 5_005_000) {
        if let Any::Service(Event::Displayed { authority, .. }) = &mut w.entry.event {
            *authority = Some(TrackId(2));
        }
    }
    assert_eq!(log.breaks(), [Property::P7]);
}

#[test]
fn p7_wrong_place_shown_fresh() {
    let shown = |north_mm: i32, of_ms: u64| {
        let mut log = Log::under_way();
        let pose = log.way(of_ms);
        for w in log.entries.iter_mut().filter(|w| w.at == 5_005_000) {
            if let Any::Service(Event::Displayed { place: Some(place), .. }) = &mut w.entry.event {
                *place = pose;
                place.y_mm += north_mm;
            }
        }
        log.breaks()
    };
    assert_eq!(shown(0, 5005), []);
    assert_eq!(shown(0, 4700), [], "it was there within a telemetry period and Tf");
    assert_eq!(shown(230, 4700), [], "a fix may be so far off");
    assert_eq!(shown(600, 4700), [Property::P7], "beside its way, farther than it can have driven since it last said");
    assert_eq!(shown(0, 4000), [Property::P7], "where it was too long before");
    assert_eq!(shown(0, 6000), [Property::P7], "where it will be");
}

#[test]
fn p7_ready_conditions_shown_fresh_too_long() {
    let (none, thermal) = (Guards::default(), Guards::default().with_guard(Guard::Thermal));
    for (what, (failing, placed, tracks)) in
        [("guards", (thermal, true, 1)), ("place", (none, false, 1)), ("tracks", (none, true, 0))]
    {
        let mut log = Log::whole();
        assert_eq!(log.judged(5000, failing, placed, tracks).breaks(), [Property::P7], "{what}");
        assert_eq!(log.judged(5400, none, true, 1).breaks(), [], "{what}, for a moment");
    }
    let mut more = Log::whole();
    assert_eq!(more.judged(5000, none, true, 2).breaks(), [], "of its tracks the display may say less");
}

#[test]
fn p7_unexecuted_command_shown_executed() {
    let shown = |shown| Event::CommandShown { command: command(9), shown };
    let mut log = Log::whole();
    log.add(7000, NodeId::CONSOLE, shown(ShownAs::Requested)).add(7400, NodeId::CONSOLE, shown(ShownAs::Executed));
    assert_eq!(log.breaks(), [Property::P7]);
    let mut log = Log::whole();
    log.add(7000, NodeId::CONSOLE, shown(ShownAs::Requested)).add(7400, NodeId::CONSOLE, shown(ShownAs::Refused));
    assert_eq!(log.breaks(), []);
}

#[test]
fn p7_command_under_way_beyond_a_second() {
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
