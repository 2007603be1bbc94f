//! Receipts of process faults: a kill, a hang, a share of the time, a full disk.
//!
//! The actor logs its action; the effect is seen at the process, by its marks (`facts::process`).

use evidence::log::by_recorder;
use evidence::{Evidence, Micros, Witnessed};
use ground_truth::{Any, Note, Sight, Suspension};
use wire::event::Event;
use wire::feed::CommandStage;
use wire::id::NodeId;

use super::window::Window;
use crate::facts::Span;
use crate::facts::process::{LAST_WORDS, dead_spans, is_mark};
use crate::facts::stream::sightings;

/// Time after a stop for which a mark of the process may still be made.
const UNDER_WAY: Micros = 20_000;
/// Time before and behind its stops for which a process's rate of marks is looked at.
const AROUND: Micros = 1_000_000;
/// Number of marks that have to be missing for a silence to be evidence.
const LEAST_MISSING: u64 = 3;

/// Time of a kill after which the dead wrote no more. For the broker the unit's ingress has to see its own stream end.
pub(crate) fn killed_at(evidence: &Evidence, wanted: NodeId, window: Window) -> Option<Micros> {
    let silent = |ended_at: Micros| {
        let mut entries = evidence.entries.iter().filter(|w| w.entry.node == wanted);
        // A process that is started again writes under another boot.
        let boot = entries.clone().take_while(|w| w.at <= ended_at).last().map(|w| w.entry.boot);
        !entries.any(|w| Some(w.entry.boot) == boot && w.at > ended_at + LAST_WORDS)
    };
    let dead = |ended_at: Micros| {
        silent(ended_at) && (wanted != NodeId::BROKER || unit_stream_ended(evidence, ended_at, evidence.duration))
    };
    let ends = |w: &&Witnessed| matches!(w.entry.event, Any::Instrument(Note::Ended { node, killed: true, .. }) if node == wanted);
    evidence.entries.iter().filter(ends).map(|w| w.at).find(|ended_at| window.contains(*ended_at) && dead(*ended_at))
}

/// True if the unit's ingress saw its stream to the broker end.
fn unit_stream_ended(evidence: &Evidence, from: Micros, to: Micros) -> bool {
    sightings(evidence).any(|s| {
        let ended = matches!(s.sight, Sight::Closed | Sight::HungUp);
        Some(s.ingress) == evidence.under.guard() && ended && s.at >= from && s.at < to
    })
}

/// Begin of a stop of a process that was kept from running: it left marks before and, unless it was ended then, after, none while it was stopped,
/// and would have left some: by how often it did otherwise.
pub(crate) fn suspended_at(evidence: &Evidence, wanted: NodeId, window: Window) -> Option<Micros> {
    let mut begins = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Instrument(Note::Suspended { node, how, on: true }) if node == wanted && window.contains(w.at) => {
            Some((w.at, how))
        }
        _ => None,
    });
    let (from, suspension) = begins.next()?;
    let is_end = |w: &&Witnessed| {
        w.at > from
            && matches!(w.entry.event, Any::Instrument(Note::Suspended { node, on: false, .. }) if node == wanted)
    };
    // At the end of a run every process is let go on; the dead are not.
    let died = dead_spans(evidence, wanted)
        .into_iter()
        .map(|(ended_at, _)| ended_at)
        .find(|ended_at| *ended_at > from)
        .unwrap_or(Micros::MAX);
    let to = evidence.entries.iter().find(is_end).map_or(evidence.duration, |w| w.at.min(evidence.duration)).min(died);
    let stops = match suspension {
        Suspension::Hang => vec![(from, to)],
        Suspension::Slow { .. } => stops_of_slow_process(evidence, wanted, (from, to)),
    };
    let broker = wanted == NodeId::BROKER;
    // The broker writes few marks by itself: it has to hold up a publication that was given to it.
    let stopped = if broker { broker_held_up(evidence, &stops) } else { stood_still(evidence, wanted, &stops, died) };
    stopped.then_some(from)
}

/// Time from which the recorder's disk was full: the recording grew before, and did not from then on although there were entries
/// to write; and grew again where there was room again before the end.
pub(crate) fn disk_filled_at(evidence: &Evidence, wanted: NodeId, window: Window) -> Option<Micros> {
    let turned_at = |wanted_on: bool, after: Micros| {
        let turned = move |w: &&Witnessed| match w.entry.event {
            Any::Instrument(Note::DiskFull { node, on }) => node == wanted && on == wanted_on && w.at >= after,
            _ => false,
        };
        evidence.entries.iter().filter(turned).map(|w| w.at)
    };
    let from = turned_at(true, 0).find(|filled_at| window.contains(*filled_at))?;
    let freed = turned_at(false, from).find(|emptied_at| *emptied_at < evidence.duration);
    let to = freed.unwrap_or(evidence.duration);
    let quiet = from + LAST_WORDS;
    let grew = |from: Micros, to: Micros| {
        let stored = |w: &Witnessed| {
            matches!(w.entry.event, Any::Instrument(Note::Kept { .. })) && w.entry.node == NodeId::CAMPAIGN
        };
        evidence.entries.iter().any(|w| w.at > from && w.at < to && stored(w))
    };
    let due = |w: &&Witnessed| w.at > quiet && w.at < to && w.entry.node != wanted && by_recorder(w.entry.node);
    let had_entries = evidence.entries.iter().filter(due).count() as u64 >= LEAST_MISSING;
    let grew_again = freed.is_none_or(|freed_at| grew(freed_at, freed_at.saturating_add(AROUND)));
    (grew(from.saturating_sub(AROUND), from) && had_entries && !grew(quiet, to) && grew_again).then_some(from)
}

/// Stops of a slow process within `span`.
fn stops_of_slow_process(evidence: &Evidence, wanted: NodeId, span: Span) -> Vec<Span> {
    let mut stops = Vec::new();
    let mut since = None;
    for w in evidence.entries.iter().filter(|w| w.at >= span.0 && w.at <= span.1) {
        match w.entry.event {
            Any::Instrument(Note::Halted { node, on: true }) if node == wanted => since = Some(w.at),
            Any::Instrument(Note::Halted { node, on: false }) if node == wanted => {
                stops.extend(since.take().map(|since| (since, w.at)))
            }
            _ => {}
        }
    }
    stops.extend(since.map(|since| (since, span.1)));
    stops
}

fn stood_still(evidence: &Evidence, wanted: NodeId, stops: &[Span], died: Micros) -> bool {
    let (Some(first), Some(last)) = (stops.first(), stops.last()) else { return false };
    // A process that was stopped to the end of the run still closes its account.
    let observed = (first.0.saturating_sub(AROUND), last.1.saturating_add(AROUND));
    let marks = evidence.entries.iter().filter(|w| is_mark(w, wanted));
    let marks: Vec<Micros> = marks.map(|w| w.at).filter(|time| *time >= observed.0 && *time <= observed.1).collect();
    // A mark that was on its way when it was stopped may still come out; a mark as it goes on is its own again.
    let within_stop = |time: &Micros| stops.iter().any(|(from, to)| *time > from + UNDER_WAY && time < to);
    let stopped: Micros = stops.iter().map(|(from, to)| to.saturating_sub(from + UNDER_WAY)).sum();
    let ran = (observed.1 - observed.0).saturating_sub(stopped).max(1);
    // A process that is silent anyway has no receipt: its rate outside of the stops says how many marks are missing.
    let missing = marks.len() as u64 * stopped / ran;
    let lived_after = || last.1 == died || marks.last().is_some_and(|time| *time >= last.1);
    let lived = marks.first().is_some_and(|time| *time <= first.0) && lived_after();
    lived && missing >= LEAST_MISSING && !marks.iter().any(within_stop)
}

/// True if publications to the broker while it was stopped came out of it after that, and none came out meanwhile; or
/// the unit gave it up.
fn broker_held_up(evidence: &Evidence, stops: &[Span]) -> bool {
    let delivered =
        |w: &Witnessed| matches!(w.entry.event, Any::Instrument(Note::StreamSaw { sight: Sight::Delivered, .. }));
    let published = |w: &Witnessed| match w.entry.event {
        Any::Service(Event::Staged { stage: CommandStage::Sent, .. }) => w.entry.node == NodeId::GATEWAY,
        Any::Service(Event::Executed { .. }) => w.entry.node == evidence.under.node(),
        _ => false,
    };
    let any_within = |test: &dyn Fn(&Witnessed) -> bool, from: Micros, to: Micros| {
        evidence.entries.iter().any(|w| w.at > from && w.at < to && test(w))
    };
    let held_back = |(from, to): &Span| {
        any_within(&published, *from, *to) && any_within(&delivered, to - 1, to.saturating_add(AROUND))
    };
    let came_meanwhile = stops.iter().any(|(from, to)| any_within(&delivered, from + UNDER_WAY, *to));
    let gave_up =
        |(from, to): &Span| unit_stream_ended(evidence, *from, to.saturating_add(AROUND).min(evidence.duration));
    !came_meanwhile && stops.iter().any(held_back) || stops.iter().any(gave_up)
}
