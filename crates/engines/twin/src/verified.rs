//! Signatures that are known to be good, for several cores in one process: the twin verifies those that none of them
//! made.
//!
//! The validity of a signature depends on key, message and signature alone, so an answer may be remembered; and a key's
//! own signature verifies under it (RFC 8032 §5.1). All three are kept, byte for byte, only where a core signed it or
//! [`PublicKey::verifies`] said yes, and the newest `KEPT` only. Public keys are decompressed once. Live there is none
//! of this: a [`Verifier`] does not travel in a setup.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use wire::id::NODES;
use wire::sign::{PublicKey, SharedVerifier, Verifier};

/// Number of good signatures remembered; in a twin a handful is under way between two cores at a time, and each service
/// signs its log once a second.
const KEPT: usize = 1024;

/// Signatures that were found good lately. Clones share one memory.
#[derive(Clone, Debug, Default)]
pub struct Verified(Arc<Known>);

/// Number of signatures that cores made, of those asked about, and of those that then had to be verified.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SignatureCounts {
    /// Number of signatures made.
    pub made: u64,
    /// Number of signatures asked about.
    pub asked: u64,
    /// Verifications; the rest was known to be good.
    pub verified: u64,
}

#[derive(Debug, Default)]
struct Known(Mutex<Memory>);

#[derive(Clone, Debug, Default)]
struct Memory {
    /// The newest last.
    good: VecDeque<Good>,
    /// Keys that were decompressed, at most [`NODES`].
    keys: Vec<PublicKey>,
    counts: SignatureCounts,
}

/// A signature that is good.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Good {
    signature: [u8; 64],
    /// Key and message. The key is of fixed length, so that no two pairs run together to the same bytes.
    over: Arc<[u8]>,
}

impl Verified {
    /// A separate memory with the same knowledge, and counts of zero.
    #[must_use]
    pub fn detached(&self) -> Verified {
        let memory = self.0.with_memory(|memory| Memory { counts: SignatureCounts::default(), ..memory.clone() });
        Verified(Arc::new(Known(Mutex::new(memory))))
    }

    /// The memory as the verifier of a core.
    pub fn shared(&self) -> SharedVerifier {
        SharedVerifier(Arc::<Known>::clone(&self.0))
    }

    /// Counts of the use of this memory.
    pub fn counts(&self) -> SignatureCounts {
        self.0.with_memory(|memory| memory.counts)
    }
}

impl Known {
    fn with_memory<T>(&self, f: impl FnOnce(&mut Memory) -> T) -> T {
        f(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Verifier for Known {
    fn made(&self, key: &[u8; 32], message: &[u8], signature: &[u8; 64]) {
        let good = Good::new(key, message, signature);
        self.with_memory(|memory| {
            memory.counts.made += 1;
            memory.keep(good);
        });
    }

    fn key(&self, public: &[u8; 32]) -> Option<PublicKey> {
        self.with_memory(|memory| {
            let known = memory.keys.iter().find(|key| key.as_bytes() == public).copied();
            known.or_else(|| {
                let key = PublicKey::from_bytes(public)?;
                // A full table only means that this one is decompressed again.
                if memory.keys.len() < NODES {
                    memory.keys.push(key);
                }
                Some(key)
            })
        })
    }

    fn verify(&self, key: &PublicKey, message: &[u8], signature: &[u8; 64]) -> bool {
        let requested = Good::new(key.as_bytes(), message, signature);
        if self.with_memory(|memory| memory.knows(&requested)) {
            return true;
        }
        let good = key.verifies(message, signature);
        self.with_memory(|memory| memory.verified(requested, good));
        good
    }
}

impl Memory {
    fn knows(&mut self, requested: &Good) -> bool {
        self.counts.asked += 1;
        // The newest first: the signature asked about was mostly made a moment ago.
        self.good.iter().rev().any(|good| good == requested)
    }

    fn verified(&mut self, requested: Good, good: bool) {
        self.counts.verified += 1;
        if good {
            self.keep(requested);
        }
    }

    fn keep(&mut self, good: Good) {
        if self.good.len() == KEPT {
            self.good.pop_front();
        }
        self.good.push_back(good);
    }
}

impl Good {
    fn new(key: &[u8; 32], message: &[u8], signature: &[u8; 64]) -> Self {
        Good { signature: *signature, over: [&key[..], message].concat().into() }
    }
}

#[cfg(test)]
mod tests {
    use wire::id::NodeId;
    use wire::refusal::Refusal;
    use wire::sign::{Key, Keyring, Purpose, Signed};

    use super::*;

    const A: NodeId = NodeId::UNIT_A;

    fn ring(verified: &Verified, secret: u8) -> Keyring {
        let mut ring = Keyring::asking(verified.shared());
        assert!(ring.insert(A, &Key::from_bytes(&[secret; 32]).public()));
        ring
    }

    fn signed(payload: &[u8]) -> Vec<u8> {
        Key::from_bytes(&[7; 32]).sign(Purpose::Report, payload)
    }

    fn verify(ring: &Keyring, purpose: Purpose, bytes: &[u8]) -> Result<(), Refusal> {
        ring.verify(A, purpose, &Signed::parse(bytes, 256)?)
    }

    #[test]
    fn shared_signatures_are_known_good_bit_exactly() {
        let verified = Verified::default();
        let ring = ring(&verified, 7);
        let bytes = Key::from_bytes(&[7; 32]).told_to(verified.shared()).sign(Purpose::Report, b"state");
        assert_eq!(verify(&ring, Purpose::Report, &bytes), Ok(()));
        assert_eq!(verified.counts(), SignatureCounts { made: 1, asked: 1, verified: 0 });
        let mut single_keyring = Keyring::default();
        assert!(single_keyring.insert(A, &Key::from_bytes(&[7; 32]).public()));
        assert_eq!(verify(&single_keyring, Purpose::Report, &bytes), Ok(()), "and is good");
        for bit in 0..bytes.len() * 8 {
            let mut bad = bytes.clone();
            bad[bit / 8] ^= 1 << (bit % 8);
            assert!(verify(&ring, Purpose::Report, &bad).is_err(), "bit {bit}");
        }
        assert!(verify(&ring, Purpose::Ack, &bytes).is_err());
    }

    #[test]
    fn two_cores_verify_once_what_neither_signed() {
        let verified = Verified::default();
        let (gateway, console) = (ring(&verified, 7), ring(&verified, 7));
        let bytes = signed(b"state");
        assert_eq!(verified.counts(), SignatureCounts::default());
        assert_eq!(verify(&gateway, Purpose::Report, &bytes), Ok(()));
        assert_eq!(verified.counts(), SignatureCounts { made: 0, asked: 1, verified: 1 });
        assert_eq!(verify(&console, Purpose::Report, &bytes), Ok(()));
        assert_eq!(verified.counts(), SignatureCounts { made: 0, asked: 2, verified: 1 });
    }

    /// No other bit, purpose or key is vouched for.
    #[test]
    fn good_signature_vouches_for_nothing_else() {
        let verified = Verified::default();
        let ring_of_a = ring(&verified, 7);
        let bytes = signed(b"state");
        assert_eq!(verify(&ring_of_a, Purpose::Report, &bytes), Ok(()));
        for bit in 0..bytes.len() * 8 {
            let mut bad = bytes.clone();
            bad[bit / 8] ^= 1 << (bit % 8);
            assert!(verify(&ring_of_a, Purpose::Report, &bad).is_err(), "bit {bit}");
        }
        let refused = Err(Refusal::Signature { signer: A });
        assert_eq!(verify(&ring_of_a, Purpose::Ack, &bytes), refused);
        assert_eq!(verify(&ring(&verified, 8), Purpose::Report, &bytes), refused);
    }

    /// A bad signature is verified again each time.
    #[test]
    fn bad_signature_is_refused_every_time() {
        let verified = Verified::default();
        let ring = ring(&verified, 7);
        let mut bad = signed(b"state");
        let last = bad.len() - 1;
        bad[last] ^= 1;
        for n in 1..=3 {
            assert_eq!(verify(&ring, Purpose::Report, &bad), Err(Refusal::Signature { signer: A }));
            assert_eq!(verified.counts(), SignatureCounts { made: 0, asked: n, verified: n });
        }
    }

    #[test]
    fn what_is_forgotten_is_verified_again() {
        let verified = Verified::default();
        let ring = ring(&verified, 7);
        let bytes: Vec<Vec<u8>> = (0..=KEPT).map(|i| signed(&i.to_le_bytes())).collect();
        bytes.iter().for_each(|b| assert_eq!(verify(&ring, Purpose::Report, b), Ok(())));
        let before = verified.counts().verified;
        assert_eq!(verify(&ring, Purpose::Report, &bytes[1]), Ok(()));
        assert_eq!(verified.counts().verified, before);
        assert_eq!(verify(&ring, Purpose::Report, &bytes[0]), Ok(()));
        assert_eq!(verified.counts().verified, before + 1);
    }
}
