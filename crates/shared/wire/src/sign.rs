//! Signatures end to end: COSE_Sign1 (RFC 9052 §4.2) with Ed25519, one fixed profile.
//!
//! Protected header `{1: -8}` (EdDSA), empty unprotected header, attached payload. The external additional data names
//! the kind of payload, so that a signature over one kind can never serve for another.

use std::sync::Arc;

use arrayvec::ArrayVec;
use ed25519_dalek::{Signature, Signer, SigningKey, VerifyingKey};
use minicbor::Encoder;
use minicbor::bytes::ByteSlice;
use minicbor::{Decode, Encode};

use crate::codec;
use crate::id::NodeId;
use crate::refusal::Refusal;

/// `{1: -8}`: algorithm EdDSA.
const PROTECTED: [u8; 3] = [0xa1, 0x01, 0x27];

/// Longest payload that is ever signed, bytes.
pub const MAX_SIGNED_PAYLOAD: usize = 1024;

/// Purpose of a signature.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// A unit's report.
    Report,
    /// An operator's intent.
    Intent,
    /// An operator's confirmation.
    Confirmation,
    /// A unit's acknowledgement.
    Ack,
    /// An entry of an audit chain that signs the chain.
    Head,
    /// The authority's revocation of an identity.
    Revocation,
    /// The authority's document of rights on the inner buses.
    Enclaves,
}

impl Purpose {
    fn aad(self) -> &'static [u8] {
        match self {
            Purpose::Report => b"holdsafe report v1",
            Purpose::Intent => b"holdsafe intent v1",
            Purpose::Confirmation => b"holdsafe confirmation v1",
            Purpose::Ack => b"holdsafe ack v1",
            Purpose::Head => b"holdsafe head v1",
            Purpose::Revocation => b"holdsafe revocation v1",
            Purpose::Enclaves => b"holdsafe enclaves v1",
        }
    }
}

/// A node's own signing key. Neither printed nor copied about.
#[derive(Clone)]
pub struct Key {
    signing: Arc<SigningKey>,
    verifier: Option<SharedVerifier>,
}

impl Key {
    /// Key of 32 secret bytes.
    pub fn from_bytes(secret: &[u8; 32]) -> Self {
        Key { signing: Arc::new(SigningKey::from_bytes(secret)), verifier: None }
    }

    /// The key, with `verifier` informed of each signature.
    #[must_use]
    pub fn told_to(self, verifier: SharedVerifier) -> Self {
        Key { verifier: Some(verifier), ..self }
    }

    /// The public half.
    pub fn public(&self) -> [u8; 32] {
        self.signing.verifying_key().to_bytes()
    }

    /// Signs `payload` (at most [`MAX_SIGNED_PAYLOAD`] bytes); gives the encoded COSE_Sign1.
    pub fn sign(&self, purpose: Purpose, payload: &[u8]) -> Vec<u8> {
        let message = to_be_signed(purpose, payload);
        let signature = self.signing.sign(&message).to_bytes();
        if let Some(SharedVerifier(verifier)) = &self.verifier {
            verifier.made(&self.public(), &message, &signature);
        }
        codec::encode(&Sign1 {
            protected: <&ByteSlice>::from(&PROTECTED[..]),
            unprotected: EmptyMap,
            payload: <&ByteSlice>::from(payload),
            signature: <&ByteSlice>::from(&signature[..]),
        })
    }
}

impl core::fmt::Debug for Key {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Key(…)")
    }
}

/// 32 secret bytes; never printed.
#[derive(Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Secret(pub [u8; 32]);

impl core::fmt::Debug for Secret {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Secret(…)")
    }
}

/// A public key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PublicKey(VerifyingKey);

impl PublicKey {
    /// Key from its encoding; none when that is no point on the curve.
    pub fn from_bytes(public: &[u8; 32]) -> Option<Self> {
        VerifyingKey::from_bytes(public).ok().map(PublicKey)
    }

    /// Encoding of the key.
    pub fn as_bytes(&self) -> &[u8; 32] {
        self.0.as_bytes()
    }

    /// True if `signature` over `message` is this key's (strict verification, no malleability).
    pub fn verifies(&self, message: &[u8], signature: &[u8; 64]) -> bool {
        self.0.verify_strict(message, &Signature::from_bytes(signature)).is_ok()
    }
}

/// Verification of signatures in place of [`PublicKey`], for several cores in one process.
///
/// A service has none and verifies everything itself: a verifier cannot be sent by a launcher.
pub trait Verifier: core::fmt::Debug + Send + Sync {
    /// A key of this process made `signature` over `message`.
    fn made(&self, key: &[u8; 32], message: &[u8], signature: &[u8; 64]);

    /// The key of this encoding; none when that is no point on the curve.
    fn key(&self, public: &[u8; 32]) -> Option<PublicKey>;

    /// True if `signature` over `message` is `key`'s: the answer of [`PublicKey::verifies`], however it is found.
    fn verify(&self, key: &PublicKey, message: &[u8], signature: &[u8; 64]) -> bool;
}

/// A verifier that keys and keyrings of several cores share.
#[derive(Clone, Debug)]
pub struct SharedVerifier(pub Arc<dyn Verifier>);

impl PartialEq for SharedVerifier {
    /// Identity: two verifiers that answer alike are not equal.
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

/// The public keys of the identities of one run: as many as the run names, at most one for each identity that there is.
#[derive(Clone, Debug, Default)]
pub struct Keyring {
    /// Sorted by identity.
    keys: Vec<(NodeId, PublicKey)>,
    verifier: Option<SharedVerifier>,
}

impl Keyring {
    /// An empty ring that asks `verifier`.
    pub fn asking(verifier: SharedVerifier) -> Self {
        Self { keys: Vec::new(), verifier: Some(verifier) }
    }

    /// Adds a public key, in place of one that the identity had; false when the bytes are not a point on the curve.
    pub fn insert(&mut self, node: NodeId, public: &[u8; 32]) -> bool {
        let key = match &self.verifier {
            Some(SharedVerifier(verifier)) => verifier.key(public),
            None => PublicKey::from_bytes(public),
        };
        let (index, known) = match self.position(node) {
            Ok(at) => (at, true),
            Err(at) => (at, false),
        };
        match (key, known) {
            (Some(key), true) => self.keys[index].1 = key,
            (Some(key), false) => self.keys.insert(index, (node, key)),
            // Bytes that are no key leave the identity without one, not with its former key.
            (None, true) => drop(self.keys.remove(index)),
            (None, false) => {}
        }
        key.is_some()
    }

    /// True if it has a key of `node`.
    pub fn names(&self, node: NodeId) -> bool {
        self.position(node).is_ok()
    }

    fn position(&self, node: NodeId) -> Result<usize, usize> {
        self.keys.binary_search_by_key(&node, |(node, _)| *node)
    }

    /// Verifies that `signed` is `signer`'s for `purpose` (strict verification, no malleability).
    pub fn verify(&self, signer: NodeId, purpose: Purpose, signed: &Signed<'_>) -> Result<(), Refusal> {
        let index = self.position(signer).map_err(|_| Refusal::Signer { got: signer })?;
        let key = &self.keys[index].1;
        let message = to_be_signed(purpose, signed.payload);
        let good = match &self.verifier {
            Some(SharedVerifier(verifier)) => verifier.verify(key, &message, signed.signature),
            None => key.verifies(&message, signed.signature),
        };
        if good { Ok(()) } else { Err(Refusal::Signature { signer }) }
    }
}

/// A parsed COSE_Sign1 with its signature not yet checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Signed<'b> {
    /// Payload that the signature covers.
    pub payload: &'b [u8],
    signature: &'b [u8; 64],
}

impl<'b> Signed<'b> {
    /// A payload with the signature that stands apart from it.
    pub fn detached(payload: &'b [u8], signature: &'b [u8; 64]) -> Self {
        Signed { payload, signature }
    }

    /// Parses the one profile that is spoken here; `max` bounds the whole encoding.
    pub fn parse(bytes: &'b [u8], max: usize) -> Result<Self, Refusal> {
        let outer: Sign1<'b> = codec::decode(bytes, max)?;
        let protected: &[u8] = outer.protected;
        let payload: &'b [u8] = outer.payload;
        let signature: &'b [u8] = outer.signature;
        match <&[u8; 64]>::try_from(signature) {
            Ok(signature) if protected == PROTECTED && payload.len() <= MAX_SIGNED_PAYLOAD => {
                Ok(Signed { payload, signature })
            }
            Ok(_) | Err(_) => Err(Refusal::Schema { at: 0 }),
        }
    }
}

/// The Sig_structure of RFC 9052 §4.4.
fn to_be_signed(purpose: Purpose, payload: &[u8]) -> ArrayVec<u8, 1152> {
    let mut encoder = Encoder::new(Bounded(ArrayVec::new()));
    let written = encoder
        .array(4)
        .and_then(|e| e.str("Signature1"))
        .and_then(|e| e.bytes(&PROTECTED))
        .and_then(|e| e.bytes(purpose.aad()))
        .and_then(|e| e.bytes(payload))
        .map(|_| ());
    debug_assert!(written.is_ok(), "payload above MAX_SIGNED_PAYLOAD");
    encoder.into_writer().0
}

struct Bounded(ArrayVec<u8, 1152>);

impl minicbor::encode::Write for Bounded {
    type Error = arrayvec::CapacityError;
    fn write_all(&mut self, buf: &[u8]) -> Result<(), Self::Error> {
        self.0.try_extend_from_slice(buf)
    }
}

#[derive(Encode, Decode)]
struct Sign1<'b> {
    #[b(0)]
    protected: &'b ByteSlice,
    #[n(1)]
    unprotected: EmptyMap,
    #[b(2)]
    payload: &'b ByteSlice,
    #[b(3)]
    signature: &'b ByteSlice,
}

struct EmptyMap;

impl<C> Encode<C> for EmptyMap {
    fn encode<W: minicbor::encode::Write>(
        &self,
        e: &mut Encoder<W>,
        _: &mut C,
    ) -> Result<(), minicbor::encode::Error<W::Error>> {
        e.map(0)?.ok()
    }
}

impl<'b, C> Decode<'b, C> for EmptyMap {
    fn decode(d: &mut minicbor::Decoder<'b>, _: &mut C) -> Result<Self, minicbor::decode::Error> {
        match d.map()? {
            Some(0) => Ok(EmptyMap),
            Some(_) | None => Err(minicbor::decode::Error::message("unprotected header expected empty")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key() -> Key {
        Key::from_bytes(&[7; 32])
    }

    fn ring() -> Keyring {
        let mut ring = Keyring::default();
        assert!(ring.insert(NodeId::UNIT_A, &key().public()));
        ring
    }

    #[test]
    fn independent_cose_library_verifies_our_signatures() {
        use coset::CborSerializable;
        let bytes = key().sign(Purpose::Report, b"state");
        let read = coset::CoseSign1::from_slice(&bytes).unwrap();
        assert_eq!(read.payload.as_deref(), Some(&b"state"[..]));
        let verifying = VerifyingKey::from_bytes(&key().public()).unwrap();
        read.verify_signature(b"holdsafe report v1", |sig, data| {
            verifying.verify_strict(data, &Signature::from_slice(sig).unwrap())
        })
        .unwrap();
    }

    #[test]
    fn a_signature_serves_its_purpose_and_signer_only() {
        let bytes = key().sign(Purpose::Report, b"state");
        let signed = Signed::parse(&bytes, 256).unwrap();
        assert_eq!(ring().verify(NodeId::UNIT_A, Purpose::Report, &signed), Ok(()));
        assert_eq!(
            ring().verify(NodeId::UNIT_A, Purpose::Ack, &signed),
            Err(Refusal::Signature { signer: NodeId::UNIT_A })
        );
        assert_eq!(
            ring().verify(NodeId::UNIT_B, Purpose::Report, &signed),
            Err(Refusal::Signer { got: NodeId::UNIT_B })
        );
    }

    #[test]
    fn every_flipped_bit_is_refused() {
        let bytes = key().sign(Purpose::Report, b"state");
        for bit in 0..bytes.len() * 8 {
            let mut bad = bytes.clone();
            bad[bit / 8] ^= 1 << (bit % 8);
            let verdict = Signed::parse(&bad, 256).and_then(|s| ring().verify(NodeId::UNIT_A, Purpose::Report, &s));
            assert!(verdict.is_err(), "bit {bit}");
        }
    }
}
