//! The lengths inside a ClientHello (RFC 5246 §7.4.1.2, RFC 6347 §4.2.1), checked before the library reads them.
//!
//! The library reads extension headers past the end of its buffer and does not skip a session identifier. A ClientHello
//! that is fragmented, has a session identifier (no session is ever resumed), or has an inconsistent length is refused. The content of
//! extensions is left to the library.

use super::observe::Verdict;
use super::record::{HANDSHAKE, Split, split};

const CLIENT_HELLO: u8 = 1;
const HELLO_VERIFY_REQUEST: u8 = 3;
const MESSAGE_HEADER: usize = 12;

/// The largest ClientHello that is checked, in bytes; a longer one is refused.
const MAX_HELLO: usize = 2048;

/// True if every ClientHello in this body of a handshake record has consistent lengths; true for other messages.
pub fn lengths_hold(body: &[u8]) -> bool {
    let mut rest = body;
    while !rest.is_empty() {
        let Some(header) = rest.get(..MESSAGE_HEADER) else { return false };
        let length = u24(&header[1..4]);
        let offset = u24(&header[6..9]);
        let piece = u24(&header[9..12]);
        let Some(message) = rest.get(MESSAGE_HEADER..MESSAGE_HEADER + piece) else { return false };
        if header[0] == CLIENT_HELLO && (offset != 0 || piece != length || hello(message).is_none()) {
            return false;
        }
        rest = &rest[MESSAGE_HEADER + piece..];
    }
    true
}

/// True if a datagram from an unknown peer may open an association: one plaintext record, one sound ClientHello.
pub fn opens_association(datagram: &[u8]) -> bool {
    let mut pieces = split(datagram);
    let (Some(Split::Record(raw)), None) = (pieces.next(), pieces.next()) else { return false };
    raw.content == HANDSHAKE
        && raw.epoch == 0
        && raw.bytes[1] == 254
        && raw.body().first() == Some(&CLIENT_HELLO)
        && is_one_message(raw.body())
        && lengths_hold(raw.body())
}

/// True if the body ends with the first handshake message.
fn is_one_message(body: &[u8]) -> bool {
    body.get(9..MESSAGE_HEADER).is_some_and(|piece| body.len() == MESSAGE_HEADER + u24(piece))
}

/// Verdict on a datagram from an unknown peer before there is an association: passed if it may open one, else the
/// reason.
pub fn before_association(datagram: &[u8]) -> Verdict {
    match split(datagram).next() {
        _ if opens_association(datagram) => Verdict::Passed,
        Some(Split::Record(raw)) if raw.content == HANDSHAKE && raw.epoch == 0 => Verdict::BadHello,
        Some(Split::Record(_) | Split::Remainder(_)) | None => Verdict::UnknownPeer,
    }
}

/// Parts of a sound ClientHello that the cookie exchange needs.
pub struct Parts<'a> {
    /// Sequence number of its record.
    pub sequence: u64,
    /// Its random.
    pub random: &'a [u8],
    /// Its cookie, empty in a first hello.
    pub cookie: &'a [u8],
}

/// Record and message headers, and the version behind them.
const RANDOM: usize = super::record::HEADER + MESSAGE_HEADER + 2;
/// Offset of the cookie's length: behind random and an empty session identifier.
const COOKIE: usize = RANDOM + 32 + 1;

/// The parts of a datagram that [`opens_association`].
pub fn parts(datagram: &[u8]) -> Option<Parts<'_>> {
    let Some(Split::Record(raw)) = split(datagram).next() else { return None };
    let length = usize::from(*datagram.get(COOKIE)?);
    let (random, cookie) = (datagram.get(RANDOM..RANDOM + 32)?, datagram.get(COOKIE + 1..COOKIE + 1 + length)?);
    Some(Parts { sequence: raw.sequence, random, cookie })
}

/// A HelloVerifyRequest with this cookie in a record with this sequence number. Its version is DTLS 1.0, as in RFC 6347 §4.2.1;
/// the library's own has 1.2, and by that our dialler distinguishes them.
pub fn verify_request(sequence: u64, cookie: &[u8]) -> Vec<u8> {
    let body = [&[254, 255, cookie.len() as u8], cookie].concat();
    let length = (body.len() as u32).to_be_bytes();
    let message = [&[HELLO_VERIFY_REQUEST], &length[1..], &[0, 0, 0, 0, 0], &length[1..], &body].concat();
    let mut record = vec![HANDSHAKE, 254, 253, 0, 0];
    record.extend_from_slice(&sequence.to_be_bytes()[2..]);
    record.extend_from_slice(&(message.len() as u16).to_be_bytes());
    record.extend_from_slice(&message);
    record
}

/// The cookie in a HelloVerifyRequest of [`verify_request`]; `None` for anything else, the library's included.
pub fn requested_cookie(datagram: &[u8]) -> Option<&[u8]> {
    let mut pieces = split(datagram);
    let (Some(Split::Record(raw)), None) = (pieces.next(), pieces.next()) else { return None };
    let body = raw.body().get(MESSAGE_HEADER..)?;
    let is_request = raw.content == HANDSHAKE && raw.epoch == 0 && raw.body()[0] == HELLO_VERIFY_REQUEST;
    let cookie = body.get(3..)?;
    (is_request && body[..2] == [254, 255] && usize::from(body[2]) == cookie.len()).then_some(cookie)
}

/// A first hello again, with a cookie: the second message of its handshake.
pub fn with_cookie(first: &[u8], cookie: &[u8]) -> Option<Vec<u8>> {
    if !opens_association(first) || !parts(first)?.cookie.is_empty() {
        return None;
    }
    let mut hello = first[..COOKIE].to_vec();
    hello.push(u8::try_from(cookie.len()).ok()?);
    hello.extend_from_slice(cookie);
    hello.extend_from_slice(&first[COOKIE + 1..]);
    let record = u16::try_from(hello.len() - super::record::HEADER).ok()?.to_be_bytes();
    let message = u32::from(u16::from_be_bytes(record)).checked_sub(MESSAGE_HEADER as u32)?.to_be_bytes();
    hello[11..13].copy_from_slice(&record);
    hello[14..17].copy_from_slice(&message[1..]);
    hello[17..19].copy_from_slice(&[0, 1]);
    hello[22..25].copy_from_slice(&message[1..]);
    // A new sequence number: the far end may have seen the first record.
    hello[10] = hello[10].wrapping_add(1);
    Some(hello)
}

/// Walks a ClientHello to its exact end.
fn hello(message: &[u8]) -> Option<()> {
    if message.len() > MAX_HELLO {
        return None;
    }
    let mut walk = Walk(message);
    walk.skip(2 + 32)?; // version, random
    if walk.u8()? != 0 {
        return None; // session identifier
    }
    let cookie = walk.u8()?;
    walk.skip(cookie)?;
    let suites = walk.u16()?;
    if suites == 0 || !suites.is_multiple_of(2) {
        return None;
    }
    walk.skip(suites)?;
    let compressions = walk.u8()?;
    if compressions == 0 {
        return None;
    }
    walk.skip(compressions)?;
    let extensions = walk.u16()?;
    if extensions != walk.0.len() {
        return None;
    }
    while !walk.0.is_empty() {
        walk.skip(2)?;
        let length = walk.u16()?;
        walk.skip(length)?;
    }
    Some(())
}

struct Walk<'a>(&'a [u8]);

impl Walk<'_> {
    fn skip(&mut self, n: usize) -> Option<()> {
        self.0 = self.0.get(n..)?;
        Some(())
    }

    fn u8(&mut self) -> Option<usize> {
        let value = *self.0.first()?;
        self.skip(1)?;
        Some(usize::from(value))
    }

    fn u16(&mut self) -> Option<usize> {
        let value = u16::from_be_bytes([*self.0.first()?, *self.0.get(1)?]);
        self.skip(2)?;
        Some(usize::from(value))
    }
}

fn u24(bytes: &[u8]) -> usize {
    bytes.iter().fold(0, |acc, byte| acc << 8 | usize::from(*byte))
}
