//! Receipts of the relay's actions on a datagram: the guard's log shows its very bytes, or that they never came.

use evidence::{Evidence, Micros};
use ground_truth::{Action, Any, GuardVerdict, Note};
use wire::core::Side;
use wire::event::{Account, Event};
use wire::id::NodeId;

use super::window::Window;
use crate::facts::link;

/// Longest time within which a guard logs the pieces of one datagram, and for which a datagram is on its way.
const TOGETHER: Micros = 500;
const ON_THE_WAY: Micros = 200_000;
/// Delay of a link by itself; so short a delay is no evidence.
const LEAST_DELAY: Micros = 10_000;

/// Times at which any guard saw these bytes.
fn guard_saw(evidence: &Evidence, wanted: u64) -> impl Iterator<Item = Micros> {
    evidence.entries.iter().filter_map(move |w| match w.entry.event {
        Any::Instrument(Note::GuardSaw { hash, .. }) if hash == wanted => Some(w.at),
        _ => None,
    })
}

/// The relay's first entry of `action` within `window` with bytes that the target's guard confirms.
pub(crate) fn receipt(evidence: &Evidence, action: Action, window: Window) -> Option<Micros> {
    let entries = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Instrument(Note::Attack { action: a, side, length, hash, delay })
            if a == action && w.entry.node == NodeId::RELAY_TELEMETRY && window.contains(w.at) =>
        {
            Some((w.at, side, length, hash, delay.0))
        }
        _ => None,
    });
    // Only a guard that kept a log and closed its account is a witness of an absence.
    let wrote = |test: &dyn Fn(&Any) -> bool| evidence.entries.iter().any(|w| test(&w.entry.event));
    let guarded = wrote(&|e| matches!(e, Any::Instrument(Note::GuardSaw { .. })))
        && wrote(&|e| matches!(e, Any::Service(Event::Count { account: Account::GuardIn, .. })));
    let confirmed = |(claimed_at, side, length, hash, delay): (Micros, Side, u16, u64, Micros)| match action {
        Action::Drop => {
            guarded && guard_saw(evidence, hash).next().is_none() && link::record_missing(evidence, side, claimed_at)
        }
        Action::Delay | Action::Reorder => {
            delay >= LEAST_DELAY && guard_saw(evidence, hash).any(|seen_at| seen_at >= claimed_at + delay)
        }
        Action::Duplicate | Action::Replay => {
            // The original has the same bytes, so that one sight is no receipt of a copy.
            guard_saw(evidence, hash).any(|seen_at| seen_at >= claimed_at) && guard_saw(evidence, hash).count() > 1
        }
        Action::Corrupt => {
            guard_saw(evidence, hash).any(|seen_at| seen_at >= claimed_at)
                || in_pieces(evidence, claimed_at, side, length)
        }
        Action::Inject | Action::Reoriginate => guard_saw(evidence, hash).any(|seen_at| seen_at >= claimed_at),
        Action::Forward | Action::Kill | Action::Forge | Action::Republish => false,
        Action::Resend | Action::Lie | Action::Confuse => false,
    };
    entries.into_iter().find(|claim| confirmed(*claim)).map(|(claimed_at, ..)| claimed_at)
}

/// True if a guard took a datagram of this length apart, just after `claimed_at`, and refused a piece of it: it logs records, and
/// a datagram made longer or put together of two is no longer one.
fn in_pieces(evidence: &Evidence, claimed_at: Micros, side: Side, length: u16) -> bool {
    let target = if side == Side::Server { NodeId::GATEWAY } else { evidence.under.node() };
    let pieces = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Instrument(Note::GuardSaw { length, verdict, .. })
            if Some(w.entry.node) == target.guard() && w.at >= claimed_at =>
        {
            Some((w.at, u32::from(length), verdict != GuardVerdict::Passed))
        }
        _ => None,
    });
    let pieces: Vec<(Micros, u32, bool)> =
        pieces.take_while(|(seen_at, ..)| *seen_at <= claimed_at + ON_THE_WAY).collect();
    pieces.chunk_by(|a, b| b.0 - a.0 <= TOGETHER).any(|datagram| {
        let whole: u32 = datagram.iter().map(|(_, length, _)| length).sum();
        datagram.len() > 1 && whole == u32::from(length) && datagram.iter().any(|(.., refused)| *refused)
    })
}
