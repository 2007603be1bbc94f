//! P2, P3 and P4: a loss restricts in time, a unit ordered to hold stands, and the fence is kept.

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

use config::contact::{Contact, Contacts};
use evidence::trial::Outcome;
use evidence::{Evidence, Planned};
use ground_truth::{Action, Any, FaultKind, GuardVerdict, Note, Sensor};
use oracle::{Property, judge};
use wire::command::CommandKind;
use wire::core::Side;
use wire::event::Event;
use wire::id::{FrameId, NodeId, PeerId};
use wire::mode::{Cause, Guard, Mode};
use wire::settings::Settings;
use wire::time::Span;

use super::log::{Log, command};

#[test]
fn p2_a_lost_subsystem_without_restriction() {
    let mut log = Log::whole();
    log.thermal_fault(4000, 9000);
    assert_eq!(log.breaks(), [Property::P2]);
    assert_eq!(log.judge().outcome, Outcome::Late);
}

#[test]
fn p3_unit_continues_beyond_localisation_loss() {
    let lost = |until_ms: u64| {
        let mut log = Log::whole();
        let fault =
            |active| Note::Fault { sensor: Sensor::Localisation, kind: FaultKind::Dropout, active, frame: FrameId(1) };
        log.add(4000, NodeId::SIM, fault(true)).add(until_ms, NodeId::SIM, fault(false));
        log.altered(4000, Sensor::Localisation, FaultKind::Dropout, NodeId::UNIT_A);
        let findings = log.judge().findings;
        findings.iter().any(|f| f.property == Property::P3 && f.message.starts_with("localisation lost"))
    };
    assert!(lost(6000));
    assert!(!lost(4900), "one that came back in time was not lost for good");
}

#[test]
fn p3_nothing_timely_for_longer_than_the_bound() {
    let mut log = Log::whole();
    let guard = NodeId::UNIT_A.guard();
    log.entries.retain(|w| !(w.at > 5_000_000 && w.at < 7_000_000 && Some(w.entry.node) == guard));
    assert_eq!(log.breaks(), [Property::P3]);
}

#[test]
fn p3_silence_is_spanned_from_the_end_of_a_planned_contact_into_the_next_alone() {
    let silent = |from: u64, to: u64, contacts: &[(u64, u64)]| {
        let mut log = Log::whole();
        let guard = NodeId::UNIT_A.guard();
        let in_window = |time: u64| time > from * 1_000 && time < to * 1_000;
        log.entries.retain(|w| !(in_window(w.at) && Some(w.entry.node) == guard));
        let contact = |(from, until): &(u64, u64)| Contact { from: Span::ms(*from), until: Span::ms(*until) };
        let contacts = Contacts::new(contacts.iter().map(contact).collect()).unwrap();
        let findings = judge(&Evidence { contacts, ..log.evidence(Vec::new()) }).findings;
        findings.iter().map(|f| f.property).collect::<Vec<_>>()
    };
    assert_eq!(silent(5_000, 7_000, &[(0, 5_000), (7_000, 20_000)]), []);
    assert_eq!(
        silent(5_000, 9_500, &[(0, 5_000), (7_000, 20_000)]),
        [Property::P3],
        "the next contact brought nothing"
    );
    assert_eq!(silent(5_000, 7_000, &[(0, 8_000), (9_000, 20_000)]), [Property::P3], "three seconds before the end");
    assert_eq!(silent(5_000, 7_000, &[(0, 5_000)]), [Property::P3], "no other contact follows");
}

#[test]
fn p3_delayed_records_are_untimely() {
    let mut log = Log::whole();
    for t in (5000..8000).step_by(100) {
        let hash = t << 8 | NodeId::GATEWAY.index() as u64;
        let event = Note::Attack { action: Action::Delay, side: Side::Server, length: 100, hash, delay: Span::ms(400) };
        log.add(t - 400, NodeId::RELAY_TELEMETRY, event);
    }
    log.planned.push(Planned::Action(Action::Delay).into());
    // The late record is also accepted in this log, which breaks P7.
    assert_eq!(log.breaks(), [Property::P3, Property::P7]);
}

#[test]
fn p3_restored_drop_counts_as_delay() {
    let dropped = |ms: u64| {
        let mut log = Log::whole();
        log.entries.retain(|w| {
            let in_gap = (5_000_001..6_200_000).contains(&w.at) && w.at != 5_700_000;
            !(in_gap && Some(w.entry.node) == NodeId::GATEWAY.guard())
        });
        let hash = 5700 << 8 | NodeId::GATEWAY.index() as u64;
        for (at, action) in [(5700 - ms, Action::Drop), (5700, Action::Replay)] {
            let event = Note::Attack { action, side: Side::Client, length: 100, hash, delay: Span::ZERO };
            log.add(at, NodeId::RELAY_TELEMETRY, event);
        }
        log.planned.push(Planned::Action(Action::Replay).into());
        log.judge().findings
    };
    let silent = |ms: u64| dropped(ms).iter().any(|f| f.message.starts_with("nothing timely"));
    assert!(!silent(301), "what two clocks may differ by is not late");
    assert!(silent(302), "it came too late to be a sign of the unit");
    let accepted = dropped(302).iter().any(|f| f.property == Property::P7);
    assert!(accepted, "and that it was accepted all the same is P7's to say");
}

#[test]
fn p3_mislocated_unit() {
    let located = |off_mm: i32| {
        let mut log = Log::whole();
        for w in log.entries.iter_mut().filter(|w| (5_100_000..7_100_000).contains(&w.at)) {
            match &mut w.entry.event {
                Any::Service(Event::Located { pose_y_mm, .. }) => *pose_y_mm = off_mm,
                Any::Service(Event::Displayed { place: Some(place), .. }) => place.y_mm = off_mm,
                _ => {}
            }
        }
        log.breaks()
    };
    assert_eq!(located(900), []);
    assert_eq!(located(1100), [Property::P3]);
}

#[test]
fn p3_plant_ignores_a_hold() {
    let mut log = Log::whole();
    log.cut_display(5000).transition(5000, Mode::PrepareToAct, Mode::HoldSafe, Cause::Lost(Guard::Lease));
    assert_eq!(log.breaks(), [Property::P3]);
}

#[test]
fn p3_creeping_plant_follows_a_hold() {
    let held = |creeps: i32, resumed_ms: u64| {
        let mut log = Log::whole();
        log.cut_display(5000).transition(5000, Mode::PrepareToAct, Mode::HoldSafe, Cause::Operator).plant_stops(5000);
        log.command(7000, 3, CommandKind::Resume).transition(7000, Mode::HoldSafe, Mode::Ready, Cause::Operator);
        for w in &mut log.entries {
            if let Any::Instrument(Note::Truth { speed_mm_s, set_speed_mm_s, leased, .. }) = &mut w.entry.event {
                match w.at {
                    at if at >= resumed_ms * 1000 => (*speed_mm_s, *set_speed_mm_s, *leased) = (1000, 1000, true),
                    6_500_000..7_000_000 => (*speed_mm_s, *set_speed_mm_s) = (creeps, creeps),
                    _ => {}
                }
            }
        }
        log.breaks()
    };
    assert_eq!(held(50, 7000), []);
    assert_eq!(held(51, 7000), [Property::P3]);
    assert_eq!(held(0, 6900), [Property::P3], "before it was resumed");
}

#[test]
fn p4_driving_outside_the_fence() {
    let mut log = Log::whole();
    log.truth(5000, 800, -20);
    assert_eq!(log.breaks(), [Property::P4]);
}

#[test]
fn p3_operator_hold_obeyed_late() {
    let mut log = Log::whole();
    log.add(5000, NodeId::CONSOLE, Event::Intended { command: command(3), kind: CommandKind::Hold, tag: None });
    assert_eq!(log.breaks(), [Property::P3]);
    assert_eq!(log.judge().outcome, Outcome::Late);
}

#[test]
fn p4_settings_let_a_blind_unit_leave() {
    let values = |margin_mm| Settings { speed_mm_s: 3000, margin_mm, arm_permille: 600, keep_permille: 450 };
    let mut log = Log::whole();
    log.command(500, 3, CommandKind::Configure(values(600)));
    assert_eq!(log.breaks(), []);
    log.command(600, 4, CommandKind::Configure(values(599)));
    assert_eq!(log.breaks(), [Property::P4]);
}

#[test]
fn p3_unit_obeys_a_hold_late() {
    let event = Event::Intended { command: command(9), kind: CommandKind::Hold, tag: None };
    let mut log = Log::whole();
    log.add(7000, NodeId::CONSOLE, event);
    assert_eq!(log.breaks(), [Property::P3]);
    let mut log = Log::whole();
    log.add(7000, NodeId::CONSOLE, event).transition(7900, Mode::Ready, Mode::HoldSafe, Cause::Operator);
    let findings = log.judge().findings;
    assert!(!findings.iter().any(|f| f.message.contains("had not held")), "{findings:?}");
}

#[test]
fn p3_teammate_traffic_is_no_unit_contact() {
    let mut log = Log::whole();
    let guard = NodeId::GATEWAY.guard().expect("a guard");
    log.entries.retain(|w| !(w.at > 5_000_000 && w.at < 7_000_000 && w.entry.node == guard));
    log.add(60, guard, Note::Associated { association: 2, peer: PeerId::UNIT_B });
    for t in (5050..7000).step_by(100) {
        let (hash, verdict) = (t << 8, GuardVerdict::Passed);
        log.add(t, guard, Note::GuardSaw { association: 2, epoch: 1, sequence: t, length: 100, hash, verdict });
    }
    assert_eq!(log.breaks(), [Property::P3]);
}
