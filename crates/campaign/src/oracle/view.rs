//! Receipts of what a gateway insider did between the gateway and the console: its entry, by the report or command it was
//! about, against what the console refused or showed, and what the honest half had accepted.

use wire::core::Topic;
use wire::event::{Action, Event, Interface};
use wire::id::{CommandId, NodeId, RecordId};

use super::{Evidence, Micros, Witnessed};

/// Longest time from the insider's entry to the console's own about the same message.
const AT_ONCE: Micros = 100_000;
/// By how much of a delay the insider's clock may have run ahead of the trace's, as a divisor.
const DRIFT: u64 = 1_000;

/// The first entry of `wanted` that the console confirms.
pub(super) fn feed(evidence: &Evidence, wanted: Action) -> Option<Micros> {
    let told = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Event::Meddled { action, record, delay } if action == wanted && w.entry.node == NodeId::INSIDER_GATEWAY => {
            Some((w.at, record, delay.0))
        }
        _ => None,
    });
    told.into_iter()
        .find(|(at, record, delay)| {
            let due = at + delay - delay / DRIFT;
            let refused = refused(evidence, due, due + delay / DRIFT + AT_ONCE);
            let mut shown = shown(evidence, Some(*record));
            match wanted {
                Action::Drop => {
                    let others = self::shown(evidence, None).next().is_some();
                    others && shown.next().is_none() && accepted(evidence, *record, *at)
                }
                _ => refused || shown.any(|s| s >= due),
            }
        })
        .map(|(at, ..)| at)
}

/// The first command that the insider says it swallowed, that the operator gave and the gateway never heard of.
pub(super) fn swallowed(evidence: &Evidence) -> Option<Micros> {
    let told = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Event::Swallowed { command } if w.entry.node == NodeId::INSIDER_GATEWAY => Some((w.at, command)),
        _ => None,
    });
    told.into_iter()
        .find(|(at, command)| given(evidence, *command, *at) && !staged(evidence, *command))
        .map(|(at, _)| at)
}

fn given(evidence: &Evidence, wanted: CommandId, by: Micros) -> bool {
    evidence.entries.iter().any(
        |w| matches!(w.entry.event, Event::Intended { command, .. } if command == wanted && w.at <= by && w.entry.node == NodeId::CONSOLE),
    )
}

fn staged(evidence: &Evidence, wanted: CommandId) -> bool {
    let gateway = |w: &&Witnessed| w.entry.node == NodeId::GATEWAY;
    let mut entries = evidence.entries.iter().filter(gateway);
    entries.any(|w| matches!(w.entry.event, Event::Staged { command, .. } if command == wanted))
}

fn accepted(evidence: &Evidence, wanted: RecordId, by: Micros) -> bool {
    let gateway = |w: &&Witnessed| w.entry.node == NodeId::GATEWAY && w.at <= by;
    let mut entries = evidence.entries.iter().filter(gateway);
    entries.any(|w| matches!(w.entry.event, Event::Accepted { record, .. } if record == wanted))
}

/// When the display showed this report, or any.
fn shown(evidence: &Evidence, wanted: Option<RecordId>) -> impl Iterator<Item = Micros> {
    evidence.entries.iter().filter_map(move |w| match w.entry.event {
        Event::Displayed { report, .. } if wanted.is_none_or(|wanted| wanted == report) => Some(w.at),
        _ => None,
    })
}

/// Whether the console refused, from `zero` on, what the insider had just told it.
pub(super) fn answered(evidence: &Evidence, zero: Micros) -> bool {
    evidence.entries.iter().any(|w| match w.entry.event {
        Event::Meddled { delay, .. } if w.entry.node == NodeId::INSIDER_GATEWAY => {
            let due = w.at + delay.0 - delay.0 / DRIFT;
            due >= zero && refused(evidence, due, due + delay.0 / DRIFT + AT_ONCE)
        }
        _ => false,
    })
}

/// Whether the console refused a message of the feed between `from` and `to`.
fn refused(evidence: &Evidence, from: Micros, to: Micros) -> bool {
    evidence.entries.iter().any(|w| {
        let feed = matches!(w.entry.event, Event::Refused { at: Interface::Bus(Topic::Feed), .. });
        feed && w.entry.node == NodeId::CONSOLE && (from..=to).contains(&w.at)
    })
}
