//! Guests: a bare one is given credit for its own stop alone, is late only while it drives, and a failure hides nothing from before.

use evidence::Evidence;
use evidence::progress::Route;
use evidence::trial::Outcome;
use ground_truth::Note;
use oracle::judge;
use wire::codec::Text;
use wire::event::Event;
use wire::guest::{Declared, Fault, Place};
use wire::id::NodeId;
use wire::time::Span;

use super::{Log, Property};

/// A run of a bare guest that drives on after a fault at 4 s, with this end of its route.
fn bare(goal: Option<Place>) -> Log {
    let mut log = Log::whole();
    log.thermal_fault(4000, 9000);
    log.add(10, NodeId::UNIT_A, Event::GuestEngaged { name: Text::new("t"), bare: true, goal });
    log
}

/// The guest uses places that are `off_mm` north of the true ones.
fn placed(log: &mut Log, from: u64, to: u64, off_mm: i32) -> &mut Log {
    for ms in (from..to).step_by(200) {
        let x_mm = log.way(ms).x_mm;
        log.add(ms, NodeId::UNIT_A, Event::GuestPlaced { x_mm, y_mm: off_mm });
    }
    log
}

fn failed(log: &mut Log, ms: u64, fault: Fault) -> &mut Log {
    log.add(ms, NodeId::UNIT_A, Event::GuestFailed { fault, why: Text::new("t") })
}

#[test]
fn a_stop_of_its_own_is_safe() {
    assert_eq!(bare(None).judge().outcome, Outcome::Undetected);
    assert_eq!(bare(None).plant_stops(6000).plant_rests(7000).judge().outcome, Outcome::HoldSafe);
    assert_eq!(bare(Some(Place(30_000, 0))).plant_stops(6000).plant_rests(7000).judge().outcome, Outcome::HoldSafe);
}

/// Half a second before the end of the run, or a creep to it, is no safe state.
#[test]
fn a_stop_that_does_not_last_is_none() {
    assert_eq!(bare(None).plant_stops(8500).judge().outcome, Outcome::Undetected);
    assert_eq!(bare(None).plant_creeps(6000).judge().outcome, Outcome::Undetected);
}

/// The vehicle stands still for half a second now and then.
#[test]
fn short_stops_clear_no_false_place() {
    let stutters = |stop_ms: u64| {
        let mut log = Log::whole();
        log.thermal_fault(4000, 9000);
        log.remove_between(3000, 9000, |w| matches!(w.entry.event, ground_truth::Any::Instrument(Note::Truth { .. })));
        for ms in (3100..9000).step_by(100) {
            log.truth(ms, if (ms - 3100) % 1700 < stop_ms { 0 } else { 1000 }, 5000);
        }
        log.add(10, NodeId::UNIT_A, Event::GuestEngaged { name: Text::new("t"), bare: true, goal: None });
        placed(&mut log, 4000, 9000, 2000).breaks()
    };
    assert_eq!(stutters(500), [Property::P3]);
    assert_eq!(stutters(1600), []);
}

/// Arrival by the truth, or by the place that it states.
#[test]
fn arrival_at_the_goal_is_no_safe_state() {
    assert_eq!(bare(Some(Place(280, 0))).plant_stops(6000).plant_rests(7000).judge().outcome, Outcome::Undetected);
    let mut misled = bare(Some(Place(280, 30_000)));
    placed(&mut misled, 6800, 7000, 30_000);
    assert_eq!(misled.plant_stops(6000).plant_rests(7000).judge().outcome, Outcome::Undetected);
}

#[test]
fn an_operators_hold_is_no_credit_to_the_guest() {
    assert_ne!(bare(None).held(6000).judge().outcome, Outcome::HoldSafe);
}

/// The vehicle stands until 7 s; the bound counts from then on.
#[test]
fn a_false_place_counts_while_the_guest_drives() {
    let mut driving = bare(None);
    assert_eq!(placed(&mut driving, 4000, 9000, 2000).breaks(), [Property::P3]);
    let mut in_limits = bare(None);
    assert_eq!(placed(&mut in_limits, 4000, 9000, 900).breaks(), []);
    let stood = |until: u64| {
        let mut log = Log::whole();
        log.thermal_fault(4000, 9000);
        log.remove_between(3000, until, |w| matches!(w.entry.event, ground_truth::Any::Instrument(Note::Truth { .. })));
        for ms in (3100..until).step_by(100) {
            log.truth(ms, 0, 5000);
        }
        log.add(10, NodeId::UNIT_A, Event::GuestEngaged { name: Text::new("t"), bare: true, goal: None });
        placed(&mut log, 4000, until + 1800, 2000).breaks()
    };
    assert_eq!(stood(7000), []);
}

#[test]
fn a_failure_does_not_hide_that_the_guest_was_late() {
    let ended = |ms: u64| {
        let mut log = bare(None);
        placed(&mut log, 4000, 9000, 2000);
        failed(&mut log, ms, Fault::Ended).judge().outcome
    };
    assert_eq!([ended(5000), ended(9500)], [Outcome::GuestFailed, Outcome::Late]);
}

#[test]
fn silence_on_a_host_that_overslept_is_no_failure_of_the_guest() {
    let outcome = |fault: Fault, stall_limit: u64| {
        let mut log = bare(None);
        log.add(5000, NodeId::CAMPAIGN, Note::Stalled { by: Span::ms(300) });
        let evidence = failed(&mut log, 5300, fault).evidence(Vec::new());
        judge(&Evidence { stall_limit, ..evidence }).outcome
    };
    assert_eq!(outcome(Fault::Silent, 100_000), Outcome::Invalid);
    assert_eq!(outcome(Fault::Silent, 400_000), Outcome::GuestFailed);
    assert_eq!(outcome(Fault::Malformed, 100_000), Outcome::GuestFailed);
}

/// A statement at 3 s, of a run without an attack.
fn states(declared: Declared, bare: bool, goal: Option<Place>) -> Outcome {
    let mut log = Log::whole();
    log.add(10, NodeId::UNIT_A, Event::GuestEngaged { name: Text::new("t"), bare, goal });
    log.add(3000, NodeId::UNIT_A, Event::GuestStated { declared, state: Text::new("t") }).judge().outcome
}

/// Inside the guards alarms are the platform's; at the goal, and in IDLE, a guest may rest.
#[test]
fn bare_guests_alarm_without_an_attack_is_false() {
    assert_eq!(states(Declared::Safe, true, None), Outcome::FalseTrip);
    assert_eq!(states(Declared::Degraded, true, None), Outcome::Nominal);
    assert_eq!(states(Declared::Safe, false, None), Outcome::Nominal);
    assert_eq!(states(Declared::Safe, true, Some(Place(120, 0))), Outcome::Nominal);
    let mut waits = Log::whole();
    waits.add(10, NodeId::UNIT_A, Event::GuestEngaged { name: Text::new("t"), bare: true, goal: None });
    waits.add(500, NodeId::UNIT_A, Event::GuestStated { declared: Declared::Safe, state: Text::new("t") });
    assert_eq!(waits.judge().outcome, Outcome::Nominal);
    let mut answers = bare(None);
    answers.add(5000, NodeId::UNIT_A, Event::GuestStated { declared: Declared::Safe, state: Text::new("t") });
    assert_ne!(answers.judge().outcome, Outcome::FalseTrip, "after the fault it is an answer");
}

/// The class keeps its name; the report states that the vehicle stood.
#[test]
fn unnoticed_attack_on_a_vehicle_that_stands_is_undetected() {
    let route = Route { points_mm: vec![(20_000, 0)], looped: false, in_degraded: true };
    let verdict = judge(&Evidence { route, ..bare(None).evidence(Vec::new()) });
    let texts = oracle::judged::findings(&verdict);
    assert_eq!((verdict.outcome, texts.len()), (Outcome::Undetected, 1), "{texts:?}");
    assert!(texts[0].starts_with("stuck for 8.9 s"), "{texts:?}");
}
