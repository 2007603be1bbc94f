//! The record filters of a twin as witnesses: the sights of each, in its own log, and its closing account.
//!
//! Their judgement is the live guard's own (`link::guard`); the consequences are `sessions`' business.

use std::collections::VecDeque;

use ground_truth::{GuardVerdict, Note};
use link::guard::record::{Split, split};
use minicbor::Encode;
use wire::audit::Journal;
use wire::event::{Account, Event, wire_hash};
use wire::id::NodeId;
use wire::sign::Key;

use super::Twin;
use super::net::{Association, Outside};
use super::queue::{Micros, NodeIndex};

/// The association of a datagram that belongs to none.
pub const UNKNOWN_PEER: u32 = u32::MAX;
/// The record filter in front of one node's sessions, as its own witness.
#[derive(Clone)]
pub(super) struct Guard {
    pub(super) id: NodeId,
    pub(super) journal: Journal,
    /// Datagrams that came.
    pub(super) datagrams: u64,
    /// Records in them.
    pub(super) seen: u64,
    pub(super) refused: u64,
    pub(super) delivered: u64,
    pub(super) discarded: u64,
    pub(super) handshake: u64,
    /// Datagrams for which there was no room while the process did not run.
    pub(super) kernel_dropped: u64,
    /// End of the unknown peer's handshake, at the latest.
    pub(super) half_open: Micros,
}

impl Guard {
    pub(super) fn new(id: NodeId, key: Option<Key>) -> Guard {
        let journal = Journal::new(id, wire::id::Boot(1), key);
        Guard {
            id,
            journal,
            datagrams: 0,
            seen: 0,
            refused: 0,
            delivered: 0,
            discarded: 0,
            handshake: 0,
            kernel_dropped: 0,
            half_open: 0,
        }
    }
}

impl Twin {
    pub(super) fn count_unknown_peer(&mut self, node: NodeIndex, bytes: &[u8], verdict: GuardVerdict) {
        if let Some(guard) = &mut self.guards[usize::from(node)] {
            guard.seen += 1;
            if verdict == GuardVerdict::Passed { guard.handshake += 1 } else { guard.refused += 1 }
        }
        self.note_unknown_peer(node, bytes, verdict);
    }

    pub(super) fn note_unknown_peer(&mut self, node: NodeIndex, bytes: &[u8], verdict: GuardVerdict) {
        let outside = split(bytes).next().map_or_else(Outside::default, |piece| match piece {
            Split::Record(raw) => Outside { epoch: raw.epoch, sequence: raw.sequence },
            Split::Remainder(_) => Outside::default(),
        });
        self.note_guard(node, saw(UNKNOWN_PEER, outside, bytes, verdict));
    }

    pub(super) fn observe(
        &mut self,
        node: NodeIndex,
        association: u32,
        outside: Outside,
        bytes: &[u8],
        verdict: GuardVerdict,
    ) {
        if let Some(guard) = &mut self.guards[usize::from(node)] {
            guard.seen += 1;
        }
        self.note_guard(node, saw(association, outside, bytes, verdict));
    }

    pub(super) fn note_guard(&mut self, node: NodeIndex, event: impl Encode<()>) {
        let time = self.local(node);
        let Some(guard) = &mut self.guards[usize::from(node)] else { return };
        let mut out = VecDeque::new();
        guard.journal.write(time, event, &mut out);
        let id = guard.id;
        self.record_all(id, out);
    }

    pub(super) fn close_guard(&mut self, node: NodeIndex) {
        let direct = self.sent_direct(node);
        let Some(g) = &self.guards[usize::from(node)] else { return };
        if self.nodes[usize::from(node)].alive {
            let counts = [
                (Account::GuardIn, g.seen),
                (Account::GuardRefused, g.refused),
                (Account::Delivered, g.delivered),
                (Account::Discarded, g.discarded),
                (Account::Datagrams, g.datagrams),
                (Account::SentDirect, direct),
                (Account::Handshake, g.handshake),
            ];
            let dropped = Some((Account::KernelDropped, g.kernel_dropped)).filter(|(_, n)| *n > 0);
            counts
                .into_iter()
                .chain(dropped)
                .for_each(|(account, n)| self.note_guard(node, Event::Count { account, n }));
        }
    }

    /// Every guard that saw something, and the launcher, signs its chain for the last time.
    pub(super) fn sign_witnesses(&mut self) {
        for node in 0..self.nodes.len() {
            let time = self.local(node as NodeIndex);
            let Some(guard) = self.guards[node].as_mut().filter(|guard| guard.journal.counter() > 0) else { continue };
            let (id, mut out) = (guard.id, VecDeque::new());
            guard.journal.sign(time, &mut out);
            self.record_all(id, out);
        }
        self.sign_broker_ingress();
        self.sign_notes();
    }

    /// Datagrams of `node` to the gateway with no relay in between.
    pub(super) fn sent_direct(&self, node: NodeIndex) -> u64 {
        let to_gateway = |a: &&Association| {
            a.relay.is_none() && a.ends[0].node == node && self.nodes[usize::from(a.ends[1].node)].id == NodeId::GATEWAY
        };
        self.associations.iter().filter(to_gateway).map(|a| a.sent_by_client()).sum()
    }
}

/// Entry of a record filter's log about one record.
fn saw(association: u32, outside: Outside, bytes: &[u8], verdict: GuardVerdict) -> Note {
    Note::GuardSaw {
        association,
        epoch: outside.epoch,
        sequence: outside.sequence,
        length: bytes.len().min(usize::from(u16::MAX)) as u16,
        hash: wire_hash(bytes),
        verdict,
    }
}
