//! The delivery witness of an insider's claimed messages, and of the readings that the sim says a fault changed: the inputs of the core
//! that they were for.
//!
//! Such bytes are those of the protocol, so no guard can tell them from others. The inputs of every core are known
//! outside it: live its process keeps an input journal, in the twin the engine feeds it. Here the two are read by one rule: an
//! input with bytes of the hash that an actor named is its delivery. A core's own word is not asked. And a process that is
//! said not to run takes no input in ([`Running`]).

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

    /// Sight of `reader` in `input`, when it was claimed and `reader` is no insider.
    pub fn delivered(&self, reader: NodeId, input: &Input) -> Option<Note> {
        if self.0.is_empty() || reader.is_insider() {
            return None;
        }
        let (at, bytes) = match input {
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
        self.0.contains(&hash).then_some(Note::MouthSaw { reader, at, length, hash })
    }
}

/// Spacing at which it is told that one core runs, microseconds.
const APART_US: u64 = 5_000;

/// Which cores are watched for being fed, and when that was told last.
#[derive(Clone, Debug, Default)]
pub struct Running(BTreeMap<NodeId, Option<u64>>);

impl Running {
    /// Watches these.
    pub fn new(watched: &[NodeId]) -> Self {
        Self(watched.iter().map(|node| (*node, None)).collect())
    }

    /// True if it is to be told that the core of `node` was fed at `at`.
    pub fn told(&mut self, node: NodeId, at: u64) -> bool {
        let Some(last) = self.0.get_mut(&node) else { return false };
        let tell = last.is_none_or(|last| at >= last + APART_US);
        if tell {
            *last = Some(at);
        }
        tell
    }
}
