//! Bytes of the relay's own making: DTLS 1.2 records (RFC 6347 §4.1) without any key, and damage to captured ones.

use rand_chacha::ChaCha8Rng;

use crate::plan::{Damage, InjectedContent};
use crate::schedule::{noise, uniform_below};

const ALERT: u8 = 21;
const HANDSHAKE: u8 = 22;
const APPLICATION_DATA: u8 = 23;
const VERSION: [u8; 2] = [0xfe, 0xfd];
/// Place of the cookie's length in a ClientHello: behind version, random and an empty session identifier.
const COOKIE: usize = 2 + 32 + 1;

/// A datagram that holds `content`.
pub(super) fn inject(content: InjectedContent, rng: &mut ChaCha8Rng) -> Vec<u8> {
    let sequence = uniform_below(rng, 1 << 20);
    match content {
        InjectedContent::PlaintextAlert => record(ALERT, 0, sequence, &[2, 80]),
        InjectedContent::CloseNotify => record(ALERT, 0, sequence, &[1, 0]),
        InjectedContent::AppData => record(APPLICATION_DATA, 0, sequence, &noise(rng, 48)),
        InjectedContent::Garbage => record(APPLICATION_DATA, 1, sequence, &noise(rng, 64)),
        InjectedContent::Noise => {
            let length = 1 + uniform_below(rng, 200) as usize;
            noise(rng, length)
        }
        InjectedContent::ClientHello => {
            let hello = client_hello(rng);
            record(HANDSHAKE, 0, 0, &message(hello.len(), &hello))
        }
        InjectedContent::ClientHelloTruncated => {
            let mut hello = client_hello(rng);
            match uniform_below(rng, 3) {
                // Cut short: it claims more than there is.
                0 => return record(HANDSHAKE, 0, 0, &message(hello.len(), &hello[..hello.len() / 2])),
                // The outer lengths are right; the last extension reaches past the end.
                1 => hello.truncate(hello.len() - 1 - uniform_below(rng, 4) as usize),
                // So does the cookie.
                _ => hello[COOKIE] = 0xff,
            }
            record(HANDSHAKE, 0, 0, &message(hello.len(), &hello))
        }
    }
}

/// `bytes` damaged; `before` is the datagram that went before it in the same direction.
pub(super) fn damage(damage: Damage, bytes: &[u8], before: &[u8], rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mut damaged = bytes.to_vec();
    match damage {
        Damage::Flip => flip(&mut damaged, rng),
        Damage::Truncate => damaged.truncate(uniform_below(rng, bytes.len() as u64) as usize),
        Damage::Extend => {
            let length = 1 + uniform_below(rng, 32) as usize;
            damaged.extend_from_slice(&noise(rng, length));
        }
        Damage::Splice => {
            let cut = uniform_below(rng, bytes.len() as u64) as usize;
            damaged.truncate(cut);
            damaged.extend_from_slice(before.get(cut..).unwrap_or(&[]));
            if damaged == bytes || before.is_empty() {
                damaged = bytes.to_vec();
                flip(&mut damaged, rng);
            }
        }
    }
    damaged
}

/// Flips one random bit; empty bytes stay empty.
pub(super) fn flip(bytes: &mut [u8], rng: &mut ChaCha8Rng) {
    let bit = uniform_below(rng, bytes.len() as u64 * 8);
    if let Some(byte) = bytes.get_mut((bit / 8) as usize) {
        *byte ^= 1 << (bit % 8);
    }
}

fn record(content: u8, epoch: u16, sequence: u64, body: &[u8]) -> Vec<u8> {
    let mut bytes = vec![content];
    bytes.extend_from_slice(&VERSION);
    bytes.extend_from_slice(&epoch.to_be_bytes());
    bytes.extend_from_slice(&sequence.to_be_bytes()[2..]);
    bytes.extend_from_slice(&(body.len() as u16).to_be_bytes());
    bytes.extend_from_slice(body);
    bytes
}

/// A ClientHello message in one fragment that claims `length` bytes.
fn message(length: usize, body: &[u8]) -> Vec<u8> {
    let claimed = (length as u32).to_be_bytes();
    let mut bytes = vec![1];
    bytes.extend_from_slice(&claimed[1..]);
    bytes.extend_from_slice(&[0, 0, 0, 0, 0]); // message sequence, fragment offset
    bytes.extend_from_slice(&claimed[1..]);
    bytes.extend_from_slice(body);
    bytes
}

/// The body of a ClientHello: no session, no cookie, one suite, the extensions that such a suite needs.
fn client_hello(rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mut body = VERSION.to_vec();
    body.extend_from_slice(&noise(rng, 32));
    body.extend_from_slice(&[0, 0]); // session identifier, cookie
    body.extend_from_slice(&[0, 2, 0xc0, 0x2b]); // ECDHE_ECDSA_WITH_AES_128_GCM_SHA256
    body.extend_from_slice(&[1, 0]); // no compression
    let extensions: [u8; 22] = [
        0, 10, 0, 4, 0, 2, 0, 29, // supported groups: x25519
        0, 11, 0, 2, 1, 0, // point formats: uncompressed
        0, 13, 0, 4, 0, 2, 4, 3, // signature algorithms: ecdsa_secp256r1_sha256
    ];
    body.extend_from_slice(&(extensions.len() as u16).to_be_bytes());
    body.extend_from_slice(&extensions);
    body
}
