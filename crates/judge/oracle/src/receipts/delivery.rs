//! Receipts of the messages of an insider: the actor's own entry against the inputs of the core that they were for.
//!
//! The two share the hash of the very bytes (`evidence::delivery`). The arrival of just any record of the insider is no receipt: an honest
//! record that it sends would be enough for that.

use evidence::{Evidence, Micros};
use ground_truth::{Action, Any, Note};
use wire::id::NodeId;

use super::window::Window;
use crate::facts::core_input::core_inputs;

/// The first entry within `window` of this `action` by one of `actors` with bytes that a core took in afterwards.
pub(crate) fn receipt(evidence: &Evidence, wanted: Action, window: Window, actors: &[NodeId]) -> Option<Micros> {
    let mut claims = claims(evidence, wanted, actors).filter(|(claimed_at, _)| window.contains(*claimed_at));
    claims
        .find(|(claimed_at, hash)| core_inputs(evidence).any(|input| input.hash == *hash && input.at >= *claimed_at))
        .map(|(claimed_at, _)| claimed_at)
}

/// Times at which a core took in bytes that one of `actors` says it sent as its `action`.
pub(crate) fn taken_in(evidence: &Evidence, wanted: Action, actors: &[NodeId]) -> Vec<Micros> {
    let claims = claims(evidence, wanted, actors);
    let inputs_of =
        |(claimed_at, hash)| core_inputs(evidence).filter(move |input| input.hash == hash && input.at >= claimed_at);
    claims.flat_map(inputs_of).map(|input| input.at).collect()
}

/// Entries of `actors` about this action: the time of each, and the hash of the bytes.
fn claims(evidence: &Evidence, wanted: Action, actors: &[NodeId]) -> impl Iterator<Item = (Micros, u64)> {
    evidence.entries.iter().filter_map(move |w| match w.entry.event {
        Any::Instrument(Note::Attack { action, hash, .. }) if action == wanted && actors.contains(&w.entry.node) => {
            Some((w.at, hash))
        }
        _ => None,
    })
}
