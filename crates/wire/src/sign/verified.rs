//! Signatures that were found good, for several cores in one process: the twin verifies each once and not once a core.
//!
//! Whether a signature is good depends on key, message and signature alone, so an answer may be remembered. What is kept
//! is the SHA-256 of all three and nothing less, only after `verify_strict` said yes, and the newest [`KEPT`] only. A
//! signature that was made but never verified is not in here. Live there is none: it does not travel in a setup.

use std::sync::{Arc, Mutex, PoisonError};

use ed25519_dalek::{Signature, VerifyingKey};
use sha2::{Digest, Sha256};

/// How many good signatures are remembered; in a twin a handful is under way between two cores at a time.
const KEPT: usize = 64;

/// Which signatures were found good lately. Clones share one memory.
#[derive(Clone, Debug, Default)]
pub struct Verified(Arc<Mutex<Memory>>);

/// How often a signature was asked about, and how often it then had to be verified.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Asked {
    /// Questions.
    pub asked: u64,
    /// Verifications; the rest was known to be good.
    pub verified: u64,
}

#[derive(Debug)]
struct Memory {
    good: [[u8; 32]; KEPT],
    /// How many were ever put in; the next goes to this place modulo [`KEPT`].
    put: usize,
    counts: Asked,
}

impl Default for Memory {
    fn default() -> Self {
        Memory { good: [[0; 32]; KEPT], put: 0, counts: Asked::default() }
    }
}

impl Verified {
    /// How often it was of use.
    pub fn counts(&self) -> Asked {
        self.with(|memory| memory.counts)
    }

    /// Whether `signature` by `key` over `message` is good: known to be, or found to be by `verify` now.
    pub(super) fn or_verify(
        &self,
        key: &VerifyingKey,
        message: &[u8],
        signature: &Signature,
        verify: impl FnOnce() -> bool,
    ) -> bool {
        // Key and signature are of fixed length, so that no two triples run together to the same bytes.
        let digest = Sha256::new().chain_update(key.as_bytes()).chain_update(signature.to_bytes());
        let triple: [u8; 32] = digest.chain_update(message).finalize().into();
        if self.with(|memory| memory.knows(&triple)) {
            return true;
        }
        let good = verify();
        self.with(|memory| memory.verified(triple, good));
        good
    }

    fn with<T>(&self, f: impl FnOnce(&mut Memory) -> T) -> T {
        f(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Memory {
    fn knows(&mut self, triple: &[u8; 32]) -> bool {
        self.counts.asked += 1;
        self.good[..self.put.min(KEPT)].contains(triple)
    }

    fn verified(&mut self, triple: [u8; 32], good: bool) {
        self.counts.verified += 1;
        if good {
            self.good[self.put % KEPT] = triple;
            self.put += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::id::NodeId;
    use crate::refusal::Refusal;
    use crate::sign::{Key, Keyring, Purpose, Signed};

    const A: NodeId = NodeId::UNIT_A;

    fn ring(verified: &Verified, secret: u8) -> Keyring {
        let mut ring = Keyring::sharing(verified.clone());
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
    fn two_cores_verify_one_signature_once_and_its_making_counts_for_nothing() {
        let verified = Verified::default();
        let (gateway, console) = (ring(&verified, 7), ring(&verified, 7));
        let bytes = signed(b"state");
        assert_eq!(verified.counts(), Asked::default());
        assert_eq!(verify(&gateway, Purpose::Report, &bytes), Ok(()));
        assert_eq!(verified.counts(), Asked { asked: 1, verified: 1 });
        assert_eq!(verify(&console, Purpose::Report, &bytes), Ok(()));
        assert_eq!(verified.counts(), Asked { asked: 2, verified: 1 });
    }

    #[test]
    fn a_good_signature_vouches_for_no_other_bit_purpose_or_key() {
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

    #[test]
    fn a_bad_signature_is_verified_and_refused_every_time() {
        let verified = Verified::default();
        let ring = ring(&verified, 7);
        let mut bad = signed(b"state");
        let last = bad.len() - 1;
        bad[last] ^= 1;
        for n in 1..=3 {
            assert_eq!(verify(&ring, Purpose::Report, &bad), Err(Refusal::Signature { signer: A }));
            assert_eq!(verified.counts(), Asked { asked: n, verified: n });
        }
    }

    #[test]
    fn what_is_forgotten_is_verified_again() {
        let verified = Verified::default();
        let ring = ring(&verified, 7);
        let bytes: Vec<Vec<u8>> = (0..=KEPT).map(|i| signed(&[i as u8])).collect();
        bytes.iter().for_each(|b| assert_eq!(verify(&ring, Purpose::Report, b), Ok(())));
        let before = verified.counts().verified;
        assert_eq!(verify(&ring, Purpose::Report, &bytes[1]), Ok(()));
        assert_eq!(verified.counts().verified, before);
        assert_eq!(verify(&ring, Purpose::Report, &bytes[0]), Ok(()));
        assert_eq!(verified.counts().verified, before + 1);
    }
}
