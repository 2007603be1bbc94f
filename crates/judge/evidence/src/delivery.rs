//! The delivery witness of an insider's claimed messages, and of the readings that a fault in the sim changed: the inputs of the core
//! that receives them.
//!
//! Such bytes follow the protocol, so no guard can distinguish them. The inputs of every core are known
//! outside it: live its process keeps an input journal, in the twin the engine feeds it. Both are read here by one rule: an
//! input with bytes of the hash that an actor named is its delivery. The core itself is no source. A process that
//! is noted as stopped takes no input in ([`Running`]).

use std::collections::{BTreeMap, BTreeSet};

use ground_truth::{Any, Entry, Note};
use wire::core::{Input, Subject};
use wire::event::{Interface, wire_hash};
use wire::id::NodeId;

/// The hashes that insiders, and sims under a fault, have named so far.
#[derive(Clone, Debug, Default)]
pub struct Claims(BTreeSet<u64>);

impl Claims {
    /// Takes note of an entry of `node`'s, when it is an insider's claim or a sim's.
    pub fn note(&mut self, node: NodeId, entry: &[u8]) {
        if !node.is_insider() && node != NodeId::SIM {
            return;
        }
        let hash = match Entry::decode(entry) {
            Ok(Entry { event: Any::Instrument(Note::Attack { hash, .. }), .. }) if node.is_insider() => hash,
            Ok(Entry { event: Any::Instrument(Note::Altered { hash, .. }), .. }) if node == NodeId::SIM => hash,
            Ok(_) | Err(_) => return,
        };
        self.0.insert(hash);
    }

    /// True if there is no claim.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The note that `reader` received `input`, when it was claimed and `reader` is no insider.
    pub fn delivered(&self, reader: NodeId, input: &Input) -> Option<Note> {
        if self.0.is_empty() || reader.is_insider() {
            return None;
        }
        let (interface, bytes) = match input {
            Input::Bus { topic, bytes } => (Interface::Bus(*topic), bytes),
            Input::Record { bytes, .. } if reader == NodeId::GATEWAY => (Interface::Uplink, bytes),
            Input::Record { bytes, .. } => (Interface::Downlink, bytes),
            Input::Published { subject: Subject::Command(_), bytes } => (Interface::Commands, bytes),
            Input::Published { subject: Subject::Ack(_), bytes } => (Interface::Acks, bytes),
            Input::Timeout
            | Input::Opened { .. }
            | Input::Closed { .. }
            | Input::Datagram { .. }
            | Input::Stream { .. }
            | Input::Audit { .. }
            | Input::Cue { .. }
            | Input::HostWait { .. }
            | Input::SessionLost
            | Input::Guest { .. }
            | Input::Act { .. }
            | Input::Quiesce
            | Input::Finish => return None,
        };
        let hash = wire_hash(bytes);
        let length = u32::try_from(bytes.len()).unwrap_or(u32::MAX);
        self.0.contains(&hash).then_some(Note::MouthSaw { reader, at: interface, length, hash })
    }
}

/// Interval between two notes that one core runs, microseconds.
const REPORT_INTERVAL_US: u64 = 5_000;

/// Cores whose inputs are watched, each with the time of the last note of one.
#[derive(Clone, Debug, Default)]
pub struct Running(BTreeMap<NodeId, Option<u64>>);

impl Running {
    /// A watch for these cores.
    pub fn new(watched: &[NodeId]) -> Self {
        Self(watched.iter().map(|node| (*node, None)).collect())
    }

    /// True if a note is due that the core of `node` took an input at `time`; the note then counts as written.
    pub fn note_due(&mut self, node: NodeId, time: u64) -> bool {
        let Some(last) = self.0.get_mut(&node) else { return false };
        let is_due = last.is_none_or(|last| time >= last + REPORT_INTERVAL_US);
        if is_due {
            *last = Some(time);
        }
        is_due
    }
}
