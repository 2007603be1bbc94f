//! Confidentiality of a channel in shared memory: AES-256-GCM under a key that its publisher and its readers have.
//!
//! It hides messages from other services of the host, which can map the memory of every channel. It says nothing about a message's author, for
//! its readers have the key too: the tags within it do (`wire::bus`). Nonces are a random start and a counter (NIST SP 800-38D, 8.2.1),
//! so that a restart repeats none.

use ring::aead::{AES_256_GCM, Aad, LessSafeKey, NONCE_LEN, Nonce, UnboundKey};
use ring::rand::{SecureRandom, SystemRandom};
use wire::core::Topic;
use wire::setup::Secret;

/// Bytes of a nonce that are random.
const RANDOM: usize = 4;

/// Bytes that an encrypted message is longer than the message.
pub const OVERHEAD: usize = NONCE_LEN + 16;

/// One end of a confidential channel.
pub(crate) struct Cipher {
    key: LessSafeKey,
    topic: Topic,
    start: [u8; RANDOM],
    sent: u64,
}

impl Cipher {
    /// None where the machine gives no random bytes.
    pub(crate) fn new(key: &Secret, topic: Topic) -> Option<Self> {
        let mut start = [0; RANDOM];
        SystemRandom::new().fill(&mut start).ok()?;
        let key = LessSafeKey::new(UnboundKey::new(&AES_256_GCM, &key.0).ok()?);
        Some(Self { key, topic, start, sent: 0 })
    }

    /// Nonce and encrypted message; none after as many messages as a counter has numbers.
    pub(crate) fn encrypt(&mut self, message: &[u8]) -> Option<Vec<u8>> {
        self.sent = self.sent.checked_add(1)?;
        let mut nonce = [0; NONCE_LEN];
        nonce[..RANDOM].copy_from_slice(&self.start);
        nonce[RANDOM..].copy_from_slice(&self.sent.to_be_bytes());
        let mut bytes = Vec::with_capacity(message.len() + OVERHEAD);
        bytes.extend_from_slice(message);
        let nonce_of = Nonce::assume_unique_for_key(nonce);
        self.key.seal_in_place_append_tag(nonce_of, Aad::from([self.topic as u8]), &mut bytes).ok()?;
        bytes.splice(..0, nonce);
        Some(bytes)
    }

    /// The message; none for bytes that are no message of this channel.
    pub(crate) fn decrypt(&self, bytes: &[u8]) -> Option<Vec<u8>> {
        let (nonce, sealed) = bytes.split_first_chunk::<NONCE_LEN>()?;
        let mut sealed = sealed.to_vec();
        let nonce = Nonce::assume_unique_for_key(*nonce);
        let message = self.key.open_in_place(nonce, Aad::from([self.topic as u8]), &mut sealed).ok()?;
        Some(message.to_vec())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_channels_key_reads_a_message() {
        let cipher = |key: u8, topic| Cipher::new(&Secret([key; 32]), topic).unwrap();
        let mut own = cipher(1, Topic::Tracks);
        let sealed = own.encrypt(b"a vehicle at 12 m").unwrap();
        assert_eq!(sealed.len(), 17 + OVERHEAD);
        assert!(!sealed.windows(7).any(|bytes| bytes == b"vehicle"));
        assert_ne!(own.encrypt(b"a vehicle at 12 m").unwrap(), sealed, "each message has a nonce of its own");
        assert_eq!(cipher(1, Topic::Tracks).decrypt(&sealed).as_deref(), Some(&b"a vehicle at 12 m"[..]));
        assert_eq!(cipher(2, Topic::Tracks).decrypt(&sealed), None);
        assert_eq!(cipher(1, Topic::Drive).decrypt(&sealed), None, "another channel under the same key");
        for n in 0..sealed.len() {
            let mut altered = sealed.clone();
            altered[n] ^= 1;
            assert_eq!(own.decrypt(&altered), None, "byte {n}");
            assert_eq!(own.decrypt(&sealed[..n]), None, "cut at {n}");
        }
    }
}
