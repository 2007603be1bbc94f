//! Acts of a person: requests to the gateway, and refusals, by name.

use config::suite::Suite;
use console::act::{Act, Alarm, MAX_ANSWERS, Order, PREPARED_FOR, Role, Shelf, Unable};
use console::alarm::Priority;
use console::history::{Incident, MAX_PAST};
use console::life::Life;
use wire::bounds::Bounds;
use wire::codec::Text;
use wire::command::{Ack, CommandKind};
use wire::core::Input;
use wire::event::Event;
use wire::feed::{CommandStage, Feed};
use wire::id::{Boot, NodeId, PeerId, TrackId, UnitId};
use wire::measured::Measured;
use wire::mode::{Cause, Guard, Guards, Mode};
use wire::report::{Report, ReportedAuthority, ReportedTrack};
use wire::sensor::{Modalities, Modality};
use wire::time::Span;

use crate::bench::{Asked, Bench};

const HOLD: Act = Act::Now(Order::Command(UnitId::A, CommandKind::Hold));
const RESUME: Order = Order::Command(UnitId::A, CommandKind::Resume);

fn confirm(order: Order) -> Act {
    Act::Confirm(order, Text::new("cause understood"))
}

/// Even before the unit was ever heard.
#[test]
fn hold_is_one_act_sent_at_once() {
    let mut bench = Bench::seating(Role::Operate);
    let command = bench.act(HOLD).unwrap().expect("a command");
    let (intent, _) = bench.intents()[0].clone();
    assert_eq!((intent.id, intent.kind, intent.unit), (command, CommandKind::Hold, UnitId::A));
}

/// Neither the same number nor the same order under way is repeated.
#[test]
fn order_is_carried_out_once() {
    let mut bench = Bench::seating(Role::Operate);
    assert!(bench.numbered(7, HOLD).is_ok());
    assert_eq!(bench.numbered(7, HOLD), Err(Unable::Repeated));
    assert_eq!(bench.numbered(3, HOLD), Err(Unable::Repeated));
    assert_eq!(bench.numbered(8, HOLD), Err(Unable::Pending));
    assert_eq!(bench.intents().len(), 1);
    bench.pass(Span::s(1));
    assert_eq!(bench.console.shown(bench.now).commands[0].life, Life::NotAcknowledged);
    assert!(bench.numbered(9, HOLD).is_ok(), "once it is known to be unanswered it may be given again");
}

#[test]
fn leaving_safe_takes_two_acts_and_a_reason() {
    let mut bench = Bench::seating(Role::Supervise);
    bench.reports(Mode::HoldSafe, Span::ms(100));
    assert_eq!(bench.act(Act::Now(RESUME)), Err(Unable::TwoSteps));
    assert_eq!(bench.act(confirm(RESUME)), Err(Unable::NotPrepared));
    assert_eq!(bench.act(Act::Prepare(RESUME)), Ok(None));
    assert_eq!(bench.act(Act::Confirm(RESUME, Text::new(" "))), Err(Unable::NoReason));
    let other = Order::Command(UnitId::B, CommandKind::Resume);
    assert_eq!(bench.act(confirm(other)), Err(Unable::NotPrepared));
    assert_eq!(bench.intents().len(), 0);
    let command = bench.act(confirm(RESUME)).unwrap().expect("a command");
    let (intent, bytes) = bench.intents()[0].clone();
    assert_eq!((intent.id, intent.reason.as_str()), (command, "cause understood"));
    assert_eq!(bench.act(confirm(RESUME)), Err(Unable::NotPrepared), "a confirmation counts once");
    assert!(bench.asked.iter().all(|requested| !matches!(requested, Asked::Release(_))), "not before it is staged");
    bench.staged(&bytes, CommandStage::Staged);
    bench.staged(&bytes, CommandStage::Staged);
    let released = bench.asked.iter().filter(|requested| matches!(requested, Asked::Release(_))).count();
    assert_eq!(released, 1);
}

#[test]
fn prepared_order_lapses_with_time_or_interlock() {
    let mut bench = Bench::seating(Role::Supervise);
    bench.reports(Mode::HoldSafe, Span::ms(100));
    bench.act(Act::Prepare(RESUME)).unwrap();
    let until = bench.console.shown(bench.now).prepared.expect("prepared").until;
    assert_eq!(until, bench.now + PREPARED_FOR);
    bench.reports(Mode::HoldSafe, PREPARED_FOR);
    assert_eq!(bench.console.shown(bench.now).prepared, None);
    assert_eq!(bench.act(confirm(RESUME)), Err(Unable::NotPrepared));
    bench.act(Act::Prepare(RESUME)).unwrap();
    bench.pass(Span::ms(400));
    assert_eq!(bench.console.shown(bench.now).prepared, None, "the picture is stale");
    let refusals: Vec<Unable> = bench
        .events
        .iter()
        .filter_map(|(_, event)| if let Event::Lapsed { why, .. } = event { Some(*why) } else { None })
        .collect();
    assert_eq!(refusals, [Unable::Lapsed, Unable::Interlock]);
    assert_eq!(bench.intents().len(), 0);
}

#[test]
fn withdrawn_order_is_not_released() {
    let mut bench = Bench::seating(Role::Supervise);
    assert_eq!(bench.act(Act::Withdraw), Err(Unable::NotPrepared));
    bench.reports(Mode::HoldSafe, Span::ms(100));
    bench.order(CommandKind::Resume).unwrap();
    let (_, bytes) = bench.intents()[0].clone();
    assert_eq!(bench.act(Act::Withdraw), Ok(None));
    bench.staged(&bytes, CommandStage::Staged);
    bench.pass(Span::s(2));
    assert_eq!(bench.asked.len(), 1, "asked for, and never released");
}

#[test]
fn step_towards_safe_drops_the_opposite_order() {
    let mut bench = Bench::seating(Role::Supervise);
    bench.reports(Mode::HoldSafe, Span::ms(100));
    assert_eq!(bench.act(Act::Prepare(Order::Command(UnitId::A, CommandKind::Hold))), Err(Unable::OneStep));
    bench.order(CommandKind::Resume).unwrap();
    let (_, resume) = bench.intents()[0].clone();
    bench.act(HOLD).unwrap();
    bench.staged(&resume, CommandStage::Staged);
    assert!(bench.asked.iter().all(|requested| !matches!(requested, Asked::Release(_))));
}

#[test]
fn failing_guard_within_its_limit_names_its_wait() {
    let mut bench = Bench::seating(Role::Supervise);
    for (guard, value, words) in [
        (Guard::Localisation, 84, "84 of 300 ms, but against its odometry"),
        (Guard::Drift, 12, "60 % of its limit, until it is 0"),
        (Guard::TimeBase, 3_000, "3.0 of 5 ms, until it is 2.5"),
    ] {
        let failing = Guards::default().with_guard(guard);
        let measured = Measured::default().with_value(guard, Some(value));
        let lost = Report { failing, measured, ..bench.next(Mode::Degraded) };
        bench.heard(&lost, Span::ms(20));
        let text = console::text::lines(&bench.console.shown(bench.now));
        let name = console::wording::guard(Suite::Scene, guard);
        assert!(text.contains(&format!("failing {name} ({words})")), "{text}");
        bench.pass(Span::ms(100));
    }
}

#[test]
fn each_interlock_blocks_with_value_and_limit() {
    let track = TrackId(4);
    let mut bench = Bench::seating(Role::Supervise);
    let arm = Order::Command(UnitId::A, CommandKind::Arm(track));
    let failing = |bench: &Bench, order: &Order| -> Vec<&'static str> {
        let all = bench.console.shown(bench.now).interlocks(order);
        all.into_iter().filter(|predicate| !predicate.holds).map(|predicate| predicate.name).collect()
    };
    assert_eq!(failing(&bench, &arm), ["unit heard"]);
    bench.reports(Mode::Ready, Span::ms(100));
    assert_eq!(failing(&bench, &arm), [""; 0]);
    assert_eq!(failing(&bench, &RESUME), ["mode"]);
    let lost = Report { failing: Guards::default().with_guard(Guard::Thermal), ..bench.next(Mode::Ready) };
    bench.heard(&lost, Span::ms(20));
    assert_eq!(failing(&bench, &arm), ["guards failing"]);
    assert_eq!(bench.order(CommandKind::Arm(track)), Err(Unable::Interlock));
    bench.pass(Span::ms(100));
    bench.reports(Mode::Ready, Span::ms(100));
    assert_eq!(failing(&bench, &Order::Command(UnitId::A, CommandKind::Arm(TrackId(9)))), ["track fresh"]);
    let ready = bench.next(Mode::Ready);
    let supported = Modalities::default().with_modality(Modality::Rgb).with_modality(Modality::Lidar);
    let contradicted = Modalities::default().with_modality(Modality::Thermal);
    let doubt = |track: &ReportedTrack| ReportedTrack { supported, contradicted, ..*track };
    let tracks = ready.tracks.iter().map(doubt).collect();
    bench.heard(&Report { tracks, ..ready }, Span::ms(20));
    assert_eq!(failing(&bench, &arm), ["supported by", "contradicted by"]);
    assert!(console::text::lines(&bench.console.shown(bench.now)).contains("by rgb, lidar, CONTRADICTED by thermal"));
    bench.pass(Span::ms(100));
    bench.reports(Mode::Ready, Span::ms(100));
    bench.pass(Span::ms(400));
    assert_eq!(failing(&bench, &arm), ["state fresh", "track fresh"]);
    let stale = bench.console.shown(bench.now).interlocks(&arm);
    let stale = stale.iter().find(|predicate| predicate.name == "state fresh").unwrap();
    assert_eq!((stale.value.as_str(), stale.limit.as_str()), ("520 ms", "300 ms"));
    let holding = ReportedAuthority { track, left: Span::s(3) };
    let armed = Report { authority: Some(holding), ..bench.next(Mode::PrepareToAct) };
    bench.heard(&armed, Span::ms(20));
    assert_eq!(failing(&bench, &Order::Command(UnitId::A, CommandKind::Confirm(track))), [""; 0]);
    assert_eq!(failing(&bench, &Order::Command(UnitId::A, CommandKind::Confirm(TrackId(5)))), ["authority"]);
    assert_eq!(failing(&bench, &Order::Revoke(NodeId::OPERATOR_2)), [""; 0]);
    assert_eq!(failing(&bench, &Order::Revoke(NodeId::GATEWAY)), ["revocation"]);
}

#[test]
fn revocation_takes_two_acts_and_one_request() {
    let mut bench = Bench::seating(Role::Supervise);
    let strike = Order::Revoke(NodeId::OPERATOR_2);
    assert_eq!(bench.act(Act::Now(strike)), Err(Unable::TwoSteps));
    bench.act(Act::Prepare(strike)).unwrap();
    bench.act(confirm(strike)).unwrap();
    assert_eq!(bench.asked, [Asked::Revoke(Bench::revocations()[0].1.clone())]);
    assert_eq!(bench.act(Act::Prepare(strike)), Err(Unable::Pending));
}

#[test]
fn role_permits_its_own_acts_only() {
    let all = [
        (CommandKind::Hold, Role::Operate),
        (CommandKind::Disarm, Role::Operate),
        (CommandKind::Resume, Role::Operate),
        (CommandKind::Enable, Role::Operate),
        (CommandKind::Arm(TrackId(4)), Role::Supervise),
        (CommandKind::Confirm(TrackId(4)), Role::Supervise),
    ];
    for role in [Role::View, Role::Operate, Role::Supervise] {
        for (kind, needed) in all {
            let mut bench = Bench::seating(role);
            bench.reports(Mode::Ready, Span::ms(100));
            let order = Order::Command(UnitId::A, kind);
            let outcome = bench.act(if kind.towards_safe() { Act::Now(order) } else { Act::Prepare(order) });
            assert_eq!(outcome == Err(Unable::Role), role < needed, "{role:?} {kind:?}: {outcome:?}");
        }
    }
}

#[test]
fn viewer_neither_signs_nor_acknowledges() {
    let mut bench = Bench::seating(Role::View);
    bench.reports(Mode::HoldSafe, Span::ms(100));
    let alarm = bench.console.shown(bench.now).alarms[0].clone();
    let shelve = Act::Shelve(alarm.cause, alarm.since, Shelf::Minute, Text::new("known"));
    let noted = [Act::Acknowledge(alarm.cause, alarm.since), shelve, Act::Silence];
    for act in [HOLD, Act::Prepare(RESUME), confirm(RESUME), Act::Withdraw].into_iter().chain(noted) {
        assert_eq!(bench.act(act), Err(Unable::Role));
    }
    bench.pass(Span::s(3));
    assert_eq!(bench.asked, []);
    assert!(!bench.console.shown(bench.now).alarms[0].acknowledged);
}

/// The log entry of an act has the person, the act and its result.
#[test]
fn every_act_is_answered_and_logged() {
    let mut bench = Bench::seating(Role::Supervise);
    bench.reports(Mode::HoldSafe, Span::ms(100));
    let command = bench.order(CommandKind::Resume).unwrap();
    bench.act(Act::Withdraw).unwrap();
    bench.give(&Input::Act { bytes: vec![0xff; 300] });
    let events: Vec<Event> =
        bench.events.iter().map(|(_, event)| *event).filter(|event| matches!(event, Event::Act { .. })).collect();
    let by = NodeId::OPERATOR;
    let act = |serial, act, command| Event::Act { by, serial, act: Some(act), command, refused: None };
    assert_eq!(
        events,
        [
            act(1, Act::Prepare(RESUME), None),
            act(2, Act::Confirm(RESUME, Text::new("as planned")), command),
            act(3, Act::Withdraw, None),
            Event::Act { by, serial: 0, act: None, command: None, refused: Some(Unable::Malformed) },
        ]
    );
    for _ in 0..40 {
        let _ = bench.act(Act::Withdraw);
    }
    assert_eq!(bench.console.shown(bench.now).answers.len(), MAX_ANSWERS);
    bench.give(&Input::Quiesce);
    assert_eq!(bench.act(HOLD), Err(Unable::Over));
}

#[test]
fn command_shows_the_time_of_each_stage() {
    let mut bench = Bench::seating(Role::Operate);
    bench.reports(Mode::Ready, Span::ms(100));
    let command = bench.act(HOLD).unwrap().unwrap();
    let (intent, bytes) = bench.intents()[0].clone();
    let requested = bench.now;
    bench.pass(Span::ms(10));
    bench.staged(&bytes, CommandStage::Sent);
    bench.pass(Span::ms(20));
    let (_, hash) = (intent.id, sha2::Digest::finalize(<sha2::Sha256 as sha2::Digest>::new_with_prefix(&bytes)).into());
    bench.acknowledged(
        NodeId::UNIT_A,
        &Ack { id: command, intent: hash, refused: None, mode: Mode::HoldSafe, due: None },
    );
    let already = bench.next(Mode::HoldSafe);
    bench.heard(&already, Span::ms(20));
    let times = |bench: &Bench| bench.console.shown(bench.now).commands[0].times;
    assert_eq!(
        times(&bench).effect,
        None,
        "a report that does not say that it heard the command shows no effect of it"
    );
    bench.pass(Span::ms(70));
    let held = Report { last_command: Some((command, None)), ..bench.next(Mode::HoldSafe) };
    bench.heard(&held, Span::ms(20));
    let times = times(&bench);
    assert_eq!(times.requested, requested);
    assert_eq!(times.sent, Some(requested + Span::ms(10)));
    assert_eq!(times.answered, Some(requested + Span::ms(30)));
    assert_eq!(times.effect, Some(requested + Span::ms(100)));
}

/// At its last place.
#[test]
fn dropped_track_stays_until_noted_or_back() {
    let mut bench = Bench::seating(Role::Operate);
    bench.reports(Mode::Ready, Span::ms(100));
    let ablated_report = Report { tracks: wire::codec::List::default(), ..bench.next(Mode::Ready) };
    bench.heard(&ablated_report, Span::ms(20));
    let lost = |bench: &Bench| bench.console.shown(bench.now).units[0].lost.clone();
    let (track, freshness) = {
        let lost = lost(&bench);
        let (t, f) = lost[0].track.get();
        (*t, f)
    };
    assert_eq!((track.id, track.x_mm, freshness), (TrackId(4), 10_000, wire::event::Freshness::Lost));
    let text = console::text::lines(&bench.console.shown(bench.now));
    assert!(text.contains("track 4   vehicle"), "{text}");
    bench.reports(Mode::Ready, Span::ms(100));
    bench.reports(Mode::Ready, Span::ms(100));
    assert_eq!(lost(&bench), [], "it is reported again");
    let repeated = Report { tracks: wire::codec::List::default(), ..bench.next(Mode::Ready) };
    bench.heard(&repeated, Span::ms(20));
    let alarm = Alarm::TrackLost(UnitId::A, Boot(1), TrackId(4));
    let since = lost(&bench)[0].since;
    assert_eq!(bench.act(Act::Acknowledge(alarm, since + Span(1))), Err(Unable::NoAlarm), "another occurrence");
    assert_eq!(bench.act(Act::Acknowledge(alarm, since)), Ok(None));
    assert_eq!(lost(&bench), []);
}

#[test]
fn history_keeps_order_and_drops_the_oldest() {
    let mut bench = Bench::seating(Role::Operate);
    bench.reports(Mode::Ready, Span::ms(100));
    bench.reports(Mode::Degraded, Span::ms(100));
    let degraded = Alarm::Degraded(UnitId::A);
    let raised = bench.console.shown(bench.now).alarms.into_iter().find(|group| group.cause == degraded).unwrap();
    bench.act(Act::Acknowledge(degraded, raised.since)).unwrap();
    bench.reports(Mode::Ready, Span::ms(100));
    let mode = |mode| Incident::Mode(UnitId::A, mode, Cause::Start, Suite::Scene);
    let incidents = [
        mode(Mode::Degraded),
        Incident::Raised(degraded, Suite::Scene, Priority::Medium),
        Incident::Acknowledged(degraded, Suite::Scene),
        mode(Mode::Ready),
        Incident::Over(degraded, Suite::Scene),
    ];
    let past = bench.console.shown(bench.now).past;
    let about: Vec<Incident> =
        past.iter().map(|past| past.what).filter(|incident| incidents.contains(incident)).collect();
    assert_eq!(about, incidents);
    let lost = Incident::Mode(UnitId::A, Mode::HoldSafe, Cause::Lost(Guard::Teammates), Suite::Scene);
    assert_eq!(lost.words(&Bounds::GROUND), "unit-a went to HOLD_SAFE: A teammate contradicts itself", "as the banner");
    assert!(past.iter().is_sorted_by_key(|past| past.at));
    for n in 0..2 * MAX_PAST {
        bench.feed(&Feed::Session(PeerId::UNIT_A, n % 2 == 0));
        bench.pass(Span::ms(1));
    }
    let shown = bench.console.shown(bench.now);
    assert_eq!(shown.past.len(), MAX_PAST);
    let about: Vec<Incident> =
        shown.past.iter().map(|past| past.what).filter(|incident| incidents.contains(incident)).collect();
    assert_eq!(about, incidents, "what happened to the unit is not washed out by what happens to others");
    assert!(shown.past.iter().is_sorted_by_key(|past| past.at) && shown.past_more > 0);
    for n in 0..2 * MAX_PAST {
        bench.reports([Mode::Ready, Mode::Degraded][n % 2], Span::ms(100));
    }
    let shown = bench.console.shown(bench.now);
    assert_eq!(shown.past.len(), MAX_PAST);
    assert!(shown.past.iter().all(|past| past.what != incidents[2]), "of itself the oldest goes");
    let links = shown.past.iter().filter(|past| matches!(past.what, Incident::Link(..))).count();
    assert!(links > MAX_PAST / 8, "{links}");
}

/// The alarm comes back when the event happens again.
#[test]
fn alarm_on_a_past_event_ends_when_noted() {
    let mut bench = Bench::seating(Role::Operate);
    let listed = |bench: &Bench, wanted: Alarm| {
        bench.console.shown(bench.now).alarms.into_iter().find(|group| group.cause == wanted)
    };
    let command = bench.act(HOLD).unwrap().expect("a command");
    bench.pass(Span::s(1));
    bench.feed(&Feed::SessionsLost(1));
    for alarm in [Alarm::NotAcknowledged(command), Alarm::SessionLost(PeerId::GATEWAY)] {
        let raised = listed(&bench, alarm).expect("raised");
        bench.act(Act::Acknowledge(alarm, raised.since)).unwrap();
        bench.pass(Span::s(1));
        assert_eq!(listed(&bench, alarm), None);
    }
    bench.feed(&Feed::SessionsLost(2));
    assert!(listed(&bench, Alarm::SessionLost(PeerId::GATEWAY)).is_some_and(|shown| !shown.acknowledged));
    let repeated = bench.act(HOLD).unwrap().expect("a command");
    bench.pass(Span::s(1));
    assert!(
        listed(&bench, Alarm::NotAcknowledged(repeated)).is_some()
            && listed(&bench, Alarm::NotAcknowledged(command)).is_none()
    );
}

#[test]
fn session_state_ages_from_the_gateways_last_message() {
    let mut bench = Bench::seating(Role::View);
    bench.feed(&Feed::Session(PeerId::UNIT_A, true));
    bench.pass(Span::s(3));
    let link = bench.console.shown(bench.now).links[0];
    assert_eq!((*link.open.get().0, link.open.age()), (true, Span::s(3)));
    assert_eq!(link.open.freshness(), wire::event::Freshness::Lost);
}
