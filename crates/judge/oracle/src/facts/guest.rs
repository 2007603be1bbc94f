//! The guest that drives the unit under test: its statements, its failure, and the safe state that truth supports.
//!
//! A safe state is read from the plant, never from the guest's statements, and it lasts. Neither an arrival at the goal, true or stated,
//! nor an operator's HOLD is one. The place that a guest drives by is its own statement. A false place is judged against the truth, which
//! the guest cannot know.

use evidence::trial::GuestFailure;
use evidence::{Evidence, Micros};
use ground_truth::{Any, Note};
use wire::event::Event;
use wire::guest::{Declared, Place};
use wire::mode::Mode;

use super::motion::Truth;
use super::place::{length, minus};
use super::timeline::Timeline;

/// The guest of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct EngagedGuest {
    /// Its name.
    pub name: String,
    /// True if it drives without the guards.
    pub bare: bool,
    /// End of its route, where it has one.
    goal: Option<Place>,
}

/// The guest that drives the unit under test; none in a run of the platform itself.
pub(crate) fn engaged_guest(evidence: &Evidence) -> Option<EngagedGuest> {
    unit_events(evidence).find_map(|(_, event)| match event {
        Event::GuestEngaged { name, bare, goal } => Some(EngagedGuest { name: name.as_str().to_owned(), bare, goal }),
        _ => None,
    })
}

/// True if the run is that of a bare guest.
pub(crate) fn is_bare(evidence: &Evidence) -> bool {
    engaged_guest(evidence).is_some_and(|guest| guest.bare)
}

fn unit_events(evidence: &Evidence) -> impl Iterator<Item = (Micros, Event)> {
    let of_unit = evidence.entries.iter().filter(|w| w.entry.node == evidence.under.node());
    of_unit.filter_map(|w| if let Any::Service(event) = w.entry.event { Some((w.at, event)) } else { None })
}

/// Failure of the guest during the run.
pub(crate) fn guest_failure(evidence: &Evidence) -> Option<GuestFailure> {
    unit_events(evidence).find_map(|(time, event)| match event {
        Event::GuestFailed { fault, why } if time <= evidence.duration => Some(GuestFailure {
            at_ms: time as f64 / 1000.0,
            fault: fault.name().to_owned(),
            reason: why.as_str().to_owned(),
        }),
        _ => None,
    })
}

/// Steps of the guest in the whole run, and its set-points that the guards limited; none where the unit closed no account of them.
pub(crate) fn closing_account(evidence: &Evidence) -> Option<(u32, u32)> {
    unit_events(evidence).find_map(|(_, event)| match event {
        Event::GuestSteps { steps, limited } => Some((steps, limited)),
        _ => None,
    })
}

/// Set-points of the guest that the guards limited in the whole run; none where the unit closed no account of them.
pub(crate) fn limited_set_points(evidence: &Evidence) -> Option<u32> {
    closing_account(evidence).map(|(_, limited)| limited)
}

/// True if the guest states a place that it drives by.
pub(crate) fn states_place(evidence: &Evidence) -> bool {
    unit_events(evidence).any(|(_, event)| matches!(event, Event::GuestPlaced { .. }))
}

/// False alarms of a bare guest before `until`: it states a safe state where its mode lets it drive, short of the end of its route. Inside the
/// guards the alarms are the platform's.
pub(crate) fn false_alarms(evidence: &Evidence, timeline: &Timeline, until: Micros) -> u32 {
    if !is_bare(evidence) {
        return 0;
    }
    let mut before = Declared::Nominal;
    let alarms = unit_events(evidence).filter(|(time, event)| {
        let Event::GuestStated { declared, .. } = event else { return false };
        // Another statement of the same state is no further alarm.
        let alarms = *declared == Declared::Safe && before != Declared::Safe;
        before = *declared;
        let drives = matches!(timeline.mode_at(*time), Mode::Ready | Mode::PrepareToAct);
        alarms && drives && *time < until.min(evidence.duration) && !is_at_goal(evidence, *time)
    });
    alarms.count() as u32
}

/// True if the plant is not in its safe motion.
pub(crate) fn is_driving(truth: &Truth) -> bool {
    !truth.safe
}

/// Distance from the end of the route within which a guest may take itself to have arrived, mm. On top goes the way that it brakes.
const ARRIVED_MM: f64 = 2000.0;

/// Way that a vehicle on wheels may still roll once it counts as standing, mm.
const ROLLS_MM: f64 = 100.0;

/// True if the safe motion of the plant from `from` to the end of the run has lasted twice *Th* and stays where it
/// began. A plant that creeps, or flies on slowly, does not stay. A unit that leaves the ground may drift as far as the
/// fence margin.
fn stop_lasts(evidence: &Evidence, timeline: &Timeline, from: Micros) -> bool {
    let rest = || timeline.truth.iter().filter(move |t| t.at >= from);
    let place = |t: &Truth| (f64::from(t.place.0), f64::from(t.place.1));
    let long = evidence.duration.saturating_sub(from) >= 2 * evidence.bounds.to_hold_safe_ms * 1000;
    long && rest().next().is_some_and(|first| {
        let drift_limit = if first.reserves.is_some() { f64::from(evidence.bounds.fence_margin_mm) } else { ROLLS_MM };
        rest().all(|t| length(minus(place(t), place(first))) <= drift_limit)
    })
}

/// Time from which the plant stands until the end of the run by an act of its guest. The plant must have driven at
/// `zero` or later. A stand under an operator's HOLD does not count, nor one at the end of the route, by the truth or
/// by the guest's own statement.
pub(crate) fn stands_from(evidence: &Evidence, timeline: &Timeline, zero: Micros) -> Option<Micros> {
    // A plant that never drove shows no act of its guest.
    let before = timeline.truth.iter().rev().find(|t| t.at <= zero).is_some_and(is_driving);
    let after = timeline.truth.iter().any(|t| t.at >= zero && is_driving(t));
    let from = timeline.truth_for_good(zero, |t| !is_driving(t));
    let from =
        from.filter(|from| (before || after) && matches!(timeline.mode_at(*from), Mode::Ready | Mode::PrepareToAct));
    from.filter(|from| stop_lasts(evidence, timeline, *from) && !is_at_goal(evidence, *from))
}

fn is_at_goal(evidence: &Evidence, time: Micros) -> bool {
    let Some(Place(x, y)) = engaged_guest(evidence).and_then(|guest| guest.goal) else { return false };
    let goal = (f64::from(x), f64::from(y));
    let braking_way =
        f64::from(evidence.bounds.max_speed_mm_s).powi(2) / (2.0 * f64::from(evidence.bounds.braking_mm_s2.max(1)));
    let near = |x: i32, y: i32| length(minus((f64::from(x), f64::from(y)), goal)) <= ARRIVED_MM + braking_way;
    let before = evidence.entries.iter().filter(|w| w.at <= time).rev();
    let truth = before.clone().find_map(|w| match w.entry.event {
        Any::Instrument(Note::Truth { unit, x_mm, y_mm, .. }) if unit == evidence.under.unit => Some((x_mm, y_mm)),
        _ => None,
    });
    let stated = before.filter(|w| w.entry.node == evidence.under.node()).find_map(|w| match w.entry.event {
        Any::Service(Event::GuestPlaced { x_mm, y_mm }) => Some((x_mm, y_mm)),
        _ => None,
    });
    // A guest under a false place stops where it takes its goal to be: it has not noticed the attack.
    [truth, stated].into_iter().flatten().any(|(x, y)| near(x, y))
}
