//! Signatures of MAVLink 2: <https://mavlink.io/en/guide/message_signing.html>.
//!
//! A signature is made from the key and all bytes before it. Rules of acceptance are left to the receivers under test.

use sha2::{Digest, Sha256};

use crate::frame::{Frame, SIGNED, Version};

/// Length of the block behind the checksum, bytes: link id, timestamp, hash.
pub const LENGTH: usize = 13;
/// Timestamp units in a second: each is 10 µs.
pub const TICKS: u64 = 100_000;
/// Timestamps have 48 bits.
const TIMESTAMP: u64 = (1 << 48) - 1;

/// Secret key that both ends hold.
pub type Key = [u8; 32];

/// The block behind the checksum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Signature {
    /// Link id.
    pub link: u8,
    /// Time since 1 January 2015 in units of 10 µs, 48 bits.
    pub timestamp: u64,
    /// First 48 bits of the hash.
    pub hash: [u8; 6],
}

impl Signature {
    /// Of exactly [`LENGTH`] bytes.
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let (&link, rest) = bytes.split_first()?;
        let (stamp, hash) = rest.split_at_checked(6)?;
        let &[a, b, c, d, e, f] = stamp else { return None };
        Some(Self { link, timestamp: u64::from_le_bytes([a, b, c, d, e, f, 0, 0]), hash: hash.try_into().ok()? })
    }

    /// Its bytes.
    pub fn write(&self) -> [u8; LENGTH] {
        let mut bytes = [0; LENGTH];
        bytes[..7].copy_from_slice(&stamped(self.link, self.timestamp));
        bytes[7..].copy_from_slice(&self.hash);
        bytes
    }
}

fn stamped(link: u8, timestamp: u64) -> [u8; 7] {
    let [a, b, c, d, e, f, ..] = (timestamp & TIMESTAMP).to_le_bytes();
    [link, a, b, c, d, e, f]
}

/// Signs a MAVLink 2 frame, and makes its checksum anew with the message's `seed`: the flag is under both. A MAVLink 1 frame has
/// no place for a signature and stays as it is.
pub fn sign(frame: &mut Frame, key: &Key, seed: u8, link: u8, timestamp: u64) {
    let Version::V2 { incompatible, compatible } = frame.version else { return };
    frame.version = Version::V2 { incompatible: incompatible | SIGNED, compatible };
    frame.seal(seed);
    let timestamp = timestamp & TIMESTAMP;
    frame.signature = Some(Signature { link, timestamp, hash: hash(frame, key, link, timestamp) });
}

/// Removes the signature, and makes the checksum anew with the message's `seed`.
pub fn strip(frame: &mut Frame, seed: u8) {
    if let Version::V2 { incompatible, compatible } = frame.version {
        frame.version = Version::V2 { incompatible: incompatible & !SIGNED, compatible };
    }
    frame.signature = None;
    frame.seal(seed);
}

/// True if the frame has the signature of this key.
pub fn is_signed_by(frame: &Frame, key: &Key) -> bool {
    frame.signature.is_some_and(|s| s.hash == hash(frame, key, s.link, s.timestamp))
}

fn hash(frame: &Frame, key: &Key, link: u8, timestamp: u64) -> [u8; 6] {
    let digest = Sha256::new().chain_update(key).chain_update(frame.unsigned_part());
    let digest = digest.chain_update(stamped(link, timestamp)).finalize();
    let mut first = [0; 6];
    first.copy_from_slice(&digest[..6]);
    first
}
