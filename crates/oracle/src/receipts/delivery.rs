//! Receipts of the messages of an insider, or of a sensor under a fault: the actor's own entry against the inputs of
//! the core that they were for.
//!
//! The two share the hash of the very bytes (`evidence::delivery`). That some record of the insider's arrived is none: an honest
//! one of its own would do for that.

use evidence::{Evidence, Micros};
use instrument::{Action, Any, Note};
use wire::event::{Account, Event, Interface};
use wire::id::{Boot, NodeId};
use wire::refusal::Reason;

use crate::window::Window;

/// Time after a message within which the verdict over it is in the log.
const VERDICT: Micros = 5_000;

/// The first entry within `window` of this `action` by one of `who` with bytes that a core took in afterwards.
pub(crate) fn receipt(evidence: &Evidence, wanted: Action, window: Window, who: &[NodeId]) -> Option<Micros> {
    let mut claims = claims(evidence, wanted, who).filter(|(at, _)| window.has(*at));
    claims.find(|(at, hash)| seen(evidence).any(|s| s.hash == *hash && s.at >= *at)).map(|(at, _)| at)
}

/// Times at which a core took in bytes that one of `who` says it sent as its `action`.
pub(crate) fn times(evidence: &Evidence, wanted: Action, who: &[NodeId]) -> Vec<Micros> {
    let claims = claims(evidence, wanted, who);
    claims.flat_map(|(at, hash)| seen(evidence).filter(move |s| s.hash == hash && s.at >= at)).map(|s| s.at).collect()
}

/// True if the core of `reader` took in, at `from` or later, bytes with this hash.
pub(crate) fn took(evidence: &Evidence, reader: NodeId, hash: u64, from: Micros) -> bool {
    seen(evidence).any(|s| s.reader == reader && s.hash == hash && s.at >= from)
}

fn claims(evidence: &Evidence, wanted: Action, who: &[NodeId]) -> impl Iterator<Item = (Micros, u64)> {
    evidence.entries.iter().filter_map(move |w| match w.entry.event {
        Any::Instrument(Note::Attack { action, hash, .. }) if action == wanted && who.contains(&w.entry.node) => {
            Some((w.at, hash))
        }
        _ => None,
    })
}

/// True if a reader of shared memory refused, from `zero` on, a message that an insider had put there.
pub(crate) fn refused_on_the_bus(evidence: &Evidence, zero: Micros) -> bool {
    let answers = |s: &Seen| {
        evidence.entries.iter().any(|w| match w.entry.event {
            // Of an older boot is the one whose place a rogue took, not the rogue.
            Any::Service(Event::Refused { reason: Reason::Epoch, .. }) => false,
            Any::Service(Event::Refused { at, .. }) => {
                at == s.interface && w.entry.node == s.reader && w.at >= s.at && w.at - s.at <= VERDICT
            }
            _ => false,
        })
    };
    let on_the_bus = |s: &Seen| s.at >= zero && matches!(s.interface, Interface::Bus(_));
    seen(evidence).filter(on_the_bus).any(|s| answers(&s) || unwritten(evidence, &s))
}

/// True if the reader refused more at this interface than it logged (`wire::account::WRITTEN_REFUSALS`), and had come so
/// far that it logged no more: then its closing account tells.
fn unwritten(evidence: &Evidence, s: &Seen) -> bool {
    let of_reader = || evidence.entries.iter().filter(|w| w.entry.node == s.reader);
    let counts = of_reader().filter_map(|w| match w.entry.event {
        Any::Service(Event::Count { account: Account::Refused(at, reason), n })
            if at == s.interface && reason != Reason::Epoch =>
        {
            Some((w.entry.boot, n))
        }
        _ => None,
    });
    let counts: Vec<(Boot, u64)> = counts.collect();
    let Some(boot) = counts.iter().map(|(boot, _)| *boot).max() else { return false };
    let counted: u64 = counts.iter().filter(|(of, _)| *of == boot).map(|(_, n)| n).sum();
    let written = of_reader().filter(|w| w.entry.boot == boot).filter_map(|w| match w.entry.event {
        Any::Service(Event::Refused { at, reason, .. }) if at == s.interface => Some((w.at, reason != Reason::Epoch)),
        _ => None,
    });
    let (written, last) =
        written.fold((0, 0), |(n, last), (at, counts)| (n + u64::from(counts), Micros::max(last, at)));
    counted > written && s.at >= last
}

/// Delivery at a core's input.
struct Seen {
    at: Micros,
    reader: NodeId,
    interface: Interface,
    hash: u64,
}

fn seen(evidence: &Evidence) -> impl Iterator<Item = Seen> {
    evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Instrument(Note::MouthSaw { reader, at, hash, .. }) if w.entry.node == NodeId::CAMPAIGN => {
            Some(Seen { at: w.at, reader, interface: at, hash })
        }
        _ => None,
    })
}
