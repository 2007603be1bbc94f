//! Messages that the campaign saw at the inputs of cores, by the hash of their bytes.

use evidence::{Evidence, Micros};
use ground_truth::{Any, Note};
use wire::event::{Account, Event, Interface};
use wire::id::{Boot, NodeId};
use wire::refusal::Reason;

/// Time after a message within which the verdict over it is in the log.
const VERDICT_WITHIN: Micros = 5_000;

/// A message at the input of a core.
pub(crate) struct CoreInput {
    /// Time of the entry.
    pub at: Micros,
    /// Core that took it in.
    pub reader: NodeId,
    /// Interface at which it did.
    pub interface: Interface,
    /// Hash of the bytes.
    pub hash: u64,
}

/// Messages at every input, in order.
pub(crate) fn core_inputs(evidence: &Evidence) -> impl Iterator<Item = CoreInput> {
    evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Instrument(Note::MouthSaw { reader, at: interface, hash, .. }) if w.entry.node == NodeId::CAMPAIGN => {
            Some(CoreInput { at: w.at, reader, interface, hash })
        }
        _ => None,
    })
}

/// True if the core of `reader` took in, at `from` or later, bytes with this hash.
pub(crate) fn core_took(evidence: &Evidence, reader: NodeId, hash: u64, from: Micros) -> bool {
    core_inputs(evidence).any(|input| input.reader == reader && input.hash == hash && input.at >= from)
}

/// True if a reader of shared memory refused, from `zero` on, a message that an insider had put there.
pub(crate) fn insider_refused_on_bus(evidence: &Evidence, zero: Micros) -> bool {
    let answered = |input: &CoreInput| {
        evidence.entries.iter().any(|w| match w.entry.event {
            // A message of an older boot is that of the one whose place a rogue took, not the rogue's.
            Any::Service(Event::Refused { reason: Reason::Epoch, .. }) => false,
            Any::Service(Event::Refused { at: interface, .. }) => {
                interface == input.interface
                    && w.entry.node == input.reader
                    && w.at >= input.at
                    && w.at - input.at <= VERDICT_WITHIN
            }
            _ => false,
        })
    };
    let on_bus = |input: &CoreInput| input.at >= zero && matches!(input.interface, Interface::Bus(_));
    core_inputs(evidence).filter(on_bus).any(|input| answered(&input) || refused_unwritten(evidence, &input))
}

/// True if the reader refused more at this interface than it logged (`wire::account::WRITTEN_REFUSALS`), and had
/// reached the bound beyond which it logs none: its closing account then has more refusals than its log.
fn refused_unwritten(evidence: &Evidence, input: &CoreInput) -> bool {
    let by_reader = || evidence.entries.iter().filter(|w| w.entry.node == input.reader);
    let counts = by_reader().filter_map(|w| match w.entry.event {
        Any::Service(Event::Count { account: Account::Refused(interface, reason), n })
            if interface == input.interface && reason != Reason::Epoch =>
        {
            Some((w.entry.boot, n))
        }
        _ => None,
    });
    let counts: Vec<(Boot, u64)> = counts.collect();
    // Each boot has its account and its bound of logged refusals, so that numbers of two boots do not compare.
    let Some(last_boot) = counts.iter().map(|(boot, _)| *boot).max() else { return false };
    let counted: u64 = counts.iter().filter(|(boot, _)| *boot == last_boot).map(|(_, n)| n).sum();
    let written = by_reader().filter(|w| w.entry.boot == last_boot).filter_map(|w| match w.entry.event {
        Any::Service(Event::Refused { at: interface, reason, .. }) if interface == input.interface => {
            Some((w.at, reason != Reason::Epoch))
        }
        _ => None,
    });
    let (written, last) =
        written.fold((0, 0), |(n, last), (time, is_counted)| (n + u64::from(is_counted), Micros::max(last, time)));
    // Up to its last logged refusal the reader logged every one, and this input would have an entry.
    counted > written && input.at >= last
}
