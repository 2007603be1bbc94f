//! The model of the secure telemetry link: DTLS associations as bytes on a wire, without sockets.
//!
//! A datagram has the DTLS 1.2 record header, a ciphertext and a tag; whoever has no key can only see lengths, epochs
//! and sequence numbers. What the model does is what the real stack's own tests show of DTLS (`crates/link/tests/stack`): authenticated,
//! 64-record replay window, withheld records delivered late, tampering discarded silently, a plaintext alert ends an
//! association unless the guard stands in front.
//!
//! Left out, each with a live row: the handshake's own datagrams (an association stands from the start and after each
//! reconnect), socket-buffer overflow, scheduler stalls, half-open and slot exhaustion.

use wire::event::GuardVerdict;
use wire::id::{PeerId, SessionId};
use wire::policy::Requirement;

use super::queue::NodeIndex;

/// Record header: type, version, epoch, sequence, length.
const HEADER: usize = 13;
const TAG: usize = 16;
const APPLICATION_DATA: u8 = 23;

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

/// What became of a datagram at its target.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Arrival {
    /// Delivered to the application.
    Delivered(Vec<u8>),
    /// Refused by the guard in front.
    Refused(GuardVerdict),
    /// Discarded by the secure layer.
    Discarded,
    /// It ended the association (a plaintext record that no guard kept out).
    Ended,
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
    /// Whether it stands.
    pub open: bool,
    /// The record filter in front of both ends.
    pub guard: Requirement,
    generation: u32,
    secret: [u8; 32],
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
        Self { ends: [end(client), end(server)], relay, open: false, guard, generation: 0, secret }
    }

    /// (Re-)keys the association, as a fresh handshake does.
    pub fn open(&mut self) {
        self.generation += 1;
        self.open = true;
        for (side, end) in self.ends.iter_mut().enumerate() {
            let mut key = blake3::Hasher::new_keyed(&self.secret);
            key.update(&self.generation.to_le_bytes()).update(&[side as u8]);
            end.send_key = *key.finalize().as_bytes();
            (end.sent, end.highest, end.seen) = (0, 0, 0);
        }
    }

    /// Seals a record of the end `from` into a datagram.
    pub fn seal(&mut self, from: usize, plain: &[u8]) -> Vec<u8> {
        let end = &mut self.ends[from];
        end.sent += 1;
        let mut bytes = Vec::with_capacity(HEADER + plain.len() + TAG);
        bytes.extend_from_slice(&[APPLICATION_DATA, 0xfe, 0xfd, 0, 1]);
        bytes.extend_from_slice(&end.sent.to_be_bytes()[2..]);
        bytes.extend_from_slice(&((plain.len() + TAG) as u16).to_be_bytes());
        bytes.extend_from_slice(plain);
        mask(&end.send_key, end.sent, &mut bytes[HEADER..]);
        let tag = blake3::keyed_hash(&end.send_key, &bytes);
        bytes.extend_from_slice(&tag.as_bytes()[..TAG]);
        bytes
    }

    /// What a datagram that reached the end `at` comes to.
    pub fn arrive(&mut self, at: usize, datagram: &[u8]) -> (Outside, Arrival) {
        let Some(outside) = outside(datagram) else {
            let verdict = match self.guard {
                Requirement::Required => Arrival::Refused(GuardVerdict::Malformed),
                Requirement::Waived => Arrival::Discarded,
            };
            return (Outside::default(), verdict);
        };
        if outside.epoch == 0 {
            return (outside, self.plaintext());
        }
        (outside, self.authenticate(at, outside, datagram))
    }

    /// A plaintext record on a standing association.
    fn plaintext(&mut self) -> Arrival {
        match self.guard {
            Requirement::Required => Arrival::Refused(GuardVerdict::Plaintext),
            Requirement::Waived if self.open => {
                self.open = false;
                Arrival::Ended
            }
            Requirement::Waived => Arrival::Discarded,
        }
    }

    fn authenticate(&mut self, at: usize, outside: Outside, datagram: &[u8]) -> Arrival {
        let key = self.ends[1 - at].send_key;
        let body = &datagram[HEADER..];
        let length = usize::from(u16::from_be_bytes([datagram[11], datagram[12]]));
        let whole = self.open && outside.epoch == 1 && body.len() == length && length >= TAG;
        if !whole {
            return Arrival::Discarded;
        }
        let (signed, tag) = datagram.split_at(datagram.len() - TAG);
        if blake3::keyed_hash(&key, signed).as_bytes()[..TAG] != *tag || !self.ends[at].first_sight(outside.sequence) {
            return Arrival::Discarded;
        }
        let mut plain = signed[HEADER..].to_vec();
        mask(&key, outside.sequence, &mut plain);
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

/// Reads the header that travels in the clear.
pub fn outside(datagram: &[u8]) -> Option<Outside> {
    let header = datagram.first_chunk::<HEADER>()?;
    let known = (20..=23).contains(&header[0]) && header[1] == 0xfe;
    let mut sequence = [0; 8];
    sequence[2..].copy_from_slice(&header[5..11]);
    let epoch = u16::from_be_bytes([header[3], header[4]]);
    known.then(|| Outside { epoch, sequence: u64::from_be_bytes(sequence) })
}

/// XORs the keystream of (key, sequence) over `bytes`.
fn mask(key: &[u8; 32], sequence: u64, bytes: &mut [u8]) {
    let mut stream = blake3::Hasher::new_keyed(key).update(&sequence.to_le_bytes()).finalize_xof();
    let mut pad = [0; 64];
    for chunk in bytes.chunks_mut(64) {
        stream.fill(&mut pad);
        chunk.iter_mut().zip(pad).for_each(|(b, p)| *b ^= p);
    }
}
