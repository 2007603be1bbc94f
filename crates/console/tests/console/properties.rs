//! Properties after every move in a world in which anything may happen to a console (`world`): no value is shown
//! fresher than it is or vanishes silently, a HOLD can always be given, and no order is carried out twice or unasked.

use std::collections::BTreeSet;

use console::act::{Act, Alarm, MAX_ANSWERS, Order, Role, Unable};
use console::age::Labelled;
use console::alarm::{LedTo, MAX_LED_TO, Priority, ShownGroup};
use console::alarms::MAX_ALARMS;
use console::history::Incident;
use console::life::{ACK_WITHIN, Life, MAX_COMMANDS};
use console::model::MAX_LOST;
use console::shown::{Shown, ShownUnit};
use console::sound::SILENCED_FOR;
use proptest::prelude::*;
use wire::codec;
use wire::command::{CommandKind, IntentHash};
use wire::core::{Core, Input, Output, Topic};
use wire::event::{Account, Event, Freshness, Interface};
use wire::id::{Boot, RecordId, TrackId, UnitId};
use wire::mode::Mode;
use wire::person::Numbered;
use wire::policy::Policy;
use wire::refusal::Reason;
use wire::time::Span;

use crate::bench::{Asked, Bench, console, retracing};
use crate::display::label;
use crate::world::{Does, Move, Step, Told, always, check_sequence, refused_by_both};

/// A test for each property, asked after every move.
macro_rules! after_every_move {
    ($($name:ident($step:ident) $body:block)*) => {$(
        #[test]
        fn $name() {
            always(|$step: &Step<'_>| {
                $body
                Ok(())
            });
        }
    )*};
}

fn noted_once(step: &Step<'_>) -> Result<(), TestCaseError> {
    for shown in &step.after.alarms {
        let is_event = matches!(shown.cause, Alarm::NotAcknowledged(_) | Alarm::CommandRefused(_));
        prop_assert!(!is_event || !step.world.noted(&shown.cause), "{shown:?}");
    }
    Ok(())
}

/// Even if the unit refuses as well.
#[test]
fn noted_refusal_is_not_raised_again() {
    check_sequence(Role::Supervise, &refused_by_both(), &noted_once).unwrap();
}

const HOLD: Order = Order::Command(UnitId::A, CommandKind::Hold);

after_every_move! {
    state_is_never_younger_than_its_report(step) {
        if let Some((unit, report)) = unit_and_report(step) {
            let least = step.after.at.since(report.made);
            prop_assert!(unit.state.age() >= least, "{} where it is {least} old", unit.state.age());
        }
    }

    places_and_tracks_age_with_their_state(step) {
        if let Some((unit, report)) = unit_and_report(step) {
            prop_assert!(unit.pose.age() >= unit.state.age() + report.report.pose_age);
            for track in &unit.tracks {
                prop_assert!(track.age() >= unit.state.age() + track.get().0.age);
            }
        }
    }

    held_picture_ages_like_a_new_one(step) {
        for lain in [Span::ms(150), Span::ms(700), Span::s(3)] {
            let drawn = step.after.clone().older(lain);
            let then = step.world.bench.console.shown(step.after.at + lain);
            prop_assert_eq!(&drawn.units, &then.units);
            prop_assert_eq!(&drawn.links, &then.links);
            prop_assert_eq!(drawn.at, then.at);
        }
    }

    every_label_matches_its_age(step) {
        for unit in &step.after.units {
            prop_assert_eq!(unit.state.freshness(), label(unit.state.age()));
            prop_assert_eq!(unit.pose.freshness(), label(unit.pose.age()));
            for track in &unit.tracks {
                prop_assert_eq!(track.freshness(), label(track.age()));
            }
        }
        for link in &step.after.links {
            prop_assert_eq!(link.open.freshness(), label(link.open.age()));
        }
    }

    age_grows_with_time_without_newer_reports(step) {
        let (Some(before), Some(after)) = (step.before.unit(UnitId::A), step.after.unit(UnitId::A)) else { return Ok(()) };
        if before.report == after.report {
            let elapsed = step.after.at.since(step.before.at);
            prop_assert_eq!(after.state.age(), before.state.age() + elapsed);
            prop_assert_eq!(after.pose.age(), before.pose.age() + elapsed);
        }
    }

    earlier_messages_take_nothing_back(step) {
        let (Some(before), Some(after)) = (step.before.unit(UnitId::A), step.after.unit(UnitId::A)) else { return Ok(()) };
        prop_assert!((after.report.boot, after.report.sequence) >= (before.report.boot, before.report.sequence));
    }

    another_units_signature_changes_nothing_here(step) {
        if let Move::Forged(_) = step.moved {
            prop_assert_eq!(content(step.before), content(step.after));
        }
        if let Some((_, report)) = unit_and_report(step) {
            prop_assert!(!report.forged);
        }
    }

    tracks_vanish_only_when_acknowledged(step) {
        let noted = |track: &(Boot, TrackId)| match step.act {
            Some(Act::Acknowledge(Alarm::TrackLost(_, boot, id), _)) => *track == (boot, id),
            // Several that ended together are noted together; what is still reported is not among them.
            Some(Act::Acknowledge(Alarm::TracksLost(_), _)) => {
                let lost = step.before.units.iter().flat_map(|unit| &unit.lost);
                lost.map(|lost| (lost.boot, lost.track.get().0.id)).any(|lost| lost == *track)
            }
            _ => false,
        };
        let more = |shown: &Shown| shown.unit(UnitId::A).map_or(0, |unit| unit.lost_more);
        let after = tracks(step.after);
        let gone = tracks(step.before).into_iter().filter(|track| !after.contains(track) && !noted(track));
        let dropped = more(step.after) - more(step.before);
        prop_assert!(gone.count() <= dropped as usize, "{:?} to {after:?}", tracks(step.before));
    }

    lost_track_stays_at_its_last_place(step) {
        for lost in step.after.units.iter().flat_map(|unit| &unit.lost) {
            let (track, freshness) = lost.track.get();
            prop_assert_eq!(freshness, Freshness::Lost);
            let shown = |shown: &Shown| shown.units.iter().flat_map(places).find(|(id, _)| *id == (lost.boot, track.id));
            prop_assert_eq!(shown(step.before).map(|(_, x)| x), Some(track.x_mm));
        }
    }

    no_track_is_both_lost_and_reported(step) {
        for unit in &step.after.units {
            let reported = |id: TrackId| unit.tracks.iter().any(|track| track.get().0.id == id);
            let both = unit.lost.iter().find(|lost| lost.boot == unit.report.boot && reported(lost.track.get().0.id));
            prop_assert!(both.is_none(), "{both:?}");
        }
    }

    hold_is_possible_unless_one_is_pending(step) {
        let under_way = |shown: &Shown| {
            shown.commands.iter().any(|command| command.kind == CommandKind::Hold && command.under_way())
        };
        let mut console = step.world.bench.console.clone();
        let now = step.after.at;
        console.handle(now, &Input::Timeout);
        let pending = under_way(&console.shown(now));
        let numbered = Numbered { serial: u64::MAX, act: Act::Now(HOLD) };
        console.handle(now, &Input::Act { bytes: codec::encode(&numbered) });
        let outcome = console.shown(now).answers.last().expect("an answer").outcome;
        match (step.world.role, pending) {
            (Role::View, _) => prop_assert_eq!(outcome, Err(Unable::Role)),
            (_, true) => prop_assert_eq!(outcome, Err(Unable::Pending)),
            (_, false) => prop_assert!(outcome.is_ok_and(|command| command.is_some()), "{outcome:?}"),
        }
    }

    intents_are_sent_and_released_once(step) {
        let intents = step.world.bench.intents();
        let ids: BTreeSet<_> = intents.iter().map(|(intent, _)| (intent.id.boot, intent.id.sequence)).collect();
        prop_assert_eq!(ids.len(), intents.len());
        let released = released(&step.world.bench.asked);
        prop_assert_eq!(released.iter().collect::<BTreeSet<_>>().len(), released.len());
    }

    repeated_act_is_carried_out_once(step) {
        let done = step.world.bench.events.iter().filter_map(|(_, event)| match event {
            Event::Act { serial, refused: None, .. } => Some(*serial),
            _ => None,
        });
        let done: Vec<u64> = done.collect();
        prop_assert_eq!(done.iter().collect::<BTreeSet<_>>().len(), done.len());
    }

    pending_order_is_not_given_again(step) {
        if let Some(new) = step.after.commands.iter().find(|command| step.before.commands.iter().all(|b| b.id != command.id)) {
            let same = step.before.commands.iter().find(|command| command.kind == new.kind && command.under_way());
            // What is overdue at this very instant counts as unanswered.
            let overdue = |command: &&console::life::ShownCommand| {
                step.after.command(&command.intent).is_some_and(|after| after.life == Life::NotAcknowledged)
            };
            prop_assert!(same.filter(|command| !overdue(command)).is_none(), "{same:?}");
        }
    }

    viewer_sends_nothing(step) {
        if step.world.role == Role::View {
            prop_assert_eq!(step.asked, &[]);
        }
    }

    leaving_safe_needs_confirmation_and_reason(step) {
        for asked in step.asked {
            let Asked::Stage(intent, _) = asked else { continue };
            let giver = step.world.given_by(intent);
            let order = Order::Command(intent.unit, intent.kind);
            if intent.kind.towards_safe() {
                prop_assert_eq!(giver, Some(Act::Now(order)));
            } else {
                prop_assert_eq!(step.before.prepared.map(|prepared| prepared.order), Some(order));
                prop_assert!(matches!(giver, Some(Act::Confirm(confirmed, _)) if confirmed == order), "{giver:?}");
                prop_assert!(!intent.reason.as_str().is_empty());
            }
        }
    }

    leaving_safe_needs_a_fresh_state(step) {
        for asked in step.asked {
            let Asked::Stage(intent, _) = asked else { continue };
            if !intent.kind.towards_safe() {
                let fresh = step.after.unit(UnitId::A).and_then(|unit| unit.state.fresh());
                prop_assert_eq!(fresh.map(|state| state.nonce), Some(intent.nonce));
            }
        }
    }

    only_staged_and_unwithdrawn_intents_are_released(step) {
        for intent in released(step.asked) {
            prop_assert!(step.world.staged.contains(&intent));
            prop_assert!(!step.world.withdrawn.contains(&intent));
        }
    }

    prepared_order_is_timely_and_permitted(step) {
        // As of the last look: between two looks time alone may end it.
        if let (Some(prepared), false) = (step.after.prepared, matches!(step.moved, Move::Gap(_))) {
            prop_assert!(step.after.at < prepared.until);
            prop_assert_eq!(step.after.unable(&prepared.order), None);
        }
    }

    execution_display_needs_the_units_signature_and_stays(step) {
        for given in step.after.commands.iter().filter(|command| command.life == Life::Executed) {
            prop_assert!(step.world.answered.contains(&(given.intent, true)));
        }
        for before in step.before.commands.iter().filter(|command| command.life == Life::Executed) {
            let after = step.after.command(&before.intent);
            prop_assert!(after.is_none_or(|after| after.life == Life::Executed));
        }
    }

    missing_answer_is_shown_after_a_second(step) {
        for given in step.after.commands.iter().filter(|command| command.under_way()) {
            let start = given.times.released.unwrap_or(given.times.requested);
            prop_assert!(step.after.at.since(start) <= ACK_WITHIN, "{given:?}");
        }
    }

    command_stages_follow_their_order(step) {
        for given in &step.after.commands {
            let times = given.times;
            for time in [times.staged, times.released, times.sent, times.answered, times.effect].into_iter().flatten() {
                prop_assert!(time >= times.requested && time <= step.after.at);
            }
            prop_assert!(times.released.is_none() || (times.staged.is_some() && times.staged <= times.released));
        }
    }

    every_alarm_condition_is_listed(step) {
        let alarm = |cause: Alarm| step.after.alarms.iter().any(|group| group.cause == cause);
        // As of the last look.
        if matches!(step.moved, Move::Gap(_)) {
            return Ok(());
        }
        for unit in &step.after.units {
            let (state, freshness) = unit.state.get();
            let held = step.after.alarms.iter().any(|group| group.hold_stands && group.priority == Priority::High);
            prop_assert!(state.mode != Mode::HoldSafe || (held && alarm(Alarm::HoldSafe(unit.unit))));
            prop_assert!(state.mode != Mode::Degraded || alarm(Alarm::Degraded(unit.unit)));
            prop_assert!(freshness != Freshness::Lost || alarm(Alarm::Silent(unit.unit)));
            for lost in &unit.lost {
                let track = lost.track.get().0;
                let event = Incident::TrackEnded(unit.unit, track.id, track.class);
                let noted = step.after.past.iter().any(|past| (past.at, past.what) == (lost.since, event));
                prop_assert!(noted || step.after.past_more > 0, "{lost:?}");
            }
        }
        for given in step.after.commands.iter().filter(|command| command.life == Life::NotAcknowledged) {
            let cause = Alarm::NotAcknowledged(given.id);
            prop_assert!(alarm(cause) || led_to(step.after, LedTo::NotAcknowledged(given.id)) || step.world.noted(&cause));
        }
    }

    acknowledged_event_is_not_raised_again(step) {
        noted_once(step)?;
    }

    urgent_alarms_leave_only_when_acknowledged(step) {
        let urgent = |group: &&ShownGroup| group.priority == Priority::High && !group.acknowledged;
        for before in step.before.alarms.iter().filter(urgent) {
            let after = step.after.alarms.iter().find(|after| after.cause == before.cause);
            let noted = matches!(step.act, Some(Act::Acknowledge(cause, since)) if (cause, since) == (before.cause, before.since));
            // An order to a unit that turns out to be silent is a consequence of that.
            let absorbed = matches!(before.cause, Alarm::NotAcknowledged(id) if led_to(step.after, LedTo::NotAcknowledged(id)));
            let raised = after.is_some_and(|after| !after.acknowledged) || absorbed;
            prop_assert!(raised || (noted && step.world.role > Role::View), "{before:?} to {after:?}");
        }
    }

    sound_stops_only_by_an_act_or_with_its_cause(step) {
        let loud = |group: &&ShownGroup| group.open() && group.unfolded(step.after.alarm_flood);
        let least = step.after.alarms.iter().filter(loud).map(|group| group.priority).min();
        match step.after.sound.silenced_until {
            None => prop_assert_eq!(step.after.sound.motif.map(|(priority, _)| priority), least),
            Some(until) => prop_assert!(until.since(step.after.at) <= SILENCED_FOR),
        }
    }

    link_is_never_younger_than_its_message(step) {
        if let Some(fed) = step.world.fed {
            for link in &step.after.links {
                prop_assert!(link.open.age() >= step.after.at.since(fed));
            }
        }
    }

    every_refusal_is_counted_once(step) {
        let counted = |is_local: bool| -> u64 {
            step.after.refusals.iter().filter(|shown| shown.here == is_local).map(|shown| shown.n).sum()
        };
        prop_assert_eq!(counted(false), step.world.counted.iter().sum::<u64>());
        let count = |interface, reason| step.world.bench.console.accounts().total(Account::Refused(interface, reason));
        let ways = [Interface::Bus(Topic::Feed), Interface::Acks];
        let total: u64 = Reason::ALL.iter().flat_map(|reason| ways.map(|interface| count(interface, *reason))).sum();
        prop_assert_eq!(counted(true), total);
    }

    every_list_is_bounded(step) {
        let shown = step.after;
        prop_assert!(shown.answers.len() <= MAX_ANSWERS && shown.commands.len() <= MAX_COMMANDS);
        prop_assert!(shown.units.iter().all(|unit| unit.lost.len() <= MAX_LOST && unit.tracks.len() <= 8));
        prop_assert!(shown.alarms.len() <= MAX_ALARMS);
        prop_assert!(shown.alarms.iter().all(|group| group.led_to.len() <= MAX_LED_TO));
    }

    every_act_is_answered_and_reported(step) {
        let logged = step.events.iter().filter(|(_, event)| matches!(event, Event::Act { .. })).count();
        let acted = step.act.is_some() || matches!(step.moved, Move::Person(Does::Garbage(_)));
        prop_assert_eq!(logged, usize::from(acted));
        if acted {
            prop_assert_eq!(step.after.answers.last().map(|answer| answer.at), Some(step.after.at));
        }
    }

    inputs_with_a_person_replay_identically(step) {
        // All that went before is fed again, so now and then is enough.
        if let Move::Session(_) = step.moved {
            let journal = &step.world.bench.journal;
            let (start, ..) = journal[0];
            let mut retraced = console(Policy::default(), step.world.role, vec![], Bench::revocations(), start);
            for (now, input, expected) in journal {
                retraced.handle(*now, input);
                let outputs: Vec<Output> = std::iter::from_fn(|| retraced.output()).collect();
                prop_assert_eq!(&outputs, expected);
            }
        }
    }

    recording_replays_without_secrets_or_requests(step) {
        if let Move::Session(_) = step.moved {
            let journal = &step.world.bench.journal;
            let (start, ..) = journal[0];
            let mut retraced = retracing(step.world.role, start);
            for (now, input, said) in journal {
                retraced.handle(*now, input);
                let asks = std::iter::from_fn(|| retraced.output()).any(|output| matches!(output, Output::Bus { .. }));
                prop_assert!(!asks);
                said.iter().for_each(|output| retraced.apply_output(*now, output));
            }
            prop_assert_eq!(step.after, &retraced.shown(step.after.at));
        }
    }
}

/// True if some alarm tells of this consequence, or has no more room for any.
fn led_to(shown: &Shown, what: LedTo) -> bool {
    shown.alarms.iter().any(|group| group.led_more > 0 || group.led_to.iter().any(|(_, led)| *led == what))
}

/// The unit as shown, and the report behind it.
fn unit_and_report<'a>(step: &'a Step<'_>) -> Option<(&'a ShownUnit, &'a Told)> {
    let unit = step.after.unit(UnitId::A)?;
    let made = |heard: &&Told| (heard.report.boot, heard.report.sequence) == (unit.report.boot, unit.report.sequence);
    Some((unit, step.world.told.iter().find(made).expect("what is shown was told")))
}

/// A track of one boot of a unit, and how far east it is.
type Placed = ((Boot, TrackId), i32);

/// The picture of A without the effect of elapsed time.
fn content(shown: &Shown) -> Option<(RecordId, Mode, Vec<Placed>)> {
    let unit = shown.unit(UnitId::A)?;
    Some((unit.report, unit.state.get().0.mode, places(unit)))
}

/// Every track that is shown of a unit, reported or lost, with its place.
fn places(unit: &ShownUnit) -> Vec<Placed> {
    let place = |boot: Boot, track: &Labelled<wire::report::ReportedTrack>| {
        let (track, _) = track.get();
        ((boot, track.id), track.x_mm)
    };
    let lost = unit.lost.iter().map(|lost| place(lost.boot, &lost.track));
    unit.tracks.iter().map(|track| place(unit.report.boot, track)).chain(lost).collect()
}

fn tracks(shown: &Shown) -> Vec<(Boot, TrackId)> {
    shown.units.iter().flat_map(places).map(|(id, _)| id).collect()
}

fn released(requested: &[Asked]) -> Vec<IntentHash> {
    let release = |requested: &Asked| match requested {
        Asked::Release(confirmation) => Some(confirmation.intent),
        _ => None,
    };
    requested.iter().filter_map(release).collect()
}
