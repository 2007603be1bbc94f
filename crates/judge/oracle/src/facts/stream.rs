//! Bytes of the command streams, as the ingresses at their ends saw them.

use evidence::{Evidence, Micros};
use ground_truth::{Any, Note, Sight};
use wire::id::NodeId;

/// An entry of an ingress.
#[derive(Clone, Copy)]
pub(crate) struct StreamSighting {
    /// Time of the entry.
    pub at: Micros,
    /// Guard that wrote it.
    pub ingress: NodeId,
    /// Kind of the sighting.
    pub sight: Sight,
    /// Direction of a connection, by its name.
    pub stream: u64,
    /// Place of the bytes in it.
    pub offset: u64,
    /// Number of bytes.
    pub length: u32,
    /// Hash of the bytes, or of the payload that came out of them.
    pub hash: u64,
}

/// Sightings of every ingress, in order.
pub(crate) fn sightings(evidence: &Evidence) -> impl Iterator<Item = StreamSighting> {
    evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Instrument(Note::StreamSaw { sight, stream, offset, length, hash }) => {
            Some(StreamSighting { at: w.at, ingress: w.entry.node, sight, stream, offset, length, hash })
        }
        _ => None,
    })
}
