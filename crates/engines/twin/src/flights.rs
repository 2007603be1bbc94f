//! The six flights of a handshake with mutual certificates, as bytes on the wire, without its cryptography.
//!
//! Record types and lengths are those of the real library with the certificates of a run (RFC 6347 §4.2.4; seen in live
//! logs). The content is the output of a keyed hash, so that a flight is known by its bytes and cannot be made without
//! the key. Senders and times of flights are the business of `super::net` and `super::sessions`.

use link::guard::SEAL;
use link::guard::record::{CHANGE_CIPHER_SPEC, HANDSHAKE, HEADER, Split, split};

/// Flights of a handshake; even ones are the dialler's.
pub(super) const FLIGHTS: u8 = 6;
/// Header of a handshake message (RFC 6347 §4.2.2), bytes.
const MESSAGE: usize = 12;
/// Bytes around cookie and extension in a ClientHello: version and random, no session identifier, the cookie's length,
/// one suite, no compression, the extensions' length, an extension's header.
const HELLO: usize = 2 + 32 + 1 + 1 + 4 + 2 + 2 + 4;
/// The cookie of a HelloVerifyRequest, bytes.
const COOKIE: usize = 20;
/// Filling of the one extension, bytes: as long together as the extensions of the real library.
const FILLING: usize = 76;

/// A record of a flight.
#[derive(Clone, Copy)]
enum Part {
    /// A first or second ClientHello, by the length of its cookie.
    Hello(usize),
    /// Another plaintext message: its type, and its length.
    Message(u8, usize),
    /// A ChangeCipherSpec record.
    Change,
    /// Finished, sealed, by the length of its message.
    Finished(usize),
}

const PARTS: [&[Part]; FLIGHTS as usize] = [
    &[Part::Hello(0)],
    &[Part::Message(3, 23)],
    &[Part::Hello(COOKIE)],
    &[
        Part::Message(2, 67),
        Part::Message(11, 461),
        Part::Message(12, 144),
        Part::Message(13, 21),
        Part::Message(14, 0),
    ],
    &[Part::Message(11, 460), Part::Message(16, 66), Part::Message(15, 75), Part::Change, Part::Finished(24)],
    &[Part::Change, Part::Finished(24)],
];

/// The flights of one handshake.
pub(super) struct Flights {
    key: [u8; 32],
}

impl Flights {
    /// Flights of the handshake `number` between the two ends who share `secret`.
    pub(super) fn new(secret: &[u8; 32], number: u32) -> Self {
        let mut key = blake3::Hasher::new_keyed(secret);
        Self { key: *key.update(b"flights").update(&number.to_le_bytes()).finalize().as_bytes() }
    }

    /// The datagram of `flight`, its plaintext records numbered from `*sequence`.
    pub(super) fn datagram(&self, flight: u8, sequence: &mut u64) -> Vec<u8> {
        let mut bytes = Vec::new();
        for (content, epoch, body) in self.records(flight) {
            bytes.extend_from_slice(&[content, 0xfe, 0xfd, 0, epoch]);
            bytes.extend_from_slice(&if epoch == 0 { *sequence } else { 0 }.to_be_bytes()[2..]);
            bytes.extend_from_slice(&(body.len() as u16).to_be_bytes());
            bytes.extend_from_slice(&body);
            *sequence += u64::from(epoch == 0);
        }
        bytes
    }

    /// Number of the flight, of the handshake `number`, that a datagram is, at any numbers of its records: all of one
    /// flight, and no other bytes.
    pub(super) fn which(secret: &[u8; 32], number: u32, datagram: &[u8]) -> Option<u8> {
        // Nearly all datagrams carry data, and are distinguished by their first byte.
        if !matches!(datagram.first(), Some(&(HANDSHAKE | CHANGE_CIPHER_SPEC))) {
            return None;
        }
        let flights = Self::new(secret, number);
        let bare = |piece| match piece {
            Split::Record(raw) => Some((raw.content, raw.epoch as u8, raw.body().to_vec())),
            Split::Remainder(_) => None,
        };
        let records: Vec<_> = split(datagram).map(bare).collect::<Option<_>>()?;
        (0..FLIGHTS).find(|flight| length(*flight) == datagram.len() && flights.records(*flight) == records)
    }

    /// Content type, epoch and body of each record.
    fn records(&self, flight: u8) -> Vec<(u8, u8, Vec<u8>)> {
        let place = |i: usize| blake3::Hasher::new_keyed(&self.key).update(&[flight, i as u8]).finalize_xof();
        let body = |(i, part): (usize, &Part)| part.record(place(i));
        PARTS[usize::from(flight)].iter().enumerate().map(body).collect()
    }
}

impl Part {
    /// Length of its record's body, bytes.
    fn length(self) -> usize {
        match self {
            Part::Hello(cookie) => MESSAGE + HELLO + cookie + FILLING,
            Part::Message(_, length) => MESSAGE + length,
            Part::Change => 1,
            Part::Finished(length) => SEAL + length,
        }
    }

    fn record(self, mut filling: blake3::OutputReader) -> (u8, u8, Vec<u8>) {
        let mut body = vec![0; self.length()];
        filling.fill(&mut body);
        match self {
            Part::Hello(cookie) => {
                header(1, &mut body);
                let index = MESSAGE + 34;
                body[index..index + 2].copy_from_slice(&[0, cookie as u8]);
                // TLS_ECDHE_ECDSA_WITH_AES_128_GCM_SHA256 alone, no compression, an extension for private use.
                let index = index + 2 + cookie;
                let extension = [0, 4 + FILLING as u8, 0xff, 0, 0, FILLING as u8];
                body[index..index + 6].copy_from_slice(&[0, 2, 0xc0, 0x2b, 1, 0]);
                body[index + 6..index + 12].copy_from_slice(&extension);
                (HANDSHAKE, 0, body)
            }
            Part::Message(kind, _) => {
                header(kind, &mut body);
                (HANDSHAKE, 0, body)
            }
            Part::Change => (CHANGE_CIPHER_SPEC, 0, vec![1]),
            Part::Finished(_) => (HANDSHAKE, 1, body),
        }
    }
}

/// Length of a flight's datagram, bytes.
fn length(flight: u8) -> usize {
    PARTS[usize::from(flight)].iter().map(|part| HEADER + part.length()).sum()
}

/// The header of an unfragmented message over the first bytes of `body`.
fn header(kind: u8, body: &mut [u8]) {
    let length = ((body.len() - MESSAGE) as u32).to_be_bytes();
    body[0] = kind;
    body[1..4].copy_from_slice(&length[1..]);
    body[6..9].fill(0);
    body[9..12].copy_from_slice(&length[1..]);
}
