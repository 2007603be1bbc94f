//! Record layer of one handshake at one end of an association: its keys, its window, and the records that it seals and
//! opens.
//!
//! A record has the DTLS 1.2 header, a ciphertext and a tag, as long as the real ones. Its result at its end is
//! [`super::net`]'s.

use link::guard::SEAL;
use link::guard::record::{HEADER, RawRecord};

use super::queue::Micros;

/// Authentication tag of a record.
const TAG: usize = 16;
/// Explicit nonce in front of the ciphertext.
const NONCE: usize = SEAL - TAG;

/// Keys and window at one end of a session.
#[derive(Clone, Debug)]
pub(super) struct Open {
    /// Number of the handshake that made the keys.
    pub(super) number: u32,
    /// Time at which a record last came out here, or it opened.
    pub(super) heard: Micros,
    /// Number of repetitions of the last flight.
    pub(super) repeats: u32,
    send_key: [u8; 32],
    receive_key: [u8; 32],
    sent: u64,
    highest: u64,
    seen: u64,
}

impl Open {
    /// New keys, new windows: the end `at` after the handshake `number` of the association that has this secret.
    pub(super) fn new(secret: &[u8; 32], number: u32, at: usize, now: Micros) -> Self {
        let key = |side: usize| {
            let mut key = blake3::Hasher::new_keyed(secret);
            *key.update(&number.to_le_bytes()).update(&[side as u8]).finalize().as_bytes()
        };
        let (send_key, receive_key) = (key(at), key(1 - at));
        Open { number, heard: now, repeats: 0, send_key, receive_key, sent: 0, highest: 0, seen: 0 }
    }

    /// A sealed record of this content type.
    pub(super) fn seal(&mut self, content: u8, plain: &[u8]) -> Vec<u8> {
        self.sent += 1;
        let mut bytes = Vec::with_capacity(HEADER + plain.len() + SEAL);
        bytes.extend_from_slice(&[content, 0xfe, 0xfd, 0, 1]);
        bytes.extend_from_slice(&self.sent.to_be_bytes()[2..]);
        bytes.extend_from_slice(&((plain.len() + SEAL) as u16).to_be_bytes());
        bytes.extend_from_slice(&self.sent.to_be_bytes());
        bytes.extend_from_slice(plain);
        mask(&self.send_key, self.sent, &mut bytes[HEADER + NONCE..]);
        let tag = blake3::keyed_hash(&self.send_key, &bytes);
        bytes.extend_from_slice(&tag.as_bytes()[..TAG]);
        bytes
    }

    /// Content of a record, if the other end sealed it and it comes for the first time.
    pub(super) fn unseal(&mut self, raw: &RawRecord<'_>) -> Option<Vec<u8>> {
        if raw.epoch != 1 || raw.body().len() < SEAL {
            return None;
        }
        let (signed, tag) = raw.bytes.split_at(raw.bytes.len() - TAG);
        // The tag comes before the window: a forged record must not mark the sequence of a genuine one as seen.
        let expected = blake3::keyed_hash(&self.receive_key, signed);
        if expected.as_bytes()[..TAG] != *tag || !self.first_sight(raw.sequence) {
            return None;
        }
        let mut plain = signed[HEADER + NONCE..].to_vec();
        mask(&self.receive_key, raw.sequence, &mut plain);
        Some(plain)
    }

    /// The 64-record window of RFC 6347 §4.1.2.6.
    fn first_sight(&mut self, sequence: u64) -> bool {
        if sequence > self.highest {
            let step = sequence - self.highest;
            self.seen = if step < 64 { self.seen << step } else { 0 } | 1;
            self.highest = sequence;
            return true;
        }
        let distance = self.highest - sequence;
        let unseen = distance < 64 && self.seen & (1 << distance) == 0;
        if unseen {
            self.seen |= 1 << distance;
        }
        unseen
    }
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
