//! Alarms after ISA-18.2: one group a cause, none for an order or a plan, and none that comes too often.

use console::act::{Act, Alarm, Order, Role};
use console::alarm::{LedTo, Priority, ShownGroup};
use console::history::Incident;
use console::shown::Shown;
use sha2::Digest;
use wire::codec::{List, Text};
use wire::command::{Ack, CommandKind};
use wire::event::Inconsistency;
use wire::feed::Feed;
use wire::id::{Boot, NodeId, PeerId, TrackId, UnitId};
use wire::measured::Measured;
use wire::mode::{Cause, Guard, Guards, Mode};
use wire::policy::Policy;
use wire::report::{Report, ReportedAuthority, ReportedContact, ReportedTrack};
use wire::sensor::{Class, Pose};
use wire::time::Span;

use crate::bench::{Bench, sign};

const A: UnitId = UnitId::A;
const B: UnitId = UnitId::B;
const C: UnitId = UnitId::C;
pub(crate) const HOLD: Act = Act::Now(Order::Command(A, CommandKind::Hold));
pub(crate) const PERIOD: Span = Span::ms(100);
/// Three units: the third is one that only a teammate speaks of.
const UNITS: [UnitId; 2] = [A, B];

pub(crate) fn shown(bench: &Bench) -> Shown {
    bench.console.shown(bench.now)
}

pub(crate) fn groups(bench: &Bench) -> Vec<ShownGroup> {
    shown(bench).alarms
}

pub(crate) fn causes(bench: &Bench) -> Vec<Alarm> {
    groups(bench).iter().map(|group| group.cause).collect()
}

pub(crate) fn group(bench: &Bench, cause: Alarm) -> ShownGroup {
    groups(bench).into_iter().find(|group| group.cause == cause).unwrap_or_else(|| panic!("{cause:?} is not listed"))
}

fn led_to(group: &ShownGroup) -> Vec<LedTo> {
    group.led_to.iter().map(|(_, what)| *what).collect()
}

pub(crate) fn raised(bench: &Bench) -> u32 {
    shown(bench).alarms_in_hour
}

fn events(bench: &Bench) -> Vec<Incident> {
    shown(bench).past.iter().map(|past| past.what).collect()
}

pub(crate) fn acknowledge(bench: &mut Bench, cause: Alarm) {
    let since = group(bench, cause).since;
    bench.act(Act::Acknowledge(cause, since)).unwrap();
}

fn track(id: u32, class: Class, x_mm: i32, y_mm: i32, report: &Report) -> ReportedTrack {
    ReportedTrack { id: TrackId(id), class, x_mm, y_mm, ..report.tracks.iter().next().copied().unwrap() }
}

fn with_tracks(report: Report, tracks: &[(u32, i32, i32)]) -> Report {
    let tracks: List<ReportedTrack, 8> =
        tracks.iter().map(|(id, x, y)| track(*id, Class::Decoy, *x, *y, &report)).collect();
    Report { tracks, ..report }
}

pub(crate) fn hear(bench: &mut Bench, report: &Report) {
    bench.heard(report, Span::ms(20));
    bench.pass(PERIOD);
}

/// A's next report in a mode that this guard's failure brought about.
pub(crate) fn failing(bench: &mut Bench, mode: Mode, guard: Guard) -> Report {
    let cause = if mode == Mode::HoldSafe && guard != Guard::Teammates {
        Cause::Unrecovered(guard)
    } else {
        Cause::Lost(guard)
    };
    Report { cause, failing: Guards::default().with_guard(guard), ..bench.next(mode) }
}

/// A's next report after it found that C contradicts itself.
fn contradicted(bench: &mut Bench, found: Inconsistency) -> Report {
    let report = failing(bench, Mode::HoldSafe, Guard::Teammates);
    Report { measured: Measured::default().claimed(Some((C, found))), ..report }
}

/// A and B report for `span`.
fn both(bench: &mut Bench, span: Span) {
    for _ in 0..span.0 / PERIOD.0 {
        let report = bench.next(Mode::Ready);
        let other = Report { origin: NodeId::UNIT_B, ..report.clone() };
        bench.heard(&report, Span::ms(20));
        bench.heard_as(&sign(NodeId::UNIT_B, &other), B, Some(Span::ms(20)), bench.now);
        bench.pass(PERIOD);
    }
}

/// The unit executes the person's last command, and from then on reports its effect.
fn executed(bench: &mut Bench, mode: Mode) {
    let (intent, bytes) = bench.intents().last().cloned().unwrap();
    let hash = sha2::Sha256::digest(&bytes).into();
    bench.acknowledged(NodeId::UNIT_A, &Ack { id: intent.id, intent: hash, refused: None, mode, due: None });
}

fn held(bench: &mut Bench) {
    bench.act(HOLD).unwrap();
    executed(bench, Mode::HoldSafe);
    let report = Report { cause: Cause::Operator, ..bench.next(Mode::HoldSafe) };
    hear(bench, &report);
}

/// Laps past objects, an arming that is used, a HOLD and a resumption: 0 alarms.
#[test]
fn quiet_hour_raises_none() {
    let mut bench = Bench::quiet(&UNITS);
    let mut lap = 0_u32;
    for tick in 0..18_000_i32 {
        let along = tick * 500 % 200_000;
        lap += u32::from(along == 0);
        let mode = if (9_000..9_600).contains(&tick) { Mode::HoldSafe } else { Mode::Ready };
        if tick == 9_000 {
            bench.act(HOLD).unwrap();
            executed(&mut bench, mode);
        }
        if tick == 9_595 {
            bench.order(CommandKind::Resume).unwrap();
            executed(&mut bench, Mode::Ready);
        }
        let report = Report {
            cause: Cause::Operator,
            pose: Pose { x_mm: along, y_mm: 0, yaw_mrad: 0 },
            speed_mm_s: if mode == Mode::Ready { 2_500 } else { 0 },
            ..bench.next(mode)
        };
        // Objects 3 m beside the way, in view from 20 m ahead until they are at the side.
        let ahead = |at: &i32| (0..20_000).contains(&(at - along));
        let seen: Vec<(u32, i32, i32)> =
            (0..5).map(|n| n * 40_000).filter(ahead).map(|at| (lap * 8 + at as u32 / 40_000, at, 3_000)).collect();
        bench.heard(&with_tracks(report, &seen), Span::ms(20));
        bench.pass(Span::ms(200));
        bench.journal.clear();
        bench.events.clear();
        assert_eq!(causes(&bench), [], "at {} s", tick / 5);
    }
    let ended = events(&bench).iter().filter(|event| matches!(event, Incident::TrackEnded(..))).count();
    assert!(ended > 100, "{ended}");
    assert_eq!(raised(&bench), 0);
}

#[test]
fn own_hold_raises_none_and_anothers_does() {
    let mut bench = Bench::seating(Role::Supervise);
    bench.reports(Mode::Ready, Span::s(1));
    held(&mut bench);
    assert_eq!((causes(&bench), raised(&bench)), (vec![], 0));
    // The same after a resumption that was given here: the HOLD before it is no excuse.
    bench.order(CommandKind::Resume).unwrap();
    executed(&mut bench, Mode::Ready);
    bench.reports(Mode::Ready, Span::s(1));
    let report = Report { cause: Cause::Operator, ..bench.next(Mode::HoldSafe) };
    hear(&mut bench, &report);
    assert_eq!(causes(&bench), [Alarm::HeldElsewhere(A)]);
    assert_eq!(group(&bench, Alarm::HeldElsewhere(A)).priority, Priority::High);
}

/// A HOLD that reaches the unit as the end of its permission is the operator's too.
#[test]
fn own_hold_by_the_lease_raises_none() {
    let mut bench = Bench::seating(Role::Supervise);
    bench.reports(Mode::Ready, Span::s(1));
    bench.act(HOLD).unwrap();
    executed(&mut bench, Mode::HoldSafe);
    let report = failing(&mut bench, Mode::HoldSafe, Guard::Lease);
    hear(&mut bench, &report);
    assert_eq!(causes(&bench), []);
}

#[test]
fn cause_is_one_group_with_what_it_led_to() {
    let mut bench = Bench::seating(Role::Supervise);
    bench.reports(Mode::Ready, Span::s(1));
    let held = ReportedAuthority { track: TrackId(4), left: Span::s(3) };
    let armed = Report { authority: Some(held), ..bench.next(Mode::PrepareToAct) };
    hear(&mut bench, &armed);
    let report = contradicted(&mut bench, Inconsistency::TimeBase);
    bench.heard(&report, Span::ms(20));
    let cause = Alarm::Contradicts(C);
    assert_eq!((causes(&bench), raised(&bench)), (vec![cause], 1));
    let known = group(&bench, cause);
    assert_eq!((known.priority, known.words().as_str()), (Priority::High, "unit-c contradicts itself"));
    assert_eq!(known.first, bench.now);
    let consequences =
        [LedTo::Found(A, Inconsistency::TimeBase), LedTo::Mode(A, Mode::HoldSafe), LedTo::Revoked(A, TrackId(4))];
    assert_eq!(led_to(&known), consequences);
    // It goes with its consequences: over once the unit is no longer held.
    acknowledge(&mut bench, cause);
    bench.reports(Mode::HoldSafe, Span::s(1));
    assert!(group(&bench, cause).standing, "resuming is still asked for");
    bench.pass(PERIOD);
    bench.reports(Mode::Ready, Span::s(1));
    assert_eq!(causes(&bench), []);
}

/// The console knows no more than that two of them claim one place.
#[test]
fn exclusion_is_not_called_self_contradiction() {
    let mut bench = Bench::seating(Role::Supervise);
    bench.reports(Mode::Ready, Span::s(1));
    let report = contradicted(&mut bench, Inconsistency::Exclusion);
    hear(&mut bench, &report);
    assert_eq!(causes(&bench), [Alarm::Claims(C)]);
}

/// The same cause, more urgent: no second alarm, but it asks for an act again.
#[test]
fn loss_that_grows_to_hold_safe_stays_one_group() {
    let mut bench = Bench::seating(Role::Supervise);
    bench.reports(Mode::Ready, Span::s(1));
    let cause = Alarm::GuardLost(A, Guard::Thermal);
    let report = failing(&mut bench, Mode::Degraded, Guard::Thermal);
    hear(&mut bench, &report);
    assert_eq!(group(&bench, cause).priority, Priority::Medium);
    acknowledge(&mut bench, cause);
    let report = failing(&mut bench, Mode::HoldSafe, Guard::Thermal);
    hear(&mut bench, &report);
    let known = group(&bench, cause);
    assert_eq!((causes(&bench), raised(&bench)), (vec![cause], 1));
    assert_eq!((known.priority, known.acknowledged, known.times), (Priority::High, false, 1));
    assert_eq!(led_to(&known), [LedTo::Mode(A, Mode::Degraded), LedTo::Mode(A, Mode::HoldSafe)]);
}

#[test]
fn silence_is_one_group_with_link_tracks_and_orders() {
    let mut bench = Bench::with_units(&UNITS, Policy::default(), Role::Supervise);
    both(&mut bench, Span::s(1));
    bench.feed(&Feed::Session(PeerId::UNIT_A, false));
    let command = bench.act(HOLD).unwrap().unwrap();
    for _ in 0..30 {
        let other = Report { origin: NodeId::UNIT_B, ..bench.next(Mode::Ready) };
        bench.heard_as(&sign(NodeId::UNIT_B, &other), B, Some(Span::ms(20)), bench.now);
        bench.pass(PERIOD);
    }
    let cause = Alarm::Silent(A);
    assert_eq!((causes(&bench), raised(&bench)), (vec![cause], 1));
    let known = group(&bench, cause);
    assert_eq!(known.priority, Priority::High);
    let consequences = [LedTo::LinkDown(PeerId::UNIT_A), LedTo::NotAcknowledged(command), LedTo::TracksLost(A, 1)];
    assert_eq!(led_to(&known), consequences, "in their order");
    assert!(events(&bench).contains(&Incident::Link(PeerId::UNIT_A, false)));
    // Heard again, the order that was not answered still asks for an act.
    both(&mut bench, Span::s(1));
    assert!(!group(&bench, cause).standing);
    assert!(group(&bench, Alarm::NotAcknowledged(command)).standing);
    assert_eq!(group(&bench, cause).words(), "unit-a was not heard");
}

#[test]
fn stale_picture_and_closed_session_are_events() {
    let mut bench = Bench::with_units(&UNITS, Policy::default(), Role::Supervise);
    both(&mut bench, Span::s(1));
    bench.feed(&Feed::Session(PeerId::UNIT_A, false));
    bench.pass(Span::s(1));
    both(&mut bench, Span::s(1));
    assert_eq!((causes(&bench), raised(&bench)), (vec![], 0));
    for event in [Incident::Link(PeerId::UNIT_A, false), Incident::Stale(A, true), Incident::Stale(A, false)] {
        assert!(events(&bench).contains(&event), "{event:?}");
    }
}

/// Not one a unit; a unit that stays silent after it is one of its own.
#[test]
fn silent_gateway_is_one_group() {
    let mut bench = Bench::with_units(&UNITS, Policy::default(), Role::Supervise);
    both(&mut bench, Span::s(1));
    bench.pass(Span::s(4));
    assert_eq!((causes(&bench), raised(&bench)), (vec![Alarm::GatewaySilent], 1));
    let known = group(&bench, Alarm::GatewaySilent);
    assert!([A, B].iter().all(|unit| led_to(&known).contains(&LedTo::Silent(*unit))), "{known:?}");
    bench.reports(Mode::Ready, Span::s(1));
    let standing: Vec<Alarm> = groups(&bench).iter().filter(|group| group.standing).map(|group| group.cause).collect();
    assert_eq!(standing, [Alarm::Silent(B)]);
}

#[test]
fn passed_object_is_an_event() {
    let mut bench = Bench::seating(Role::Supervise);
    let drives = |bench: &mut Bench| Report { speed_mm_s: 3_000, ..bench.next(Mode::Ready) };
    let report = drives(&mut bench);
    hear(&mut bench, &with_tracks(report, &[(5, -500, 2_000), (6, 9_000, 0)]));
    let report = drives(&mut bench);
    hear(&mut bench, &with_tracks(report, &[]));
    assert_eq!((causes(&bench), raised(&bench)), (vec![], 0));
    assert_eq!(shown(&bench).units[0].lost.len(), 2, "both keep their last place");
    let ended = |id| Incident::TrackEnded(A, TrackId(id), Class::Decoy);
    assert!(events(&bench).contains(&ended(5)) && events(&bench).contains(&ended(6)));
}

#[test]
fn object_that_ends_in_the_way_is_an_alarm_until_noted_or_back() {
    let mut bench = Bench::seating(Role::Supervise);
    let drives = |bench: &mut Bench| Report { speed_mm_s: 3_000, ..bench.next(Mode::Ready) };
    let cause = Alarm::TrackLost(A, Boot(1), TrackId(5));
    let report = drives(&mut bench);
    hear(&mut bench, &with_tracks(report, &[(5, 4_000, 500)]));
    let report = drives(&mut bench);
    hear(&mut bench, &with_tracks(report, &[]));
    assert_eq!(causes(&bench), [cause]);
    assert_eq!(group(&bench, cause).priority, Priority::Medium);
    assert!(shown(&bench).asks_about(A, &shown(&bench).units[0].lost[0]));
    acknowledge(&mut bench, cause);
    assert_eq!((causes(&bench), shown(&bench).units[0].lost.len()), (vec![], 0));
}

#[test]
fn object_in_the_way_under_another_number_is_an_event() {
    let mut bench = Bench::seating(Role::Supervise);
    for seen in [[(5, 3_000, 0)], [(6, 3_900, 0)]] {
        let report = Report { speed_mm_s: 3_000, ..bench.next(Mode::Ready) };
        hear(&mut bench, &with_tracks(report, &seen));
    }
    assert_eq!(causes(&bench), []);
}

#[test]
fn designated_track_that_ends_is_an_alarm() {
    let mut bench = Bench::seating(Role::Supervise);
    let held = ReportedAuthority { track: TrackId(4), left: Span::s(3) };
    let armed = Report { authority: Some(held), ..bench.next(Mode::PrepareToAct) };
    hear(&mut bench, &armed);
    // It ends a second after its authority did.
    bench.reports(Mode::Ready, Span::s(1));
    let report = bench.next(Mode::Ready);
    hear(&mut bench, &with_tracks(report, &[]));
    assert_eq!(causes(&bench), [Alarm::TrackLost(A, Boot(1), TrackId(4))]);
}

#[test]
fn track_that_an_order_chose_is_an_alarm() {
    let mut bench = Bench::seating(Role::Supervise);
    bench.reports(Mode::Ready, Span::s(1));
    bench.order(CommandKind::Arm(TrackId(4))).unwrap();
    let report = bench.next(Mode::Ready);
    hear(&mut bench, &with_tracks(report, &[]));
    assert!(causes(&bench).contains(&Alarm::TrackLost(A, Boot(1), TrackId(4))), "{:?}", causes(&bench));
}

/// The one in the way is a consequence as well, and the guard that fails after them names the sensor.
#[test]
fn three_tracks_that_end_within_a_second_are_one_group() {
    let mut bench = Bench::seating(Role::Supervise);
    let mut left = vec![(5, 2_000, 0), (6, 30_000, 0), (7, 0, 30_000)];
    while !left.is_empty() {
        let report = bench.next(Mode::Ready);
        hear(&mut bench, &with_tracks(report, &left));
        left.remove(0);
        bench.pass(Span::ms(300));
    }
    let report = bench.next(Mode::Ready);
    hear(&mut bench, &with_tracks(report, &[]));
    let together = Alarm::TracksLost(A);
    assert_eq!((causes(&bench), raised(&bench)), (vec![together], 1));
    assert_eq!(led_to(&group(&bench, together)).len(), 3);
    let report = failing(&mut bench, Mode::Degraded, Guard::Lidar);
    hear(&mut bench, &with_tracks(report, &[]));
    let sensor = Alarm::GuardLost(A, Guard::Lidar);
    assert_eq!((causes(&bench), raised(&bench)), (vec![sensor], 1));
    assert_eq!(led_to(&group(&bench, sensor)).len(), 4, "the mode, and the tracks");
    acknowledge(&mut bench, sensor);
    assert_eq!(shown(&bench).units[0].lost.len(), 0);
}

#[test]
fn three_tracks_that_end_over_minutes_are_events() {
    let mut bench = Bench::seating(Role::Supervise);
    for left in
        [&[(5, 0, 9_000), (6, 0, 9_000), (7, 0, 9_000)][..], &[(6, 0, 9_000), (7, 0, 9_000)], &[(7, 0, 9_000)], &[]]
    {
        for _ in 0..12 {
            let report = bench.next(Mode::Ready);
            hear(&mut bench, &with_tracks(report, left));
        }
    }
    assert_eq!(causes(&bench), []);
}

/// At the plan's second, not before; and not by the same name as a silence in a contact.
#[test]
fn planned_silence_raises_none_and_due_contact_does_after_a_second() {
    let mut bench = Bench::seating(Role::Supervise);
    let contact = Some(ReportedContact { left: Span::ms(500), next: Some(Span::s(40)) });
    let report = Report { contact, ..bench.next(Mode::Ready) };
    bench.heard(&report, Span::ms(20));
    let heard = bench.now;
    // The report was 20 ms old, so the contact is due that much earlier.
    let due = heard + Span::ms(41_000 - 20);
    bench.pass(Span(due.since(bench.now).0 - 1_000));
    assert_eq!((causes(&bench), raised(&bench)), (vec![], 0));
    assert!(events(&bench).iter().all(|event| !matches!(event, Incident::Stale(..))));
    bench.pass(Span::ms(2));
    assert_eq!(causes(&bench), [Alarm::ContactDue(A)]);
    let known = group(&bench, Alarm::ContactDue(A));
    assert_eq!((known.priority, known.first), (Priority::High, due + Span(1)));
    let report = bench.next(Mode::Ready);
    hear(&mut bench, &report);
    assert!(!group(&bench, Alarm::ContactDue(A)).standing);
}

#[test]
fn silence_within_a_contact_is_an_alarm_beyond_its_end() {
    let mut bench = Bench::seating(Role::Supervise);
    let contact = Some(ReportedContact { left: Span::s(5), next: Some(Span::s(600)) });
    let report = Report { contact, ..bench.next(Mode::Ready) };
    bench.heard(&report, Span::ms(20));
    bench.pass(Span::s(3));
    assert_eq!(causes(&bench), [Alarm::Silent(A)]);
    bench.pass(Span::s(10));
    assert!(group(&bench, Alarm::Silent(A)).standing, "that the contact has ended since is no news of the unit");
}

#[test]
fn revoked_units_silence_raises_none() {
    let mut bench = Bench::revoking(Vec::new(), vec![(NodeId::UNIT_B, Vec::new())]);
    both(&mut bench, Span::s(1));
    let strike = Order::Revoke(NodeId::UNIT_B);
    bench.act(Act::Prepare(strike)).unwrap();
    bench.act(Act::Confirm(strike, Text::new("stolen"))).unwrap();
    bench.feed(&Feed::Session(PeerId::UNIT_B, false));
    bench.reports(Mode::Ready, Span::s(5));
    assert_eq!((causes(&bench), raised(&bench)), (vec![], 0));
}

/// The last lease runs out with the link: no second alarm.
#[test]
fn hold_safe_after_a_silence_is_its_consequence() {
    let mut bench = Bench::with_units(&UNITS, Policy::default(), Role::Supervise);
    both(&mut bench, Span::s(1));
    for _ in 0..30 {
        let other = Report { origin: NodeId::UNIT_B, ..bench.next(Mode::Ready) };
        bench.heard_as(&sign(NodeId::UNIT_B, &other), B, Some(Span::ms(20)), bench.now);
        bench.pass(PERIOD);
    }
    acknowledge(&mut bench, Alarm::Silent(A));
    let report = failing(&mut bench, Mode::HoldSafe, Guard::Lease);
    bench.heard(&report, Span::ms(20));
    assert_eq!((causes(&bench), raised(&bench)), (vec![Alarm::Silent(A)], 1));
    let known = group(&bench, Alarm::Silent(A));
    assert!(known.standing && !known.acknowledged && known.hold_stands);
    assert!(led_to(&known).contains(&LedTo::Mode(A, Mode::HoldSafe)));
}

#[test]
fn picture_for_programs_has_groups_sound_and_rate() {
    let mut bench = Bench::seating(Role::Supervise);
    bench.reports(Mode::Ready, Span::s(1));
    let report = contradicted(&mut bench, Inconsistency::TimeBase);
    hear(&mut bench, &report);
    bench.reports(Mode::HoldSafe, PERIOD);
    let picture = bench.pictures.last().unwrap();
    let alarm = &picture["alarms"][0];
    assert_eq!((alarm["says"].as_str(), alarm["priority"].as_str()), (Some("unit-c contradicts itself"), Some("HIGH")));
    assert_eq!(alarm["led_to"][1]["says"], "unit-a HOLD_SAFE");
    assert_eq!((&picture["alarms_in_hour"], &picture["sound"]["motif"]), (&1.into(), &"HIGH".into()));
}
