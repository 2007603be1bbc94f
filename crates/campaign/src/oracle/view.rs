//! Receipts of what a gateway insider did between the gateway and the console.
//!
//! What it said has the witness that every insider's bytes have (`mouth`). What it kept back is told by the report or the
//! command that it was about, against what the honest half accepted and what the display showed.

use wire::event::{Action, Event};
use wire::id::{CommandId, NodeId, RecordId, UnitId};

use super::{Evidence, Micros, Witnessed, mouth};

/// Longest time from the insider's entry to the console's own about the same message.
const AT_ONCE: Micros = 100_000;

/// The first deed of this kind on the feed that a witness confirms.
pub(super) fn feed(evidence: &Evidence, wanted: Action) -> Option<Micros> {
    match wanted {
        Action::Drop => withheld(evidence),
        // Told when its bytes go out; what was done to it began when it was taken.
        Action::Delay => mouth::receipt(evidence, wanted, 1).map(|at| at.saturating_sub(longest_delay(evidence, at))),
        _ => mouth::receipt(evidence, wanted, 1),
    }
}

/// The first report that the insider says it withheld, that the honest half had accepted, and that the display lacked: never
/// shown, and told to be without it when it had long been due.
fn withheld(evidence: &Evidence) -> Option<Micros> {
    let mut told = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Event::Withheld { record } if w.entry.node == NodeId::INSIDER_GATEWAY => Some((w.at, record)),
        _ => None,
    });
    told.find(|(at, record)| {
        let mut shown = shown(evidence);
        let lacked = |(when, shown): (Micros, RecordId)| when >= at + AT_ONCE && shown < *record;
        accepted(evidence, *record, *at)
            && shown.all(|(_, shown)| shown != *record)
            && self::shown(evidence).any(lacked)
    })
    .map(|(at, _)| at)
}

fn longest_delay(evidence: &Evidence, told: Micros) -> Micros {
    let delays = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Event::Attack { action: Action::Delay, delay, .. }
            if w.entry.node == NodeId::INSIDER_GATEWAY && w.at == told =>
        {
            Some(delay.0)
        }
        _ => None,
    });
    delays.max().unwrap_or_default()
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

/// What the display showed of the unit under test, and when.
fn shown(evidence: &Evidence) -> impl Iterator<Item = (Micros, RecordId)> {
    evidence.entries.iter().filter_map(|w| match w.entry.event {
        Event::Displayed { unit: UnitId::A, report, .. } => Some((w.at, report)),
        _ => None,
    })
}
