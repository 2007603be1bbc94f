//! Making and checking the signatures of MAVLink 2: <https://mavlink.io/en/guide/message_signing.html>.
//!
//! A signature is made from the key and all bytes before it. Rules of acceptance are left to the receivers under test.

use sha2::{Digest, Sha256};

use crate::frame::{Frame, SIGNED, Signature, TIMESTAMP, Version};

/// Timestamp units in a second: each is 10 µs.
pub const TICKS: u64 = 100_000;

/// Secret key that both ends hold.
pub type Key = [u8; 32];

/// Signs a MAVLink 2 frame, and makes its checksum again with the message's `seed`: the flag is under both. A MAVLink 1 frame has
/// no place for a signature and stays as it is.
pub fn sign(frame: &mut Frame, key: &Key, seed: u8, link: u8, timestamp: u64) {
    let Version::V2 { incompatible, compatible } = frame.version else { return };
    frame.version = Version::V2 { incompatible: incompatible | SIGNED, compatible };
    frame.seal(seed);
    let timestamp = timestamp & TIMESTAMP;
    frame.signature = Some(Signature { link, timestamp, hash: hash(frame, key, link, timestamp) });
}

/// True if the frame has the signature of this key.
pub fn is_signed_by(frame: &Frame, key: &Key) -> bool {
    frame.signature.is_some_and(|s| s.hash == hash(frame, key, s.link, s.timestamp))
}

fn hash(frame: &Frame, key: &Key, link: u8, timestamp: u64) -> [u8; 6] {
    let stamp = Signature { link, timestamp, hash: [0; 6] }.stamp();
    let digest = Sha256::new().chain_update(key).chain_update(frame.unsigned_part()).chain_update(stamp).finalize();
    let mut first = [0; 6];
    first.copy_from_slice(&digest[..6]);
    first
}
