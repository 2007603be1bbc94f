//! The audit log: each node chains its own events and signs its chain once a second; the recorder seals them all.
//!
//! An entry holds the SHA-256 of the entry before it, so that an edit, a deletion or a swap breaks the chain at a known
//! place. A chain does not depend on which events there are: services write [`Event`]s, others may write their own.
//! Writing files is left to `link`; judging the meaning of the events, to the oracle.

use core::marker::PhantomData;

use minicbor::{Decode, Encode};
use sha2::{Digest, Sha256};

use crate::bus::{ChannelKey, Sender};
use crate::codec::{self, List, Malformed};
use crate::core::{Core, Input, Output, Topic};
use crate::event::Event;
use crate::id::{Boot, NodeId};
use crate::sign::{Key, Purpose};
use crate::time::{Instant, Span};

/// Longest encoded entry, bytes.
pub const MAX_ENTRY: usize = 512;

/// Period at which a node signs its chain: an entry this long after the last signature has one behind it.
pub const SIGN_PERIOD: Span = Span::s(1);
/// Period at which the recorder seals.
const SEAL_PERIOD: Span = Span::ms(250);

/// An event as an entry of its node's chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Entry<E = Event> {
    /// Node that writes the chain.
    #[n(0)]
    pub node: NodeId,
    /// Boot of the node.
    #[n(1)]
    pub boot: Boot,
    /// Position in the chain, from 1.
    #[n(2)]
    pub counter: u64,
    /// Time on the node's own clock.
    #[n(3)]
    pub at: Instant,
    /// Content of the entry.
    #[n(4)]
    pub event: E,
    /// SHA-256 of the encoded entry before; zero for the first.
    #[cbor(n(5), with = "minicbor::bytes")]
    pub previous: [u8; 32],
}

impl<E> Entry<E> {
    /// Bytes that the signature in this entry covers: the entry itself, its signature's 64 bytes zero. So it covers its
    /// own time too, behind which no other entry stands where it is the last, and by `previous` everything before it.
    pub fn signed_as(&self) -> Vec<u8> {
        let Entry { node, boot, counter, at, event: _, previous } = *self;
        codec::encode(&Entry { node, boot, counter, at, event: Event::Signed { signature: [0; 64] }, previous })
    }

    /// Decodes one entry.
    pub fn decode<'b>(bytes: &'b [u8]) -> Result<Self, Malformed>
    where
        E: Decode<'b, ()> + Encode<()>,
    {
        codec::decode(bytes, MAX_ENTRY)
    }
}

/// A node's own chain.
#[derive(Clone, Debug)]
pub struct Journal {
    node: NodeId,
    boot: Boot,
    counter: u64,
    head: [u8; 32],
    key: Option<Key>,
    signed: Option<Instant>,
}

impl Journal {
    /// An empty chain; with a key, it is signed once a second.
    pub fn new(node: NodeId, boot: Boot, key: Option<Key>) -> Self {
        Self { node, boot, counter: 0, head: [0; 32], key, signed: None }
    }

    /// Appends `event` and queues it, with a signature over the chain when one is due.
    pub fn write<E: Encode<()>>(&mut self, now: Instant, event: E, out: &mut std::collections::VecDeque<Output>) {
        out.push_back(Output::Audit { bytes: self.append(now, event) });
        if self.key.is_some() && self.signed.is_none_or(|time| now.since(time) >= SIGN_PERIOD) {
            self.sign(now, out);
        }
    }

    /// Signs the chain now; the last thing a node does.
    pub fn sign(&mut self, now: Instant, out: &mut std::collections::VecDeque<Output>) {
        let Some(key) = &self.key else { return };
        let length = self.next(now, Event::Signed { signature: [0; 64] }).signed_as();
        let signed = key.sign(Purpose::Head, &length);
        let signature: [u8; 64] = *signed.last_chunk().expect("a COSE_Sign1 ends with its 64-byte signature");
        self.signed = Some(now);
        out.push_back(Output::Audit { bytes: self.append(now, Event::Signed { signature }) });
    }

    /// Number of entries.
    pub fn counter(&self) -> u64 {
        self.counter
    }

    fn next<E>(&self, now: Instant, event: E) -> Entry<E> {
        let counter = self.counter + 1;
        Entry { node: self.node, boot: self.boot, counter, at: now, event, previous: self.head }
    }

    fn append<E: Encode<()>>(&mut self, now: Instant, event: E) -> Vec<u8> {
        let bytes = codec::encode(&self.next(now, event));
        self.counter += 1;
        debug_assert!(bytes.len() <= MAX_ENTRY, "entry above MAX_ENTRY");
        self.head = Sha256::digest(&bytes).into();
        bytes
    }
}

/// Place to which a chain has been followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Head {
    /// Node that writes the chain.
    #[n(0)]
    pub node: NodeId,
    /// Boot of the node.
    #[n(1)]
    pub boot: Boot,
    /// Entries so far.
    #[n(2)]
    pub counter: u64,
    /// SHA-256 of the last.
    #[cbor(n(3), with = "minicbor::bytes")]
    pub hash: [u8; 32],
}

impl Head {
    /// The head of a chain of `E` that ends with this entry; `None` when it is unreadable.
    pub fn from_last<'b, E: Decode<'b, ()> + Encode<()>>(last: &'b [u8]) -> Option<Head> {
        let entry = Entry::<E>::decode(last).ok()?;
        Some(Head { node: entry.node, boot: entry.boot, counter: entry.counter, hash: Sha256::digest(last).into() })
    }
}

/// Reason that an entry does not continue its chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ChainError {
    /// The bytes are no entry.
    #[error("unreadable entry: {0}")]
    Malformed(#[from] Malformed),
    /// The entry has another counter or another predecessor than the next one.
    #[error("chain of {node} broken at entry {counter}")]
    Broken {
        /// Node that writes the chain.
        node: NodeId,
        /// The first entry that does not fit.
        counter: u64,
    },
    /// The first entry of a chain beyond [`MAX_CHAINS`].
    #[error("at most {MAX_CHAINS} chains expected, got one more, of {node}")]
    Full {
        /// Node that writes the chain.
        node: NodeId,
    },
}

/// Most chains that one recorder follows, fewer than there are identities: with boots below 24 and counters below 2³²
/// that many heads take 334 bytes of a seal, which has 512 on its channel.
pub const MAX_CHAINS: usize = 32;

/// Follows the chains of all nodes of a run, one entry at a time.
#[derive(Clone, Debug, Default)]
pub struct Chains(List<Head, MAX_CHAINS>);

impl Chains {
    /// Checks that `bytes` continues its node's chain, and moves on. Gives the entry and its SHA-256.
    pub fn follow<'b, E>(&mut self, bytes: &'b [u8]) -> Result<(Entry<E>, [u8; 32]), ChainError>
    where
        E: Decode<'b, ()> + Encode<()>,
    {
        let entry = Entry::<E>::decode(bytes)?;
        let broken = ChainError::Broken { node: entry.node, counter: entry.counter };
        let hash: [u8; 32] = Sha256::digest(bytes).into();
        let next = Head { node: entry.node, boot: entry.boot, counter: entry.counter, hash };
        match self.0.0.iter_mut().find(|head| head.node == entry.node) {
            Some(head) if entry.boot > head.boot => {
                let first = entry.counter == 1 && entry.previous == [0; 32];
                first.then(|| *head = next).ok_or(broken)?;
            }
            Some(head) => {
                let follows =
                    entry.boot == head.boot && entry.counter == head.counter + 1 && entry.previous == head.hash;
                follows.then(|| *head = next).ok_or(broken)?;
            }
            None => {
                let first = entry.counter == 1 && entry.previous == [0; 32];
                first.then_some(()).ok_or(broken)?;
                self.0.push(next).then_some(()).ok_or(ChainError::Full { node: entry.node })?;
            }
        }
        Ok((entry, hash))
    }

    /// The heads, in order of first appearance.
    pub fn heads(&self) -> &[Head] {
        &self.0
    }
}

/// Report of the recorder to those who need their log sealed.
#[derive(Clone, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Seal {
    /// Entries sealed so far.
    #[n(0)]
    pub entries: u64,
    /// SHA-256 over all sealed entries' hashes, in order of arrival.
    #[cbor(n(1), with = "minicbor::bytes")]
    pub head: [u8; 32],
    /// Each chain's head.
    #[n(2)]
    pub heads: List<SealedHead, MAX_CHAINS>,
}

/// Extent to which one chain is sealed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct SealedHead {
    /// Node that writes the chain.
    #[n(0)]
    pub node: NodeId,
    /// Boot of the node.
    #[n(1)]
    pub boot: Boot,
    /// Number of entries sealed.
    #[n(2)]
    pub counter: u64,
}

/// The recorder's core: follows every chain, seals four times a second and reports it on the bus. `E` is any event that
/// it is sent.
#[derive(Clone, Debug)]
pub struct Recorder<E = Event> {
    chains: Chains,
    entries: u64,
    head: [u8; 32],
    journal: Journal,
    seals: Sender,
    next: Instant,
    out: std::collections::VecDeque<Output>,
    follows: PhantomData<fn() -> E>,
}

impl<E> Recorder<E> {
    /// A recorder that starts at `now`.
    pub fn new(boot: Boot, key: Key, seals: ChannelKey, now: Instant) -> Self {
        Self {
            chains: Chains::default(),
            entries: 0,
            head: [0; 32],
            journal: Journal::new(NodeId::RECORDER, boot, Some(key)),
            seals: Sender::new(Topic::Seals, NodeId::RECORDER, boot, seals),
            next: now + SEAL_PERIOD,
            out: std::collections::VecDeque::new(),
            follows: PhantomData,
        }
    }

    /// Entries sealed so far and the head over them.
    pub fn sealed(&self) -> (u64, [u8; 32]) {
        (self.entries, self.head)
    }

    fn take<'b>(&mut self, now: Instant, bytes: &'b [u8])
    where
        E: Decode<'b, ()> + Encode<()>,
    {
        match self.chains.follow::<E>(bytes) {
            Ok((_, hash)) => {
                self.entries += 1;
                self.head = Sha256::new().chain_update(self.head).chain_update(hash).finalize().into();
            }
            Err(ChainError::Broken { node, counter }) => {
                self.journal.write(now, Event::ChainBroken { node, counter }, &mut self.out);
            }
            Err(ChainError::Full { node }) => {
                self.journal.write(now, Event::ChainBroken { node, counter: 1 }, &mut self.out);
            }
            // An unreadable entry names no chain, so the note has the recorder's own number. Like every entry that
            // continues no chain, it is in no seal.
            Err(ChainError::Malformed(_)) => {
                self.journal.write(now, Event::ChainBroken { node: NodeId::RECORDER, counter: 0 }, &mut self.out);
            }
        }
    }

    fn seal(&mut self, now: Instant) {
        let heads = self.chains.heads().iter();
        let heads = heads.map(|h| SealedHead { node: h.node, boot: h.boot, counter: h.counter }).collect();
        let seal = Seal { entries: self.entries, head: self.head, heads };
        let bytes = self.seals.seal(now, &codec::encode(&seal));
        self.out.push_back(Output::Bus { topic: Topic::Seals, bytes });
        self.journal.write(now, Event::Sealed { entries: self.entries, head: self.head }, &mut self.out);
        self.next = now + SEAL_PERIOD;
    }
}

impl<E: for<'b> Decode<'b, ()> + Encode<()>> Core for Recorder<E> {
    fn handle(&mut self, now: Instant, input: &Input) {
        match input {
            Input::Audit { bytes } => self.take(now, bytes),
            Input::Timeout if now >= self.next => self.seal(now),
            Input::Finish => {
                self.seal(now);
                self.journal.sign(now, &mut self.out);
            }
            Input::Timeout
            | Input::Quiesce
            | Input::Bus { .. }
            | Input::Opened { .. }
            | Input::Record { .. }
            | Input::Closed { .. }
            | Input::Published { .. }
            | Input::Datagram { .. }
            | Input::Stream { .. }
            | Input::SessionLost
            | Input::Guest { .. }
            | Input::Act { .. }
            | Input::HostWait { .. }
            | Input::Cue { .. } => {}
        }
    }

    fn deadline(&self) -> Option<Instant> {
        Some(self.next)
    }

    fn output(&mut self) -> Option<Output> {
        self.out.pop_front()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::VecDeque;

    fn log(n: usize) -> Vec<Vec<u8>> {
        let mut journal = Journal::new(NodeId::UNIT_A, Boot(1), None);
        let mut out = VecDeque::new();
        (0..n).for_each(|i| journal.write(Instant(i as u64), Event::Started, &mut out));
        out.into_iter().map(|o| if let Output::Audit { bytes } = o { bytes } else { Vec::new() }).collect()
    }

    fn verify(log: &[Vec<u8>]) -> Result<(), ChainError> {
        let mut chains = Chains::default();
        log.iter().try_for_each(|bytes| chains.follow::<Event>(bytes).map(|_| ()))
    }

    #[test]
    fn one_chain_too_many_is_refused_by_name() {
        let mut chains = Chains::default();
        let mut begin = |number: u8| {
            let node: NodeId = codec::decode(&codec::encode(&number), 2).expect("an identity");
            let (mut journal, mut out) = (Journal::new(node, Boot(1), None), VecDeque::new());
            journal.write(Instant(0), Event::Started, &mut out);
            let Some(Output::Audit { bytes }) = out.pop_front() else { unreachable!("a journal writes entries") };
            (node, chains.follow::<Event>(&bytes).map(drop))
        };
        (0..MAX_CHAINS as u8).for_each(|number| assert_eq!(begin(number).1, Ok(()), "{number}"));
        let (node, refused) = begin(MAX_CHAINS as u8);
        assert_eq!(refused, Err(ChainError::Full { node }));
        assert_eq!(
            refused.map_err(|e| e.to_string()),
            Err("at most 32 chains expected, got one more, of unit-5".into())
        );
    }

    #[test]
    fn edit_deletion_and_swap_break_chain_there() {
        assert_eq!(verify(&log(20)), Ok(()));
        let mut deleted = log(20);
        deleted.remove(7);
        assert_eq!(verify(&deleted), Err(ChainError::Broken { node: NodeId::UNIT_A, counter: 9 }));
        let mut swapped = log(20);
        swapped.swap(3, 4);
        assert_eq!(verify(&swapped), Err(ChainError::Broken { node: NodeId::UNIT_A, counter: 5 }));
        for byte in 0..log(3)[1].len() {
            let mut edited = log(3);
            edited[1][byte] ^= 1;
            assert!(verify(&edited).is_err(), "byte {byte}");
        }
    }
}
