//! Receipts of a gateway insider's actions between the gateway and the console.
//!
//! Its messages have the witness that every insider's bytes have (`delivery`). A withheld message is known by the report or the
//! command in it, and held against the honest half's acceptance and the display.

use evidence::{Evidence, Micros, Witnessed};
use ground_truth::{Action, Any, Note};
use wire::event::Event;
use wire::id::{CommandId, NodeId, RecordId};

use super::delivery;
use super::window::Window;
use crate::facts::Span;

/// Longest time from the insider's entry to the console's own about the same message.
const AT_ONCE: Micros = 100_000;
/// Part of a delay by which the insider's clock may have run ahead of the trace's, as a divisor.
const DRIFT: u64 = 1_000;

/// The first action of this kind on the feed, within `window`, that a witness confirms.
pub(crate) fn receipt(evidence: &Evidence, wanted: Action, window: Window) -> Option<Micros> {
    match wanted {
        Action::Drop => withheld_for_good(evidence, window),
        _ => delivery::receipt(evidence, wanted, window, &[NodeId::INSIDER_GATEWAY]),
    }
}

/// Reports that the insider says it withheld, and that the honest half had accepted.
fn withheld_reports(evidence: &Evidence, window: Window) -> impl Iterator<Item = (Micros, RecordId)> {
    let claims = evidence.entries.iter().filter_map(move |w| match w.entry.event {
        Any::Instrument(Note::Withheld { record })
            if w.entry.node == NodeId::INSIDER_GATEWAY && window.contains(w.at) =>
        {
            Some((w.at, record))
        }
        _ => None,
    });
    claims.filter(|(withheld_at, record)| gateway_accepted(evidence, *record, *withheld_at))
}

/// True if the display was without `record` in that time, when it had long been due.
fn display_lacked(evidence: &Evidence, record: RecordId, (from, to): Span) -> bool {
    displayed_reports(evidence)
        .any(|(displayed_at, shown)| displayed_at >= from + AT_ONCE && displayed_at < to && shown < record)
}

/// The first report that was withheld and never shown.
fn withheld_for_good(evidence: &Evidence, window: Window) -> Option<Micros> {
    let mut withheld = withheld_reports(evidence, window);
    let never_shown = |wanted: RecordId| displayed_reports(evidence).all(|(_, shown)| shown != wanted);
    withheld
        .find(|(withheld_at, record)| {
            never_shown(*record) && display_lacked(evidence, *record, (*withheld_at, Micros::MAX))
        })
        .map(|(withheld_at, _)| withheld_at)
}

/// The first report that was withheld for `delay` and then passed on: not shown before it was due, and the display was without
/// it until then; the insider's message when it was due came in at the console.
pub(crate) fn delayed_report_at(evidence: &Evidence, delay: Micros, window: Window) -> Option<Micros> {
    let taken_in = delivery::taken_in(evidence, Action::Delay, &[NodeId::INSIDER_GATEWAY]);
    let confirmed = |withheld_at: Micros, record: RecordId| {
        let due = withheld_at + delay - delay / DRIFT;
        let shown_early =
            displayed_reports(evidence).any(|(displayed_at, shown)| shown == record && displayed_at < due);
        let came_when_due =
            taken_in.iter().any(|taken_at| *taken_at >= due && *taken_at <= withheld_at + delay + AT_ONCE);
        // A delay that short leaves no time in which the display could be seen without the report.
        !shown_early && came_when_due && (delay <= AT_ONCE || display_lacked(evidence, record, (withheld_at, due)))
    };
    withheld_reports(evidence, window)
        .find(|(withheld_at, record)| confirmed(*withheld_at, *record))
        .map(|(withheld_at, _)| withheld_at)
}

/// The first command that the insider says it swallowed within `window`, that the operator gave and the gateway never heard of.
pub(crate) fn swallowed_command_at(evidence: &Evidence, window: Window) -> Option<Micros> {
    let claims = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Instrument(Note::Swallowed { command })
            if w.entry.node == NodeId::INSIDER_GATEWAY && window.contains(w.at) =>
        {
            Some((w.at, command))
        }
        _ => None,
    });
    claims
        .into_iter()
        .find(|(swallowed_at, command)| {
            operator_gave(evidence, *command, *swallowed_at) && !gateway_staged(evidence, *command)
        })
        .map(|(swallowed_at, _)| swallowed_at)
}

fn operator_gave(evidence: &Evidence, wanted: CommandId, until: Micros) -> bool {
    evidence.entries.iter().any(
        |w| matches!(
            w.entry.event,
            Any::Service(Event::Intended { command, .. }) if command == wanted && w.at <= until && w.entry.node == NodeId::CONSOLE
        ),
    )
}

fn gateway_staged(evidence: &Evidence, wanted: CommandId) -> bool {
    let gateway = |w: &&Witnessed| w.entry.node == NodeId::GATEWAY;
    let mut entries = evidence.entries.iter().filter(gateway);
    entries.any(|w| matches!(w.entry.event, Any::Service(Event::Staged { command, .. }) if command == wanted))
}

fn gateway_accepted(evidence: &Evidence, wanted: RecordId, until: Micros) -> bool {
    let gateway = |w: &&Witnessed| w.entry.node == NodeId::GATEWAY && w.at <= until;
    let mut entries = evidence.entries.iter().filter(gateway);
    entries.any(|w| matches!(w.entry.event, Any::Service(Event::Accepted { record, .. }) if record == wanted))
}

/// Displays of the unit under test, with their times.
fn displayed_reports(evidence: &Evidence) -> impl Iterator<Item = (Micros, RecordId)> {
    evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Service(Event::Displayed { unit, report, .. }) if unit == evidence.under.unit => Some((w.at, report)),
        _ => None,
    })
}
