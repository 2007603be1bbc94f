//! The model of the secure telemetry link: DTLS associations as bytes on a wire, without sockets.
//!
//! A datagram has the DTLS 1.2 record header, a ciphertext and a tag; whoever has no key can only see lengths, epochs
//! and sequence numbers. The record filter is the real one's judgement (`link::guard`). What the model does behind it is
//! what the real stack does: one suite of properties runs over both (`tests/properties/conformance`), and
//! `docs/link-model.md` lists where they still differ, and in which direction.

use link::dtls::MAX_RECORD;
use link::guard::record::{ALERT, APPLICATION_DATA, HEADER, RawRecord, Split, split};
use link::guard::{GuardMode, SEAL};
use wire::event::GuardVerdict;
use wire::id::{PeerId, SessionId};
use wire::policy::Requirement;

use super::queue::NodeIndex;
use crate::evidence::guard_verdict;

/// Authentication tag of a record.
const TAG: usize = 16;
/// Explicit nonce in front of the ciphertext.
const NONCE: usize = SEAL - TAG;

/// One end of an association.
#[derive(Clone, Debug)]
pub struct End {
    /// Which node.
    pub node: NodeIndex,
    /// Its handle of the session.
    pub session: SessionId,
    /// Who it is, by its certificate.
    pub peer: PeerId,
    send_key: [u8; 32],
    sent: u64,
    highest: u64,
    seen: u64,
}

/// What became of a record at its target.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Arrival {
    /// Delivered to the application.
    Delivered(Vec<u8>),
    /// Refused by the guard in front.
    Refused(GuardVerdict),
    /// Discarded by the secure layer.
    Discarded,
    /// Taken for a part of a handshake.
    Handshake,
    /// It ended the association, or the handshake that was to lead to one (a plaintext record that no guard kept out).
    Ended,
}

/// One record of a datagram, with what became of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Seen<'a> {
    /// What anyone on the path could read.
    pub outside: Outside,
    /// Header and body.
    pub bytes: &'a [u8],
    /// What became of it.
    pub arrival: Arrival,
}

/// How far an association is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// There is none.
    Down,
    /// A handshake is under way.
    Handshake,
    /// It carries records.
    Open,
}

/// Header fields as anyone on the path can read them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outside {
    /// Epoch.
    pub epoch: u16,
    /// Sequence.
    pub sequence: u64,
}

/// A secure association between two nodes, possibly through a relay.
#[derive(Clone, Debug)]
pub struct Association {
    /// The end that dialled, then the end that listened.
    pub ends: [End; 2],
    /// The relay in between, if any.
    pub relay: Option<NodeIndex>,
    /// How far it is.
    pub standing: Standing,
    /// The record filter in front of both ends.
    pub guard: Requirement,
    generation: u32,
    secret: [u8; 32],
    /// Datagrams of the dialling end, over all generations.
    dialled: u64,
}

impl Association {
    /// An association between `client` and `server` that has yet to be opened.
    pub fn new(
        client: (NodeIndex, SessionId, PeerId),
        server: (NodeIndex, SessionId, PeerId),
        relay: Option<NodeIndex>,
        guard: Requirement,
        secret: [u8; 32],
    ) -> Self {
        let end = |(node, session, peer)| End { node, session, peer, send_key: [0; 32], sent: 0, highest: 0, seen: 0 };
        let standing = Standing::Down;
        Self { ends: [end(client), end(server)], relay, standing, guard, generation: 0, secret, dialled: 0 }
    }

    /// Begins a handshake and gives its number.
    pub fn begin(&mut self) -> u32 {
        self.generation += 1;
        self.standing = Standing::Handshake;
        self.generation
    }

    /// The handshake `number` comes to its end: new keys, new windows. False when it is not the one under way.
    pub fn complete(&mut self, number: u32) -> bool {
        if self.standing != Standing::Handshake || number != self.generation {
            return false;
        }
        self.standing = Standing::Open;
        for (side, end) in self.ends.iter_mut().enumerate() {
            let mut key = blake3::Hasher::new_keyed(&self.secret);
            key.update(&self.generation.to_le_bytes()).update(&[side as u8]);
            end.send_key = *key.finalize().as_bytes();
            (end.sent, end.highest, end.seen) = (0, 0, 0);
        }
        true
    }

    /// Which handshake it stands on.
    pub fn generation(&self) -> u32 {
        self.generation
    }

    /// Ends what stands on the handshake `generation`; false when that is over already.
    pub fn hang_up(&mut self, generation: u32) -> bool {
        let stands = self.standing == Standing::Open && generation == self.generation;
        if stands {
            self.standing = Standing::Down;
        }
        stands
    }

    /// Datagrams that the dialling end has sent.
    pub fn sent_by_client(&self) -> u64 {
        self.dialled
    }

    /// Seals a record of the end `from` into a datagram; `None` when it is longer than a record may be or there is no
    /// association to carry it.
    pub fn seal(&mut self, from: usize, plain: &[u8]) -> Option<Vec<u8>> {
        if self.standing != Standing::Open || plain.len() > MAX_RECORD {
            return None;
        }
        self.dialled += u64::from(from == 0);
        let end = &mut self.ends[from];
        end.sent += 1;
        let mut bytes = Vec::with_capacity(HEADER + plain.len() + SEAL);
        bytes.extend_from_slice(&[APPLICATION_DATA, 0xfe, 0xfd, 0, 1]);
        bytes.extend_from_slice(&end.sent.to_be_bytes()[2..]);
        bytes.extend_from_slice(&((plain.len() + SEAL) as u16).to_be_bytes());
        bytes.extend_from_slice(&end.sent.to_be_bytes());
        bytes.extend_from_slice(plain);
        mask(&end.send_key, end.sent, &mut bytes[HEADER + NONCE..]);
        let tag = blake3::keyed_hash(&end.send_key, &bytes);
        bytes.extend_from_slice(&tag.as_bytes()[..TAG]);
        Some(bytes)
    }

    /// What the records of a datagram that reached the end `at` come to.
    pub fn arrive<'a>(&mut self, at: usize, datagram: &'a [u8]) -> Vec<Seen<'a>> {
        split(datagram).map(|piece| self.record(at, piece)).collect()
    }

    fn record<'a>(&mut self, at: usize, piece: Split<'a>) -> Seen<'a> {
        let (raw, verdict) = match piece {
            Split::Remainder(bytes) => (RawRecord::unframed(bytes), GuardVerdict::Malformed),
            Split::Record(raw) if self.standing == Standing::Down => (raw, GuardVerdict::Stranger),
            Split::Record(raw) => (raw, judge(&raw, self.guard, self.standing == Standing::Open)),
        };
        let arrival = match verdict {
            GuardVerdict::Passed if raw.epoch == 0 => self.plaintext(&raw),
            GuardVerdict::Passed => self.authenticate(at, &raw),
            GuardVerdict::Plaintext
            | GuardVerdict::Malformed
            | GuardVerdict::Stranger
            | GuardVerdict::Unfinished
            | GuardVerdict::Shed => Arrival::Refused(verdict),
        };
        Seen { outside: Outside { epoch: raw.epoch, sequence: raw.sequence }, bytes: raw.bytes, arrival }
    }

    /// A plaintext record that the guard let pass: alerts and data end what there is, a handshake's records do not.
    fn plaintext(&mut self, raw: &RawRecord<'_>) -> Arrival {
        if matches!(raw.content, ALERT | APPLICATION_DATA) {
            self.standing = Standing::Down;
            return Arrival::Ended;
        }
        Arrival::Handshake
    }

    fn authenticate(&mut self, at: usize, raw: &RawRecord<'_>) -> Arrival {
        let key = self.ends[1 - at].send_key;
        let datagram = raw.bytes;
        if self.standing != Standing::Open || raw.epoch != 1 || raw.body().len() < SEAL {
            return Arrival::Discarded;
        }
        let (signed, tag) = datagram.split_at(datagram.len() - TAG);
        if blake3::keyed_hash(&key, signed).as_bytes()[..TAG] != *tag || !self.ends[at].first_sight(raw.sequence) {
            return Arrival::Discarded;
        }
        let mut plain = signed[HEADER + NONCE..].to_vec();
        mask(&key, raw.sequence, &mut plain);
        Arrival::Delivered(plain)
    }
}

impl End {
    /// The 64-record window of RFC 6347 §4.1.2.6.
    fn first_sight(&mut self, sequence: u64) -> bool {
        if sequence > self.highest {
            let step = sequence - self.highest;
            self.seen = if step < 64 { self.seen << step } else { 0 } | 1;
            self.highest = sequence;
            return true;
        }
        let behind = self.highest - sequence;
        let unseen = behind < 64 && self.seen & (1 << behind) == 0;
        if unseen {
            self.seen |= 1 << behind;
        }
        unseen
    }
}

/// What the real record filter says of a record, in the words of the log.
pub fn judge(raw: &RawRecord<'_>, guard: Requirement, complete: bool) -> GuardVerdict {
    let mode = match guard {
        Requirement::Required => GuardMode::Required,
        Requirement::Waived => GuardMode::Waived,
    };
    guard_verdict(link::guard::judge(raw, mode, complete))
}

/// XORs the keystream of (key, sequence) over `bytes`.
pub(super) fn mask(key: &[u8; 32], sequence: u64, bytes: &mut [u8]) {
    let mut stream = blake3::Hasher::new_keyed(key).update(&sequence.to_le_bytes()).finalize_xof();
    let mut pad = [0; 64];
    for chunk in bytes.chunks_mut(64) {
        stream.fill(&mut pad);
        chunk.iter_mut().zip(pad).for_each(|(b, p)| *b ^= p);
    }
}
