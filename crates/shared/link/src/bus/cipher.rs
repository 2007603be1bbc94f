//! Confidentiality of a channel in shared memory: AES-256-GCM under a key that its publisher and its readers have.
//!
//! It hides messages from other services of the host, which can map the memory of every channel. It does not authenticate the author of a
//! message, since its readers have the key too: the tags in the message do (`wire::bus`). Nonces are random (NIST SP 800-38D, 8.2.2), since a
//! channel may have several writers under one key: at most 2^32 messages, years of any channel.

use ring::aead::{AES_256_GCM, Aad, LessSafeKey, NONCE_LEN, Nonce, UnboundKey};
use ring::rand::{SecureRandom, SystemRandom};
use wire::core::Topic;
use wire::sign::Secret;

/// Bytes that an encrypted message is longer than the message.
pub const OVERHEAD: usize = NONCE_LEN + 16;

/// One end of a confidential channel.
pub(crate) struct Cipher {
    key: LessSafeKey,
    topic: Topic,
    random: SystemRandom,
}

impl Cipher {
    pub(crate) fn new(key: &Secret, topic: Topic) -> Self {
        let key = UnboundKey::new(&AES_256_GCM, &key.0).expect("invariant: 32 bytes are a key");
        Self { key: LessSafeKey::new(key), topic, random: SystemRandom::new() }
    }

    /// Nonce and encrypted message; none where the machine gives no random bytes.
    pub(crate) fn encrypt(&self, message: &[u8]) -> Option<Vec<u8>> {
        let mut nonce = [0; NONCE_LEN];
        self.random.fill(&mut nonce).ok()?;
        let mut bytes = Vec::with_capacity(message.len() + OVERHEAD);
        bytes.extend_from_slice(&nonce);
        bytes.extend_from_slice(message);
        // The topic is authenticated too: a message copied into another channel under the same key is refused there.
        let (aad, nonce) = (Aad::from([self.topic as u8]), Nonce::assume_unique_for_key(nonce));
        let tag = self.key.seal_in_place_separate_tag(nonce, aad, &mut bytes[NONCE_LEN..]).ok()?;
        bytes.extend_from_slice(tag.as_ref());
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
        let cipher = |key: u8, topic| Cipher::new(&Secret([key; 32]), topic);
        let tracks = cipher(1, Topic::Tracks);
        let sealed = tracks.encrypt(b"a vehicle at 12 m").unwrap();
        assert_eq!(sealed.len(), 17 + OVERHEAD);
        assert!(!sealed.windows(7).any(|bytes| bytes == b"vehicle"));
        assert_ne!(tracks.encrypt(b"a vehicle at 12 m").unwrap(), sealed, "each message has a nonce of its own");
        assert_eq!(cipher(1, Topic::Tracks).decrypt(&sealed).as_deref(), Some(&b"a vehicle at 12 m"[..]));
        assert_eq!(cipher(2, Topic::Tracks).decrypt(&sealed), None);
        assert_eq!(cipher(1, Topic::Drive).decrypt(&sealed), None, "another channel under the same key");
        for n in 0..sealed.len() {
            let mut altered = sealed.clone();
            altered[n] ^= 1;
            assert_eq!(tracks.decrypt(&altered), None, "byte {n}");
            assert_eq!(tracks.decrypt(&sealed[..n]), None, "cut at {n}");
        }
    }
}
