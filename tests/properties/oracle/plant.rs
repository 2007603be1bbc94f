//! Speeds and executions are judged at the plant and in the unit's modes, independently of the unit's own statements (P2,
//! P3, P4, P8, P9); findings against a teammate and displays of a unit come from that one's accepted records (P5).

use evidence::trial::Outcome;
use ground_truth::{Any, Note};
use oracle::Property;
use wire::command::CommandKind;
use wire::event::{Event, Inconsistency, Interface};
use wire::id::{Boot, NodeId, PeerId, RecordId, Sequence, UnitId};
use wire::mode::{Because, Cause, Guard, Guards, Mode};
use wire::policy::Waived;
use wire::settings::Settings;

use super::log::{BOUNDS, Log, command};

/// Time after a change in which the plant may follow a set-point from before it: its lease, and the lag of an entry.
const FOLLOWS_MS: u64 = BOUNDS.set_point_lease_ms + 50;

/// The unit is DEGRADED from 5 s on, and the plant does this at `ms`.
fn degraded(ms: u64, requested: i32, speed: i32) -> Vec<Property> {
    let mut log = Log::whole();
    log.cut_display(5000).transition(5000, Mode::PrepareToAct, Mode::Degraded, Cause::Lost(Guard::Thermal));
    log.driven(ms, requested, speed).breaks()
}

#[test]
fn p2_unit_drives_in_degraded_at_full_speed() {
    let mut log = Log::whole();
    log.thermal_fault(4000, 10_000);
    log.cut_display(4300).transition(4300, Mode::PrepareToAct, Mode::Degraded, Cause::Lost(Guard::Thermal));
    assert_eq!(log.judge().outcome, Outcome::Degraded);
    for t in (4350..10_000).step_by(100) {
        log.driven(t, 3000, 2900);
    }
    assert_eq!((log.breaks(), log.judge().outcome), (vec![Property::P2], Outcome::Late));
}

/// Set-point and true speed, just after the limit is due.
#[test]
fn p2_speeds_just_beyond_degraded_limits() {
    let due = 5000 + FOLLOWS_MS;
    assert_eq!(degraded(due, 1000, 1000), []);
    assert_eq!(degraded(due, 1001, 1000), [Property::P2]);
    assert_eq!(degraded(due, -1001, 0), [Property::P2], "backwards");
    assert_eq!(degraded(due - 1, 3000, 3000), [], "the last set-point from before may still be followed");
    // Braking from 3 m/s to 1 m/s at 3 m/s².
    let slow = due + 667;
    assert_eq!(degraded(slow, 1000, 1250), []);
    assert_eq!(degraded(slow, 1000, 1251), [Property::P2]);
    assert_eq!(degraded(slow - 1, 1000, 3000), [], "it brakes");
}

#[test]
fn p4_speed_above_platform_or_operator_limit() {
    let driven = |set_mm_s: Option<u16>, requested: i32, speed: i32| {
        let mut log = Log::whole();
        if let Some(speed_mm_s) = set_mm_s {
            let values = Settings { speed_mm_s, margin_mm: 1000, arm_permille: 600, keep_permille: 450 };
            log.command(500, 4, CommandKind::Configure(values));
        }
        log.driven(6000, requested, speed).breaks()
    };
    assert_eq!(driven(None, 3000, 3250), []);
    assert_eq!(driven(None, 3001, 3000), [Property::P4]);
    assert_eq!(driven(None, 3000, 3251), [Property::P4]);
    assert_eq!(driven(Some(1500), 1500, 1750), []);
    assert_eq!(driven(Some(1500), 1501, 1500), [Property::P4]);
    assert_eq!(driven(Some(1500), 1500, 1751), [Property::P4]);
}

#[test]
fn p4_operator_settings_last_until_restart() {
    let values = Settings { speed_mm_s: 1500, margin_mm: 1000, arm_permille: 600, keep_permille: 450 };
    let mut log = Log::whole();
    log.command(500, 4, CommandKind::Configure(values)).killed(3000, NodeId::UNIT_A).cut_display(3000);
    log.add(3100, NodeId::CAMPAIGN, Note::Restarted { node: NodeId::UNIT_A, boot: Boot(2) });
    log.command(3200, 5, CommandKind::Enable).transition(3200, Mode::Idle, Mode::Ready, Cause::Operator);
    log.driven(6000, 3000, 3000);
    let findings = log.judge_with(vec![NodeId::UNIT_A]).findings;
    assert!(!findings.iter().any(|f| f.property == Property::P4), "{findings:?}");
}

#[test]
fn p9_plant_drives_before_enable() {
    let idle = |ms: u64, requested: i32, speed: i32| Log::whole().driven(ms, requested, speed).breaks();
    assert_eq!(idle(FOLLOWS_MS, 50, 50), []);
    assert_eq!(idle(FOLLOWS_MS, 51, 0), [Property::P9]);
    let mut log = Log::whole();
    log.entries.retain(|w| !matches!(w.entry.event, Any::Service(Event::Transition { .. } | Event::Executed { .. })));
    let breaks = log.cut_display(0).breaks();
    assert!(breaks.contains(&Property::P9), "{breaks:?}");
}

/// The unit has the time that it needs to brake.
#[test]
fn p3_holding_unit_stops_with_its_lease() {
    let held = |ms: u64, requested: i32, speed: i32| {
        let mut log = Log::whole();
        log.cut_display(5000)
            .transition(5000, Mode::PrepareToAct, Mode::HoldSafe, Cause::Lost(Guard::Lease))
            .plant_stops(5000);
        log.driven(ms, requested, speed).breaks()
    };
    let due = 5000 + FOLLOWS_MS;
    assert_eq!(held(due - 1, 3000, 3000), []);
    assert_eq!(held(due, 51, 0), [Property::P3]);
    // Braking from 3 m/s to 0.05 m/s at 3 m/s².
    let standing = due + 984;
    assert_eq!(held(standing - 1, 0, 51), []);
    assert_eq!(held(standing, 0, 50), []);
    assert_eq!(held(standing, 0, 51), [Property::P3]);
}

/// A plant tells its speed along its own axis. Sideways it shows in its places alone.
#[test]
fn p3_holding_unit_that_is_carried_sideways() {
    let slid = |mm_s: i32| {
        let mut log = Log::whole();
        log.cut_display(5000)
            .transition(5000, Mode::PrepareToAct, Mode::HoldSafe, Cause::Lost(Guard::Lease))
            .plant_stops(5000);
        for w in log.entries.iter_mut().filter(|w| w.at >= 7_000_000) {
            if let Any::Instrument(Note::Truth { y_mm, .. }) = &mut w.entry.event {
                *y_mm = (w.at - 7_000_000) as i32 / 1000 * mm_s / 1000;
            }
        }
        log.breaks()
    };
    assert_eq!(slid(0), []);
    // With the 40 mm/s east that every place creeps.
    assert_eq!(slid(20), []);
    assert!(slid(60).contains(&Property::P3), "{:?}", slid(60));
}

#[test]
fn p8_hold_acknowledged_but_not_executed() {
    let due = 5000 + FOLLOWS_MS;
    assert_eq!(Log::whole().held(5000).breaks(), []);
    assert_eq!(Log::whole().held(5000).driven(due - 1, 3000, 3000).breaks(), []);
    let broken = [Property::P3, Property::P8];
    assert_eq!(Log::whole().held(5000).driven(due, 51, 0).breaks(), broken, "the plant is driven");
    assert_eq!(Log::whole().held(5000).driven(due + 984, 0, 51).breaks(), broken, "the plant does not come to rest");
    let moves = |ms: u64| {
        let mut log = Log::whole();
        log.command(5000, 9, CommandKind::Hold).cut_display(5000).plant_stops(5000);
        log.transition(5000 + ms, Mode::PrepareToAct, Mode::HoldSafe, Cause::Lost(Guard::Lease)).breaks()
    };
    assert_eq!(moves(50), []);
    assert_eq!(moves(51), [Property::P8], "the unit is in another mode");
}

#[test]
fn p8_a_hold_ends_with_an_operators_resume() {
    let mut log = Log::whole();
    log.held(5000).command(8000, 10, CommandKind::Resume).transition(
        8000,
        Mode::HoldSafe,
        Mode::Ready,
        Cause::Operator,
    );
    log.remove_between(8000, 10_000, |w| matches!(w.entry.event, Any::Instrument(Note::Truth { .. })));
    assert_eq!(log.driven(8400, 3000, 1000).breaks(), []);
}

#[test]
fn p8_a_disarm_that_leaves_authority() {
    let disarmed = |ms: u64| {
        let mut log = Log::whole();
        log.command(5000, 9, CommandKind::Disarm).disarmed(5000 + ms).breaks()
    };
    assert_eq!(disarmed(50), []);
    assert_eq!(disarmed(51), [Property::P8]);
}

#[test]
fn p8_mode_change_without_or_after_execution() {
    let change = |log: &mut Log, ms: u64, (from, to): (Mode, Mode), n: u64| {
        let (cause, because) = (Cause::Operator, Because::Command(command(n)));
        let event = Event::Transition { from, to, cause, because, failing: Guards::default() };
        log.add(ms, NodeId::UNIT_A, event);
    };
    let (disarm, ended) = (CommandKind::Disarm, (Mode::PrepareToAct, Mode::Ready));
    let reported = |ms: u64| {
        let mut log = Log::whole();
        log.command(5000, 9, disarm).cut_display(4900);
        change(&mut log, ms, ended, 9);
        log.breaks()
    };
    assert_eq!([4950, 5000, 5050].map(reported), [vec![], vec![], vec![]]);
    assert_eq!(reported(4949), [Property::P8]);
    let mut log = Log::whole();
    log.command(5000, 9, disarm).cut_display(4900);
    change(&mut log, 5000, ended, 9);
    change(&mut log, 5020, (Mode::Ready, Mode::HoldSafe), 9);
    log.plant_stops(5020);
    assert_eq!(log.breaks(), [Property::P8], "twice for one execution");
}

#[test]
fn p8_plant_acts_twice_on_a_command() {
    let mut log = Log::whole();
    log.cut_display(5000).confirm_and_act(5000, wire::sensor::Class::Vehicle, 100);
    assert_eq!(log.breaks(), []);
    log.plant_act(5040, wire::sensor::Class::Vehicle, 100);
    assert!(log.breaks().contains(&Property::P8), "{:?}", log.breaks());
}

#[test]
fn p5_teammate_convicted_by_a_refused_record() {
    let found_out = |accepted: Option<u64>| {
        let record = RecordId { node: NodeId::UNIT_B, boot: Boot(1), sequence: Sequence(7) };
        let mut log = Log::whole();
        if let Some(ms) = accepted {
            let (peer, waived) = (PeerId::UNIT_B, Waived::default());
            let event = Event::Accepted { at: Interface::Downlink, record, peer, age: None, waived };
            log.add(ms, NodeId::UNIT_A, event);
        }
        let event = Event::Inconsistent { unit: UnitId::B, finding: Inconsistency::Kinematics, record };
        log.add(5000, NodeId::UNIT_A, event).breaks()
    };
    assert_eq!(found_out(Some(5000)), []);
    assert_eq!(found_out(Some(5001)), [Property::P5], "accepted only then");
    assert_eq!(found_out(None), [Property::P5]);
}

#[test]
fn p5_unit_displayed_by_anothers_report() {
    let mut log = Log::whole();
    for w in log.entries.iter_mut().filter(|w| w.at == 5_005_000) {
        if let Any::Service(Event::Displayed { unit, .. }) = &mut w.entry.event {
            *unit = UnitId::B;
        }
    }
    assert_eq!(log.breaks(), [Property::P5]);
}
