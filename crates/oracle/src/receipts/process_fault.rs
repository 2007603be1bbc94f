//! Receipts of process faults: a kill, a hang, a share of the time, a full disk.
//!
//! The actor logs its action; the effect is seen at the process. Its own entries, and the inputs of its core,
//! are both its marks. The broker has no core and writes few entries: it is heard of by the streams that lead to it.

use evidence::log::by_recorder;
use evidence::{Evidence, Micros, Witnessed};
use instrument::{Any, Note, Sight, Suspension};
use wire::event::Event;
use wire::feed::CommandStage;
use wire::id::NodeId;

use crate::window::Window;

/// Time after a stop for which a mark of the process may still be made.
const UNDER_WAY: Micros = 20_000;
/// Time for which a dying process's last words may still be on their way into the log.
const LAST_WORDS: Micros = 100_000;
/// Time before and behind its stops for which a process's rate of marks is looked at.
const AROUND: Micros = 1_000_000;
/// So many marks have to be missing for a silence to say something.
const TELLING: u64 = 3;

/// A span of time.
type Span = (Micros, Micros);

/// Times at which `node` did not live: from each end to the start after it, if there is one.
pub(crate) fn dead(evidence: &Evidence, node: NodeId) -> Vec<Span> {
    let ended = evidence
        .entries
        .iter()
        .filter(|w| matches!(w.entry.event, Any::Instrument(Note::Ended { node: n, .. }) if n == node));
    let again = |from: Micros| {
        let mut later = evidence.entries.iter().filter(|w| w.at >= from);
        later.find(|w| matches!(w.entry.event, Any::Instrument(Note::Restarted { node: n, .. }) if n == node))
    };
    ended.map(|w| (w.at, again(w.at).map_or(Micros::MAX, |w| w.at))).collect()
}

/// True if `node` did not live at that time.
pub(crate) fn is_dead(evidence: &Evidence, node: NodeId, at: Micros) -> bool {
    dead(evidence, node).iter().any(|(from, to)| (*from..*to).contains(&at))
}

/// True if a process left no mark in that time: no entry of its own, no input of its core. The broker, which leaves none, is
/// heard of by the bytes that clients' ingresses saw come out of it.
pub(crate) fn silent(evidence: &Evidence, node: NodeId, (from, to): Span) -> bool {
    let from = from.saturating_add(LAST_WORDS);
    !evidence.entries.iter().filter(|w| w.at > from && w.at < to.min(evidence.duration)).any(|w| match w.entry.event {
        Any::Instrument(Note::StreamSaw { sight: Sight::Delivered, .. }) if node == NodeId::BROKER => true,
        _ => leaves(w, node),
    })
}

/// True if an entry is a mark of that process.
fn leaves(w: &Witnessed, node: NodeId) -> bool {
    match w.entry.event {
        Any::Instrument(Note::Ran { node: ran }) => ran == node && w.entry.node == NodeId::CAMPAIGN,
        _ => w.entry.node == node,
    }
}

/// A kill counts when the dead wrote no more. Of the broker the unit's ingress has to see its own end.
pub(crate) fn killed(evidence: &Evidence, wanted: NodeId, window: Window) -> Option<Micros> {
    let silent = |at: Micros| {
        let mut of = evidence.entries.iter().filter(|w| w.entry.node == wanted);
        // Who is started again speaks under another boot.
        let boot = of.clone().take_while(|w| w.at <= at).last().map(|w| w.entry.boot);
        !of.any(|w| Some(w.entry.boot) == boot && w.at > at + LAST_WORDS)
    };
    let dead = |at: Micros| silent(at) && (wanted != NodeId::BROKER || cut_off(evidence, at, evidence.duration));
    let ends = |w: &&Witnessed| matches!(w.entry.event, Any::Instrument(Note::Ended { node, killed: true, .. }) if node == wanted);
    evidence.entries.iter().filter(ends).map(|w| w.at).find(|at| window.has(*at) && dead(*at))
}

/// True if the unit's ingress saw its stream to the broker end.
fn cut_off(evidence: &Evidence, from: Micros, to: Micros) -> bool {
    evidence.entries.iter().any(|w| {
        let ended =
            matches!(w.entry.event, Any::Instrument(Note::StreamSaw { sight: Sight::Closed | Sight::HungUp, .. }));
        Some(w.entry.node) == evidence.under.guard() && ended && w.at >= from && w.at < to
    })
}

/// That a process was kept from running counts when it left marks before and, unless it was ended then, after, none while it was stopped,
/// and would have left some: by how often it did otherwise.
pub(crate) fn suspended(evidence: &Evidence, wanted: NodeId, window: Window) -> Option<Micros> {
    let mut begins = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Instrument(Note::Suspended { node, how, on: true }) if node == wanted && window.has(w.at) => {
            Some((w.at, how))
        }
        _ => None,
    });
    let (from, how) = begins.next()?;
    let over = |w: &&Witnessed| {
        w.at > from
            && matches!(w.entry.event, Any::Instrument(Note::Suspended { node, on: false, .. }) if node == wanted)
    };
    // At the end of a run everybody is let go on; the dead are not.
    let died = dead(evidence, wanted).into_iter().map(|(at, _)| at).find(|at| *at > from).unwrap_or(Micros::MAX);
    let to = evidence.entries.iter().find(over).map_or(evidence.duration, |w| w.at.min(evidence.duration)).min(died);
    let stops = match how {
        Suspension::Hang => vec![(from, to)],
        Suspension::Slow { .. } => halts(evidence, wanted, (from, to)),
    };
    let broker = wanted == NodeId::BROKER;
    let was = if broker { held_up(evidence, &stops) } else { stood_still(evidence, wanted, &stops, died) };
    was.then_some(from)
}

/// That the recorder's disk was full counts when the recording grew before, and did not from then on although there was
/// something to write; and grew again where there was room again before the end.
pub(crate) fn filled(evidence: &Evidence, wanted: NodeId, window: Window) -> Option<Micros> {
    let told = |wanted_on: bool, after: Micros| {
        let turned = move |w: &&Witnessed| match w.entry.event {
            Any::Instrument(Note::DiskFull { node, on }) => node == wanted && on == wanted_on && w.at >= after,
            _ => false,
        };
        evidence.entries.iter().filter(turned).map(|w| w.at)
    };
    let from = told(true, 0).find(|at| window.has(*at))?;
    let freed = told(false, from).find(|at| *at < evidence.duration);
    let to = freed.unwrap_or(evidence.duration);
    let quiet = from + LAST_WORDS;
    let grew = |from: Micros, to: Micros| {
        let kept = |w: &Witnessed| {
            matches!(w.entry.event, Any::Instrument(Note::Kept { .. })) && w.entry.node == NodeId::CAMPAIGN
        };
        evidence.entries.iter().any(|w| w.at > from && w.at < to && kept(w))
    };
    let due = |w: &&Witnessed| w.at > quiet && w.at < to && w.entry.node != wanted && by_recorder(w.entry.node);
    let something = evidence.entries.iter().filter(due).count() as u64 >= TELLING;
    let again = freed.is_none_or(|at| grew(at, at.saturating_add(AROUND)));
    (grew(from.saturating_sub(AROUND), from) && something && !grew(quiet, to) && again).then_some(from)
}

/// The stops of a slow process within `span`.
fn halts(evidence: &Evidence, wanted: NodeId, span: Span) -> Vec<Span> {
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
    // Who was stopped to the end of the run still closes its account.
    let around = (first.0.saturating_sub(AROUND), last.1.saturating_add(AROUND));
    let marks = evidence.entries.iter().filter(|w| leaves(w, wanted));
    let marks: Vec<Micros> = marks.map(|w| w.at).filter(|at| *at >= around.0 && *at <= around.1).collect();
    // What was on its way when it was stopped may still come out; what comes as it goes on is its own again.
    let within = |at: &Micros| stops.iter().any(|(from, to)| *at > from + UNDER_WAY && at < to);
    let stopped: Micros = stops.iter().map(|(from, to)| to.saturating_sub(from + UNDER_WAY)).sum();
    let ran = (around.1 - around.0).saturating_sub(stopped).max(1);
    let missing = marks.len() as u64 * stopped / ran;
    let after = || last.1 == died || marks.last().is_some_and(|at| *at >= last.1);
    let lived = marks.first().is_some_and(|at| *at <= first.0) && after();
    lived && missing >= TELLING && !marks.iter().any(within)
}

/// True if publications to the broker while it was stopped came out of it after that, and none came out meanwhile; or
/// the unit gave it up.
fn held_up(evidence: &Evidence, stops: &[Span]) -> bool {
    let delivered =
        |w: &Witnessed| matches!(w.entry.event, Any::Instrument(Note::StreamSaw { sight: Sight::Delivered, .. }));
    let given = |w: &Witnessed| match w.entry.event {
        Any::Service(Event::Staged { stage: CommandStage::Sent, .. }) => w.entry.node == NodeId::GATEWAY,
        Any::Service(Event::Executed { .. }) => w.entry.node == evidence.under.node(),
        _ => false,
    };
    let any = |test: &dyn Fn(&Witnessed) -> bool, from: Micros, to: Micros| {
        evidence.entries.iter().any(|w| w.at > from && w.at < to && test(w))
    };
    let held = |(from, to): &Span| any(&given, *from, *to) && any(&delivered, to - 1, to.saturating_add(AROUND));
    let came = stops.iter().any(|(from, to)| any(&delivered, from + UNDER_WAY, *to));
    let gave_up = |(from, to): &Span| cut_off(evidence, *from, to.saturating_add(AROUND).min(evidence.duration));
    !came && stops.iter().any(held) || stops.iter().any(gave_up)
}
