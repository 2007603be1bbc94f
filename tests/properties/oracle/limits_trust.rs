//! The limits of P2 to P4 from both sides: a log just within each is no finding, one just beyond it is.

use evidence::Planned;
use ground_truth::{Any, FaultKind, Note, Sensor, Suspension};
use oracle::Property;
use wire::command::CommandKind;
use wire::event::{Event, Interface};
use wire::id::{FrameId, NodeId, ObjectId, UnitId};
use wire::mode::{Cause, Guard, Mode};
use wire::settings::Settings;

use super::log::{BOUNDS, Log, command};

const TD: u64 = BOUNDS.to_degraded_ms;
const TH: u64 = BOUNDS.to_hold_safe_ms;

fn degrades(log: &mut Log, ms: u64) -> &mut Log {
    log.cut_display(ms).transition(ms, Mode::PrepareToAct, Mode::Degraded, Cause::Lost(Guard::Thermal))
}

fn holds(log: &mut Log, ms: u64) -> &mut Log {
    let from = log.mode(ms);
    log.cut_display(ms).transition(ms, from, Mode::HoldSafe, Cause::Lost(Guard::Lease)).plant_stops(ms)
}

#[test]
fn p2_sensor_loss_to_degraded_limits() {
    let after = |ms: u64| degrades(Log::whole().thermal_fault(4000, 9000), 4000 + ms).breaks();
    assert_eq!(after(TD), []);
    assert_eq!(after(TD + 1), [Property::P2]);
    let lasts = |ms: u64| Log::whole().thermal_fault(4000, 4000 + ms).breaks();
    assert_eq!(lasts(TD), []);
    assert_eq!(lasts(TD + 1), [Property::P2]);
}

/// Missing set-points break it as well.
#[test]
fn p2_missing_reports_without_a_writable_log() {
    let full = |silent_ms: u64| {
        let mut log = Log::whole();
        log.add(5000, NodeId::CAMPAIGN, Note::DiskFull { node: NodeId::RECORDER, on: true });
        log.add(5950, NodeId::CAMPAIGN, Note::DiskFull { node: NodeId::RECORDER, on: false });
        let accepted = |event: &Any| matches!(event, Any::Service(Event::Accepted { at: Interface::Uplink, .. }));
        log.remove_between(5000, 5000 + silent_ms, |w| accepted(&w.entry.event));
        let findings = log.report(5000 + silent_ms).judge().findings;
        findings.iter().any(|f| f.property == Property::P2 && f.message.starts_with("no report"))
    };
    assert_eq!([BOUNDS.freshness_ms, BOUNDS.freshness_ms + 1].map(full), [false, true]);
}

#[test]
fn p3_untimely_link_at_either_end() {
    for node in [NodeId::GATEWAY, NodeId::UNIT_A] {
        let silent = |ms: u64| {
            let mut log = Log::whole();
            log.remove_between(5000, 7000, |w| Some(w.entry.node) == node.guard());
            for t in (5000 + ms..7000).step_by(100) {
                log.saw(t, node, t << 8, ground_truth::GuardVerdict::Passed);
            }
            log
        };
        assert_eq!(silent(TH).breaks(), [], "{node}");
        assert_eq!(silent(TH + 1).breaks(), [Property::P3], "{node}");
        assert_eq!(silent(TH * 3 / 2).breaks(), [Property::P3], "{node}");
        let after = |ms: u64| holds(&mut silent(1900), 5000 + ms).breaks();
        assert_eq!(after(TH), [], "{node}");
        assert_eq!(after(TH + 1), [Property::P3], "{node}");
    }
}

#[test]
fn p3_a_unit_without_its_localisation() {
    let lost = |until_ms: u64, hold_ms: u64| {
        let mut log = Log::whole();
        let (sensor, kind) = (Sensor::Localisation, FaultKind::Dropout);
        let fault = |active| Note::Fault { sensor, kind, active, frame: FrameId(1) };
        log.planned.push(Planned::Fault(sensor, kind).into());
        log.add(4000, NodeId::SIM, fault(true)).add(until_ms, NodeId::SIM, fault(false));
        log.altered(4000, sensor, kind, NodeId::UNIT_A);
        holds(degrades(&mut log, 4300), hold_ms).breaks()
    };
    assert_eq!(lost(9000, 4000 + TH), []);
    assert_eq!(lost(9000, 4000 + TH + 1), [Property::P3]);
    assert_eq!(lost(4000 + TH, 9900), []);
    assert_eq!(lost(4000 + TH + 1, 9900), [Property::P3]);
}

#[test]
fn p3_localisation_error_limit_and_duration() {
    let off = |mm: i32, for_ms: u64| {
        let mut log = Log::whole();
        let to = 5100 + for_ms;
        let pose = log.way(to);
        log.cut_display(5000).located(to, pose).truth(to, 1000, 5000);
        for w in log.entries.iter_mut().filter(|w| (5_100_000..=to * 1000).contains(&w.at)) {
            if let Any::Service(Event::Located { pose_y_mm, .. }) = &mut w.entry.event {
                *pose_y_mm = mm;
            }
        }
        log.breaks()
    };
    let margin = BOUNDS.fence_margin_mm as i32;
    assert_eq!(off(margin, TH + 1), []);
    assert_eq!(off(margin + 1, TH + 1), [Property::P3]);
    assert_eq!(off(margin + 1, TH), []);
}

#[test]
fn p3_how_soon_an_operators_hold_is_obeyed() {
    let obeyed = |ms: u64| {
        let mut log = Log::whole();
        log.add(5000, NodeId::CONSOLE, Event::Intended { command: command(9), kind: CommandKind::Hold, tag: None });
        holds(&mut log, 5000 + ms).breaks()
    };
    // 50 ms for the command's way.
    assert_eq!(obeyed(TH + 50), []);
    assert_eq!(obeyed(TH + 51), [Property::P3]);
}

#[test]
fn p2_p3_response_time_to_a_death() {
    let responds = |node: NodeId, degraded: u64, held: Option<u64>| {
        let mut log = Log::whole();
        degrades(log.killed(5000, node), 5000 + degraded);
        if let Some(ms) = held {
            holds(&mut log, 5000 + ms);
        }
        let mut found = log.breaks_with_dead(node);
        found.retain(|p| matches!(p, Property::P2 | Property::P3));
        found
    };
    let unsealed = BOUNDS.seal_limit_ms + BOUNDS.control_period_ms;
    assert_eq!(responds(NodeId::PERCEPTION, TD, Some(TH)), []);
    assert_eq!(responds(NodeId::PERCEPTION, TD + 1, Some(TH)), [Property::P2]);
    assert_eq!(responds(NodeId::PERCEPTION, TD, Some(TH + 1)), [Property::P3]);
    assert_eq!(responds(NodeId::RECORDER, unsealed, None), []);
    assert_eq!(responds(NodeId::RECORDER, unsealed + 1, None), [Property::P2]);
}

#[test]
fn p3_dead_units_plant_stops_in_time() {
    let stops = |change: &dyn Fn(&mut Log)| {
        let mut log = Log::whole();
        change(log.killed(5000, NodeId::UNIT_A).cut_display(5000).plant_stops(5300));
        log.breaks_with_dead(NodeId::UNIT_A)
    };
    let leased = |ms: u64| {
        stops(&|log| {
            log.driven(5000 + ms, 1000, 1000);
        })
    };
    // What a log entry may lag behind.
    let lease = BOUNDS.set_point_lease_ms + 50;
    assert_eq!(leased(lease), []);
    assert_eq!(leased(lease + 1), [Property::P3]);
    let moves = |ms: u64, speed: i32| {
        stops(&|log| {
            log.driven(ms, 0, speed);
            if let Some(Any::Instrument(Note::Truth { leased, .. })) =
                log.entries.last_mut().map(|w| &mut w.entry.event)
            {
                *leased = false;
            }
        })
    };
    // Th, a second of braking, and the period of truth.
    assert_eq!(moves(5000 + TH + 1100, 51), []);
    assert_eq!(moves(5000 + TH + 1101, 50), []);
    assert_eq!(moves(5000 + TH + 1101, 51), [Property::P3]);
}

#[test]
fn p3_resumed_unit_after_its_lease() {
    let hung = |ms: u64, held_ms: u64| {
        let mut log = Log::whole();
        for (at, on) in [(5000, true), (5000 + ms, false)] {
            log.add(at, NodeId::CAMPAIGN, Note::Suspended { node: NodeId::UNIT_A, how: Suspension::Hang, on });
        }
        holds(&mut log, held_ms);
        let findings = log.judge().findings;
        findings.iter().any(|f| f.property == Property::P3 && f.message.contains("did not run"))
    };
    let lease = BOUNDS.lease_ms + BOUNDS.control_period_ms;
    assert_eq!([lease, lease + 1].map(|ms| hung(ms, 9000)), [false, true]);
    // One judgement, and what is under way.
    let judged = 5000 + lease + 1 + BOUNDS.control_period_ms + 50;
    assert_eq!([judged, judged + 1].map(|time| hung(lease + 1, time)), [false, true]);
}

#[test]
fn p4_fence_holds_at_any_speed() {
    let driven = |fence_mm: i32, speed: i32| Log::whole().truth(5000, speed, fence_mm).breaks();
    assert_eq!(driven(0, 800), []);
    for speed in [0, 50, 51, -51] {
        assert_eq!(driven(-1, speed), [Property::P4], "{speed}");
    }
}

#[test]
fn p4_collision_counts_for_the_one_that_drives() {
    let hit = |unit, speed_mm_s: i32| {
        let note = Note::Collided { unit, object: ObjectId(3), speed_mm_s };
        Log::whole().add(5000, NodeId::SIM, note).breaks()
    };
    assert_eq!([hit(UnitId::A, 50), hit(UnitId::B, 900)], [vec![], vec![]]);
    assert_eq!([hit(UnitId::A, 51), hit(UnitId::A, -51)], [vec![Property::P4], vec![Property::P4]]);
}

#[test]
fn p4_the_margin_that_goes_with_a_speed() {
    let set = |speed_mm_s: u16, margin_mm: u16| {
        let values = Settings { speed_mm_s, margin_mm, arm_permille: 600, keep_permille: 450 };
        Log::whole().command(500, 9, CommandKind::Configure(values)).breaks()
    };
    for (speed, least) in [(1500, 300), (3000, 600)] {
        assert_eq!(set(speed, least), []);
        assert_eq!(set(speed, least - 1), [Property::P4]);
    }
}
