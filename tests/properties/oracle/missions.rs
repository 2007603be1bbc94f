//! The mission that a scenario presumes, on logs in which it did not take place.

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

use evidence::mission::{Due, Script, Stage, Verb};
use evidence::progress::{Route, Standstill};
use evidence::trial::Outcome;
use evidence::{Evidence, Needs, Plan, Planned};
use ground_truth::{Any, FaultKind, Note, Sensor};
use oracle::{Verdict, judge};
use wire::codec::Text;
use wire::command::CommandKind;
use wire::event::Event;
use wire::id::{NodeId, TrackId};
use wire::mode::{Cause, Guard, Mode};
use wire::sensor::Class;

use super::Log;

fn due(verb: Verb, at_ms: u64) -> Due {
    let arms = verb == Verb::Arm;
    let (mode, track) = (arms.then_some(Mode::Ready), arms.then_some(Class::Vehicle));
    Due { after_us: 0, verb, at_us: at_ms * 1000, within_us: 2_000_000, mode, track }
}

fn enable_and_arm() -> Vec<Due> {
    vec![due(Verb::Enable, 900), due(Verb::Arm, 1900)]
}

fn judged(log: &Log, steps: Vec<Due>, mission: Option<Stage>) -> Verdict {
    judge(&Evidence { script: Script { mission, steps }, ..log.evidence(Vec::new()) })
}

/// The whole log in which the arming was never asked for.
fn unarmed() -> Log {
    let mut log = Log::whole();
    log.entries.retain(|w| match w.entry.event {
        Any::Service(Event::Minted { .. }) => false,
        Any::Service(Event::Transition { to, .. }) => to != Mode::PrepareToAct,
        Any::Service(Event::Intended { kind, .. } | Event::Executed { kind, .. }) => {
            !matches!(kind, CommandKind::Arm(_))
        }
        _ => true,
    });
    for w in &mut log.entries {
        if let Any::Service(Event::Displayed { mode, authority, .. }) = &mut w.entry.event {
            (*mode, *authority) = (if *mode == Mode::PrepareToAct { Mode::Ready } else { *mode }, None);
        }
    }
    log
}

/// A loss of the thermal camera at 5 s that the unit answers.
fn lost(mut log: Log, from: Mode, at_ms: u64) -> Log {
    log.thermal_fault(at_ms, 9000).cut_display(at_ms + 300).transition(
        at_ms + 300,
        from,
        Mode::Degraded,
        Cause::Lost(Guard::Thermal),
    );
    log.planned = vec![Plan {
        what: Planned::Fault(Sensor::Thermal, FaultKind::Dropout),
        from: at_ms * 1000,
        until: 9_000_000,
        step: None,
        needs: Needs::default(),
    }];
    log
}

#[test]
fn complete_mission_is_recognised_by_the_plants_path() {
    let mission = judged(&Log::under_way(), enable_and_arm(), None).mission;
    assert_eq!((mission.required, &mission.missing[..]), (Stage::Armed, &[][..]));
    assert_eq!((mission.armed_ms, mission.acted_ms), (Some(2000.0), None));
    assert!((mission.driven_m - 9.8).abs() < 0.01, "{}", mission.driven_m);
    let done: Vec<_> = mission.steps.iter().map(|s| (s.verb, s.done_ms)).collect();
    assert_eq!(done, [(Verb::Enable, Some(1000.0)), (Verb::Arm, Some(2000.0))]);
}

/// Steps that were not shown are named.
#[test]
fn every_step_is_owed_without_an_attack() {
    let verdict = judged(&unarmed(), enable_and_arm(), None);
    assert_eq!(verdict.outcome, Outcome::Invalid);
    let text = "armed by 10000 ms is presumed and did not come; arm, due at 1900 ms: never, no vehicle shown";
    assert_eq!(verdict.mission.missing, [text]);
    assert_eq!(judged(&unarmed(), Vec::new(), None).outcome, Outcome::Nominal);
    assert_eq!(
        judged(&Log::whole(), [enable_and_arm(), vec![due(Verb::Confirm, 5000)]].concat(), None).outcome,
        Outcome::Invalid
    );
}

/// Half a second before; none after it.
#[test]
fn attack_owes_steps_due_before_it() {
    assert_eq!(
        judged(&lost(Log::whole(), Mode::PrepareToAct, 5000), enable_and_arm(), None).outcome,
        Outcome::Degraded
    );
    let late = |arm_ms: u64| vec![due(Verb::Enable, 900), due(Verb::Arm, arm_ms)];
    let class = |steps| judged(&lost(unarmed(), Mode::Ready, 5000), steps, None).outcome;
    assert_eq!((class(late(4500)), class(late(4501))), (Outcome::Invalid, Outcome::Degraded));
    let confirms = [enable_and_arm(), vec![due(Verb::Confirm, 5200)]].concat();
    assert_eq!(judged(&lost(Log::whole(), Mode::PrepareToAct, 5000), confirms, None).outcome, Outcome::Degraded);
}

/// An empty one requires no step.
#[test]
fn stated_mission_is_owed_at_any_time() {
    let log = || lost(unarmed(), Mode::Ready, 1500);
    assert_eq!(judged(&log(), enable_and_arm(), None).outcome, Outcome::Degraded);
    assert_eq!(judged(&log(), enable_and_arm(), Some(Stage::Armed)).outcome, Outcome::Invalid);
    assert_eq!(judged(&unarmed(), enable_and_arm(), Some(Stage::None)).outcome, Outcome::Nominal);
}

/// An order that the attack waited for, and that is no stage of the mission.
#[test]
fn attack_on_a_missing_order_is_inconclusive() {
    let steps = || [enable_and_arm(), vec![due(Verb::Disarm, 3000)]].concat();
    let log = lost(Log::whole(), Mode::PrepareToAct, 5000);
    let verdict = judged(&log, steps(), None);
    assert_eq!(verdict.outcome, Outcome::Invalid);
    assert!(verdict.mission.missing[0].starts_with("disarm, due at 3000 ms before the attack: never"), "{verdict:?}");
    assert_eq!(judged(&Log::whole(), steps(), None).outcome, Outcome::Nominal, "nobody attacked");
}

/// A trip gives the reason why there was none.
#[test]
fn findings_stand_without_a_mission() {
    let mut broken = unarmed();
    broken.truth(5050, 1000, -1);
    assert_eq!(judged(&broken, enable_and_arm(), None).outcome, Outcome::Unsafe);
    let mut tripped = unarmed();
    tripped.cut_display(1500).transition(1500, Mode::Ready, Mode::Degraded, Cause::Lost(Guard::Thermal));
    assert_eq!(judged(&tripped, enable_and_arm(), None).outcome, Outcome::FalseTrip);
}

#[test]
fn unexecuted_order_is_no_mission() {
    let mut log = unarmed();
    log.add(
        1950,
        wire::id::NodeId::CONSOLE,
        Event::Intended { command: super::command(2), kind: CommandKind::Arm(TrackId(1)), tag: None },
    );
    let mission = judged(&log, enable_and_arm(), None).mission;
    assert!(mission.missing[0].ends_with("arm, due at 1900 ms: never, given at 1950 ms, not executed"), "{mission:?}");
}

/// The verdict with a way point that many millimetres to the east.
fn routed(log: &Log, east_mm: i32) -> Verdict {
    let route = Route { points_mm: vec![(east_mm, 0)], looped: false, in_degraded: true };
    judge(&Evidence { route, ..log.evidence(Vec::new()) })
}

/// It creeps by 0.36 m in nine seconds.
#[test]
fn unmoved_vehicle_with_a_way_left_is_stuck() {
    let verdict = routed(&Log::whole(), 20_000);
    let progress = verdict.mission.progress.as_ref().expect("a route");
    assert_eq!((verdict.outcome, progress.passed, progress.total), (Outcome::Stuck, 0, 1));
    let stuck = progress.stuck.expect("a stretch");
    assert_eq!((stuck.from_ms, stuck.reason), (1000.0, Standstill::NotFollowed), "its set-point is 1 m/s");
    assert!((progress.stuck_s - 8.9).abs() < 0.01, "{progress:?}");
    let texts = oracle::judged::findings(&verdict);
    assert!(
        texts[0].starts_with("stuck for 8.9 s from 1000 ms, 0 of 1 way points passed: a set-point that"),
        "{texts:?}"
    );
}

#[test]
fn vehicle_that_gets_on_or_arrived_is_nominal() {
    let gets_on = routed(&Log::under_way(), 20_000);
    let progress = gets_on.mission.progress.expect("a route");
    assert_eq!((gets_on.outcome, progress.stuck, progress.stuck_s), (Outcome::Nominal, None, 0.0));
    assert!((progress.covered - 0.49).abs() < 0.01, "{progress:?}");
    let arrived = routed(&Log::whole(), 1000);
    assert_eq!(
        (arrived.outcome, arrived.mission.progress.map(|progress| progress.passed)),
        (Outcome::Nominal, Some(1))
    );
    assert_eq!(Log::whole().judge().mission.progress, None, "nowhere to go");
}

/// Set-points of rest are the planner's, or a guest's.
#[test]
fn standstill_is_attributed_by_what_the_plant_held() {
    let reason =
        |log: &Log| routed(log, 20_000).mission.progress.and_then(|progress| progress.stuck).map(|stuck| stuck.reason);
    let mut rests = Log::whole();
    for w in &mut rests.entries {
        if let Any::Instrument(Note::Truth { set_speed_mm_s, speed_mm_s, .. }) = &mut w.entry.event {
            (*set_speed_mm_s, *speed_mm_s) = (0, 0);
        }
    }
    assert_eq!(reason(&rests), Some(Standstill::Planner));
    let guest = |limited: u32| {
        let mut log = rests.clone();
        log.add(10, NodeId::UNIT_A, Event::GuestEngaged { name: Text::new("t"), bare: false, goal: None });
        log.add(9990, NodeId::UNIT_A, Event::GuestSteps { steps: 90, limited });
        reason(&log)
    };
    assert_eq!((guest(0), guest(3)), (Some(Standstill::Guest), Some(Standstill::GuestOrGuards)));
}
