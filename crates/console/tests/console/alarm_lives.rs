//! Lives of alarms: over, back, put aside, heard, silenced, and folded away in a flood.

use console::act::{Act, Alarm, Role, Shelf, Unable};
use console::alarm::Priority;
use console::alarms::{CLEARS_AFTER, RETURNS_WITHIN};
use console::sound::{FLOOD, SILENCED_FOR};
use wire::codec::Text;
use wire::id::UnitId;
use wire::mode::{Guard, Mode};
use wire::time::Span;

use crate::alarms::{HOLD, PERIOD, acknowledge, causes, failing, group, hear, raised, shown};
use crate::bench::Bench;

const A: UnitId = UnitId::A;
const B: UnitId = UnitId::B;

fn shelve(bench: &mut Bench, cause: Alarm, shelf: Shelf) -> Result<(), Unable> {
    let since = group(bench, cause).since;
    bench.act(Act::Shelve(cause, since, shelf, Text::new("known, and looked at"))).map(drop)
}

/// Three times, one alarm; after a minute it is another one.
#[test]
fn chatter_opens_its_group_again() {
    let mut bench = Bench::seating(Role::Supervise);
    bench.reports(Mode::Ready, Span::s(1));
    let cause = Alarm::GuardLost(A, Guard::Thermal);
    for _ in 0..3 {
        let report = failing(&mut bench, Mode::Degraded, Guard::Thermal);
        hear(&mut bench, &report);
        acknowledge(&mut bench, cause);
        bench.reports(Mode::Ready, Span::s(5));
        assert_eq!(causes(&bench), [], "over and acknowledged");
    }
    let report = failing(&mut bench, Mode::Degraded, Guard::Thermal);
    hear(&mut bench, &report);
    let known = group(&bench, cause);
    assert_eq!((known.times, known.acknowledged, raised(&bench)), (4, false, 1));
    assert!(known.first < known.since);
    acknowledge(&mut bench, cause);
    bench.reports(Mode::Ready, RETURNS_WITHIN + Span::s(1));
    let report = failing(&mut bench, Mode::Degraded, Guard::Thermal);
    hear(&mut bench, &report);
    assert_eq!((group(&bench, cause).times, raised(&bench)), (1, 2));
}

#[test]
fn medium_alarm_that_is_over_clears_itself_and_a_high_one_does_not() {
    let mut bench = Bench::seating(Role::Supervise);
    bench.reports(Mode::Ready, Span::s(1));
    let report = failing(&mut bench, Mode::Degraded, Guard::Thermal);
    hear(&mut bench, &report);
    bench.reports(Mode::Ready, Span::ms(100));
    let medium = Alarm::GuardLost(A, Guard::Thermal);
    assert_eq!((group(&bench, medium).standing, group(&bench, medium).acknowledged), (false, false));
    bench.reports(Mode::Ready, Span(CLEARS_AFTER.0 - 500_000));
    assert_eq!(causes(&bench), [medium]);
    bench.reports(Mode::Ready, Span::s(1));
    assert_eq!(causes(&bench), []);
    let report = failing(&mut bench, Mode::HoldSafe, Guard::Lidar);
    hear(&mut bench, &report);
    bench.reports(Mode::Ready, CLEARS_AFTER + CLEARS_AFTER);
    let high = group(&bench, Alarm::GuardLost(A, Guard::Lidar));
    assert!(!high.standing && !high.acknowledged);
    assert_eq!(high.words(), "LiDAR of unit-a gave nothing");
}

#[test]
fn shelved_alarm_is_counted_and_returns_by_itself() {
    let mut bench = Bench::seating(Role::Supervise);
    bench.reports(Mode::Ready, Span::s(1));
    let report = failing(&mut bench, Mode::Degraded, Guard::Thermal);
    hear(&mut bench, &report);
    let cause = Alarm::GuardLost(A, Guard::Thermal);
    let since = group(&bench, cause).since;
    let unsaid = Act::Shelve(cause, since, Shelf::Minute, Text::new(" "));
    assert_eq!(bench.act(unsaid), Err(Unable::NoReason));
    assert_eq!(bench.act(Act::Shelve(Alarm::Silent(B), since, Shelf::Minute, Text::new("x"))), Err(Unable::NoAlarm));
    let at = bench.now;
    shelve(&mut bench, cause, Shelf::Minute).unwrap();
    let known = group(&bench, cause);
    assert_eq!((known.shelved_until, known.open()), (Some(at + Span::s(60)), false));
    assert_eq!(shown(&bench).sound.motif, None);
    let text = console::text::lines(&shown(&bench));
    assert!(text.contains(", 1 shelved"), "{text}");
    bench.reports(Mode::Degraded, Span::s(59));
    assert!(group(&bench, cause).shelved_until.is_some());
    let report = failing(&mut bench, Mode::Degraded, Guard::Thermal);
    hear(&mut bench, &report);
    bench.reports(Mode::Degraded, Span::s(2));
    let back = group(&bench, cause);
    assert_eq!((back.shelved_until, back.open(), back.times), (None, true, 1));
    assert_eq!(back.since, at + Span::s(60), "it asks for an act from then on");
    assert!(shown(&bench).sound.motif.is_some());
}

/// An alarm that was put aside before it grew to HOLD_SAFE is back at once.
#[test]
fn alarm_of_a_standing_hold_safe_cannot_be_shelved() {
    let mut bench = Bench::seating(Role::Supervise);
    bench.reports(Mode::Ready, Span::s(1));
    let cause = Alarm::GuardLost(A, Guard::Thermal);
    let report = failing(&mut bench, Mode::Degraded, Guard::Thermal);
    hear(&mut bench, &report);
    shelve(&mut bench, cause, Shelf::HalfHour).unwrap();
    let report = failing(&mut bench, Mode::HoldSafe, Guard::Thermal);
    hear(&mut bench, &report);
    assert!(group(&bench, cause).open());
    assert_eq!(shelve(&mut bench, cause, Shelf::Minute), Err(Unable::HoldStands));
    assert_eq!(group(&bench, cause).shelved_until, None);
}

#[test]
fn sound_repeats_until_acknowledged_and_silence_ends() {
    let mut bench = Bench::seating(Role::Supervise);
    bench.reports(Mode::Ready, Span::s(1));
    assert_eq!(bench.act(Act::Silence), Err(Unable::NoSound));
    let report = failing(&mut bench, Mode::HoldSafe, Guard::Thermal);
    hear(&mut bench, &report);
    let cause = Alarm::GuardLost(A, Guard::Thermal);
    let since = group(&bench, cause).since;
    assert_eq!(shown(&bench).sound.motif, Some((Priority::High, since)));
    let began = bench.now;
    bench.act(Act::Silence).unwrap();
    let sound = shown(&bench).sound;
    assert_eq!((sound.motif, sound.silenced_until), (None, Some(began + SILENCED_FOR)));
    // What is new sounds through, by its own priority.
    let refused = bench.act(HOLD).unwrap().unwrap();
    bench.reports(Mode::HoldSafe, Span::s(2));
    let new = Alarm::NotAcknowledged(refused);
    assert_eq!(shown(&bench).sound.motif, Some((Priority::High, group(&bench, new).since)));
    acknowledge(&mut bench, new);
    assert_eq!(shown(&bench).sound.motif, None);
    while bench.now < began + SILENCED_FOR {
        assert!(shown(&bench).sound.silenced_until.is_some());
        bench.reports(Mode::HoldSafe, PERIOD);
    }
    let sound = shown(&bench).sound;
    assert_eq!((sound.silenced_until, sound.motif.is_some()), (None, true));
    acknowledge(&mut bench, cause);
    assert_eq!(shown(&bench).sound.motif, None);
}

#[test]
fn alarm_that_grows_sounds_through_a_silence() {
    let mut bench = Bench::seating(Role::Supervise);
    bench.reports(Mode::Ready, Span::s(1));
    let report = failing(&mut bench, Mode::Degraded, Guard::Thermal);
    hear(&mut bench, &report);
    bench.act(Act::Silence).unwrap();
    assert_eq!(shown(&bench).sound.motif, None);
    bench.pass(PERIOD);
    let report = failing(&mut bench, Mode::HoldSafe, Guard::Thermal);
    bench.heard(&report, Span::ms(20));
    assert_eq!(shown(&bench).sound.motif, Some((Priority::High, bench.now)));
}

#[test]
fn flood_opens_only_what_is_urgent() {
    let mut bench = Bench::seating(Role::Supervise);
    bench.reports(Mode::Ready, Span::s(1));
    for guard in Guard::ALL.into_iter().filter(|guard| *guard != Guard::Designation).take(FLOOD) {
        assert!(!shown(&bench).alarm_flood);
        let report = failing(&mut bench, Mode::Degraded, guard);
        hear(&mut bench, &report);
        bench.reports(Mode::Ready, PERIOD);
    }
    let flood = shown(&bench);
    assert!(flood.alarm_flood && flood.sound.motif.is_none(), "{:?}", flood.sound);
    assert!(flood.alarms.iter().all(|group| !group.unfolded(true)));
    let text = console::text::lines(&flood);
    assert!(text.contains("10 less urgent") && text.contains("10 in this hour, limit 6"), "{text}");
    let report = failing(&mut bench, Mode::HoldSafe, Guard::Lidar);
    hear(&mut bench, &report);
    let urgent = group(&bench, Alarm::GuardLost(A, Guard::Lidar));
    assert!(urgent.unfolded(true) && shown(&bench).sound.motif.is_some());
    bench.reports(Mode::Ready, Span::s(601));
    assert!(!shown(&bench).alarm_flood);
}
