//! Verdicts about guests: what truth supports, and the properties that are not judged.
//!
//! Inside the guards a guest's run is judged as the platform's own: the state machine, its mode and its guards are the platform's. A *bare*
//! guest has none of these. Of its run the envelope is judged (P4), orders executed twice or late (P8), the object of an act (P11), standing
//! still as long as an operator wants that (P3, P9), and how long it drives by a false place (P3); everything else is named in [`not_judged`].
//! A safe state is read from the plant, never from what the guest says of itself, and it lasts; an arrival at the goal, true or stated, and an
//! operator's HOLD are none. Of the place that it drives by there is its own word; a false one can only be held against the truth,
//! which it cannot know.

use evidence::trial::{GuestFailure, GuestRow};
use evidence::{Evidence, Finding, Micros, Property};
use instrument::{Any, Note};
use wire::event::Event;
use wire::guest::{Declared, Fault, Place};
use wire::mode::Mode;

use crate::place::{length, minus, truth};
use crate::timeline::{Timeline, Truth};
use crate::{finding, process_fault};

/// Properties that are not judged of a bare guest, each with the reason.
const NOT_JUDGED: [(&str, &str); 6] = [
    ("P1", "authority is the state machine's, whose guards are waived"),
    ("P2", "the loss of a subsystem has to show in a mode, and a bare guest has none"),
    ("P3 by mode", "HOLD_SAFE is a mode of the platform; the plant's motion is judged in its place"),
    ("P5", "what an unaccepted record may change inside a guest is not seen"),
    ("P7", "the display shows the platform's state, not the guest's"),
    ("P9 by mode", "recovery is the state machine's; standing still in IDLE is judged at the plant"),
];
/// A guest without `place` among its outputs.
const NO_PLACE: (&str, &str) = ("P3 by place", "the guest states no place that it drives by");

/// The guest of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Engaged {
    name: String,
    pub(crate) bare: bool,
    goal: Option<Place>,
}

/// The guest that drives the unit under test; none in a run of the platform itself.
pub(crate) fn engaged(evidence: &Evidence) -> Option<Engaged> {
    events(evidence).find_map(|(_, event)| match event {
        Event::GuestEngaged { name, bare, goal } => Some(Engaged { name: name.as_str().to_owned(), bare, goal }),
        _ => None,
    })
}

/// True if the run is that of a bare guest.
pub(crate) fn is_bare(evidence: &Evidence) -> bool {
    engaged(evidence).is_some_and(|guest| guest.bare)
}

fn events(evidence: &Evidence) -> impl Iterator<Item = (Micros, Event)> {
    let of_unit = evidence.entries.iter().filter(|w| w.entry.node == evidence.under.node());
    of_unit.filter_map(|w| if let Any::Service(event) = w.entry.event { Some((w.at, event)) } else { None })
}

/// The guest's failure during the run.
pub(crate) fn failed(evidence: &Evidence) -> Option<GuestFailure> {
    events(evidence).find_map(|(at, event)| match event {
        Event::GuestFailed { fault, why } if at <= evidence.duration => Some(GuestFailure {
            at_ms: at as f64 / 1000.0,
            fault: fault.name().to_owned(),
            why: why.as_str().to_owned(),
        }),
        _ => None,
    })
}

/// The guest's row in a trial.
pub(crate) fn row(evidence: &Evidence) -> Option<GuestRow> {
    let Engaged { name, bare, .. } = engaged(evidence)?;
    let steps = events(evidence).find_map(|(_, event)| match event {
        Event::GuestSteps { steps, limited } => Some((steps, limited)),
        _ => None,
    });
    let (steps, limited) = steps.unwrap_or_default();
    let not_judged = if bare { not_judged(evidence) } else { Vec::new() };
    Some(GuestRow { name, bare, steps, limited, failure: failed(evidence), not_judged })
}

/// Set-points of the guest that the guards limited in the whole run; none where the unit closed no account of them.
pub(crate) fn limited(evidence: &Evidence) -> Option<u32> {
    events(evidence).find_map(|(_, event)| match event {
        Event::GuestSteps { limited, .. } => Some(limited),
        _ => None,
    })
}

/// False alarms of a bare guest before `until`: it states a safe state where its mode lets it drive, short of the end of its route. Inside the
/// guards the alarms are the platform's.
pub(crate) fn false_alarms(evidence: &Evidence, line: &Timeline, until: Micros) -> u32 {
    if !is_bare(evidence) {
        return 0;
    }
    let mut before = Declared::Nominal;
    let alarms = events(evidence).filter(|(at, event)| {
        let Event::GuestStated { declared, .. } = event else { return false };
        let alarms = *declared == Declared::Safe && before != Declared::Safe;
        before = *declared;
        let drives = matches!(line.mode_at(*at), Mode::Ready | Mode::PrepareToAct);
        alarms && drives && *at < until.min(evidence.duration) && !arrived(evidence, *at)
    });
    alarms.count() as u32
}

/// Properties that are not judged of this bare guest, each with the reason.
fn not_judged(evidence: &Evidence) -> Vec<String> {
    let placed = events(evidence).any(|(_, event)| matches!(event, Event::GuestPlaced { .. }));
    let all = NOT_JUDGED.into_iter().chain((!placed).then_some(NO_PLACE));
    all.map(|(property, why)| format!("{property}: {why}")).collect()
}

/// P3: the fence margin allows for a distance of the vehicle from the place that it drives by. When it has driven beyond that for
/// *Th*, it has to stand, and time to brake is granted on top.
pub(crate) fn astray(evidence: &Evidence, line: &Timeline) -> Option<Finding> {
    let th = evidence.bounds.to_hold_safe_ms * 1000;
    let margin = f64::from(evidence.bounds.fence_margin_mm);
    let truth = truth(evidence);
    let stamped = evidence.entries.iter().filter(|w| w.entry.node == evidence.under.node());
    let places = stamped.filter_map(|w| match w.entry.event {
        Any::Service(Event::GuestPlaced { x_mm, y_mm }) => Some((w.at, w.entry.at, (f64::from(x_mm), f64::from(y_mm)))),
        _ => None,
    });
    // Since when it has been astray, and since when it stands meanwhile: a short stop clears no false place.
    let (mut since, mut stood): (Option<Micros>, Option<Micros>) = (None, None);
    for (at, stamp, place) in places {
        let Some([x, y]) = truth.before(stamp) else { continue };
        let off = length(minus(place, (x, y)));
        let moves = line.truth.iter().rev().find(|t| t.at <= at).is_some_and(drives);
        stood = if moves { None } else { stood.or(Some(at)) };
        if off <= margin || stood.is_some_and(|stood| at - stood >= th) {
            since = None;
        } else if moves {
            since = since.or(Some(at));
        }
        let Some(from) = since.filter(|since| moves && at - since > th) else { continue };
        let due = crate::speed::braked(evidence, from + th, 0);
        if at > due {
            let what = format!(
                "drives {off:.0} mm from the place that it goes by, {} ms after that began",
                (at - from) / 1000
            );
            return Some(finding(Property::P3, at, what));
        }
    }
    None
}

fn drives(truth: &Truth) -> bool {
    !truth.safe
}

/// Distance from the end of the route within which a guest may take itself to have arrived, mm. On top goes the way that it brakes.
const ARRIVED_MM: f64 = 2000.0;

/// Way that a vehicle on wheels may still roll once it counts as standing, mm.
const ROLLS_MM: f64 = 100.0;

/// True if the plant, in its safe motion from `from` to the end of the run, has been so for twice *Th* and is where that began: one that
/// creeps, or flies on slowly, is not. A unit that leaves the ground may drift as far as the fence margin.
fn lasts(evidence: &Evidence, line: &Timeline, from: Micros) -> bool {
    let rest = || line.truth.iter().filter(move |t| t.at >= from);
    let of = |t: &Truth| (f64::from(t.place.0), f64::from(t.place.1));
    let long = evidence.duration.saturating_sub(from) >= 2 * evidence.bounds.to_hold_safe_ms * 1000;
    long && rest().next().is_some_and(|first| {
        let most = if first.kept.is_some() { f64::from(evidence.bounds.fence_margin_mm) } else { ROLLS_MM };
        rest().all(|t| length(minus(of(t), of(first))) <= most)
    })
}

/// Time from which the plant stands for good by the guest's doing, where it drove at `zero` or later: not since an operator's HOLD,
/// and not at the end of the route by the truth or by the guest's own word.
pub(crate) fn stands_from(evidence: &Evidence, line: &Timeline, zero: Micros) -> Option<Micros> {
    let before = line.truth.iter().rev().find(|t| t.at <= zero).is_some_and(drives);
    let after = line.truth.iter().any(|t| t.at >= zero && drives(t));
    let from = process_fault::for_good(line, zero, |t| !drives(t));
    let from = from.filter(|from| (before || after) && matches!(line.mode_at(*from), Mode::Ready | Mode::PrepareToAct));
    from.filter(|from| lasts(evidence, line, *from) && !arrived(evidence, *from))
}

fn arrived(evidence: &Evidence, at: Micros) -> bool {
    let Some(Place(x, y)) = engaged(evidence).and_then(|guest| guest.goal) else { return false };
    let goal = (f64::from(x), f64::from(y));
    let brakes =
        f64::from(evidence.bounds.max_speed_mm_s).powi(2) / (2.0 * f64::from(evidence.bounds.braking_mm_s2.max(1)));
    let near = |x: i32, y: i32| length(minus((f64::from(x), f64::from(y)), goal)) <= ARRIVED_MM + brakes;
    let before = evidence.entries.iter().filter(|w| w.at <= at).rev();
    let truth = before.clone().find_map(|w| match w.entry.event {
        Any::Instrument(Note::Truth { unit, x_mm, y_mm, .. }) if unit == evidence.under.unit => Some((x_mm, y_mm)),
        _ => None,
    });
    let stated = before.filter(|w| w.entry.node == evidence.under.node()).find_map(|w| match w.entry.event {
        Any::Service(Event::GuestPlaced { x_mm, y_mm }) => Some((x_mm, y_mm)),
        _ => None,
    });
    [truth, stated].into_iter().flatten().any(|(x, y)| near(x, y))
}

/// True if a host that overslept may be what kept the guest from starting or answering.
pub(crate) fn is_of_the_host(failure: &GuestFailure) -> bool {
    [Fault::Silent, Fault::NotStarted].map(Fault::name).contains(&failure.fault.as_str())
}
