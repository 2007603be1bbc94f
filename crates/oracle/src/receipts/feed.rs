//! Receipts of a gateway insider's actions between the gateway and the console.
//!
//! Its messages have the witness that every insider's bytes have (`delivery`). A withheld message is told by the report or the
//! command that it was about, against the honest half's acceptance and the display.

use evidence::{Evidence, Micros, Witnessed};
use instrument::{Action, Any, Note};
use wire::event::Event;
use wire::id::{CommandId, NodeId, RecordId};

use crate::delivery;
use crate::window::Window;

/// Longest time from the insider's entry to the console's own about the same message.
const AT_ONCE: Micros = 100_000;
/// By how much of a delay the insider's clock may have run ahead of the trace's, as a divisor.
const DRIFT: u64 = 1_000;

/// The first action of this kind on the feed, within `window`, that a witness confirms.
pub(crate) fn feed(evidence: &Evidence, wanted: Action, window: Window) -> Option<Micros> {
    match wanted {
        Action::Drop => withheld(evidence, window),
        _ => delivery::receipt(evidence, wanted, window, &[NodeId::INSIDER_GATEWAY]),
    }
}

/// The reports that the insider says it kept, and that the honest half had accepted.
fn kept(evidence: &Evidence, window: Window) -> impl Iterator<Item = (Micros, RecordId)> {
    let told = evidence.entries.iter().filter_map(move |w| match w.entry.event {
        Any::Instrument(Note::Withheld { record }) if w.entry.node == NodeId::INSIDER_GATEWAY && window.has(w.at) => {
            Some((w.at, record))
        }
        _ => None,
    });
    told.filter(|(at, record)| accepted(evidence, *record, *at))
}

/// True if the display was told to be without `record` in that time, when it had long been due.
fn lacked(evidence: &Evidence, record: RecordId, (from, to): (Micros, Micros)) -> bool {
    shown(evidence).any(|(at, shown)| at >= from + AT_ONCE && at < to && shown < record)
}

/// The first report that was kept for good: never shown.
fn withheld(evidence: &Evidence, window: Window) -> Option<Micros> {
    let mut kept = kept(evidence, window);
    let never = |wanted: RecordId| shown(evidence).all(|(_, shown)| shown != wanted);
    kept.find(|(at, record)| never(*record) && lacked(evidence, *record, (*at, Micros::MAX))).map(|(at, _)| at)
}

/// The first report that was kept for so long and then passed on: not shown before it was due, and the display was without
/// it until then; the insider's message when it was due came in at the console.
pub(crate) fn late(evidence: &Evidence, by: Micros, window: Window) -> Option<Micros> {
    let sent = delivery::times(evidence, Action::Delay, &[NodeId::INSIDER_GATEWAY]);
    let confirmed = |at: Micros, record: RecordId| {
        let due = at + by - by / DRIFT;
        let early = shown(evidence).any(|(when, shown)| shown == record && when < due);
        let came = sent.iter().any(|seen| *seen >= due && *seen <= at + by + AT_ONCE);
        !early && came && (by <= AT_ONCE || lacked(evidence, record, (at, due)))
    };
    kept(evidence, window).find(|(at, record)| confirmed(*at, *record)).map(|(at, _)| at)
}

/// The first command that the insider says it swallowed within `window`, that the operator gave and the gateway never heard of.
pub(crate) fn swallowed(evidence: &Evidence, window: Window) -> Option<Micros> {
    let told = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Instrument(Note::Swallowed { command }) if w.entry.node == NodeId::INSIDER_GATEWAY && window.has(w.at) => {
            Some((w.at, command))
        }
        _ => None,
    });
    told.into_iter()
        .find(|(at, command)| given(evidence, *command, *at) && !staged(evidence, *command))
        .map(|(at, _)| at)
}

fn given(evidence: &Evidence, wanted: CommandId, by: Micros) -> bool {
    evidence.entries.iter().any(
        |w| matches!(
            w.entry.event,
            Any::Service(Event::Intended { command, .. }) if command == wanted && w.at <= by && w.entry.node == NodeId::CONSOLE
        ),
    )
}

fn staged(evidence: &Evidence, wanted: CommandId) -> bool {
    let gateway = |w: &&Witnessed| w.entry.node == NodeId::GATEWAY;
    let mut entries = evidence.entries.iter().filter(gateway);
    entries.any(|w| matches!(w.entry.event, Any::Service(Event::Staged { command, .. }) if command == wanted))
}

fn accepted(evidence: &Evidence, wanted: RecordId, by: Micros) -> bool {
    let gateway = |w: &&Witnessed| w.entry.node == NodeId::GATEWAY && w.at <= by;
    let mut entries = evidence.entries.iter().filter(gateway);
    entries.any(|w| matches!(w.entry.event, Any::Service(Event::Accepted { record, .. }) if record == wanted))
}

/// Displays of the unit under test, with their times.
fn shown(evidence: &Evidence) -> impl Iterator<Item = (Micros, RecordId)> {
    evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Service(Event::Displayed { unit, report, .. }) if unit == evidence.under.unit => Some((w.at, report)),
        _ => None,
    })
}
