//! The lengths inside a ClientHello (RFC 5246 §7.4.1.2, RFC 6347 §4.2.1), checked before the library walks them.
//!
//! The library reads extension headers past the end of its buffer and does not skip a session identifier. A ClientHello
//! that is fragmented, carries a session identifier (we never resume), or has any length that does not add up is not
//! let through. What the extensions mean is left to the library.

use super::observe::Verdict;
use super::record::{HANDSHAKE, Split, split};

const CLIENT_HELLO: u8 = 1;
const MESSAGE_HEADER: usize = 12;

/// The largest ClientHello that is looked at, in bytes.
const MAX_HELLO: usize = 2048;

/// Whether every ClientHello in this body of a handshake record has consistent lengths; true for other messages.
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

/// Whether a datagram from a stranger may open an association: one plaintext record, one sound ClientHello.
pub fn opens_association(datagram: &[u8]) -> bool {
    let mut pieces = split(datagram);
    let (Some(Split::Record(raw)), None) = (pieces.next(), pieces.next()) else { return false };
    raw.content == HANDSHAKE
        && raw.epoch == 0
        && raw.bytes[1] == 254
        && raw.body().first() == Some(&CLIENT_HELLO)
        && lengths_hold(raw.body())
}

/// What a datagram from a stranger comes to before there is an association: passed when it may open one, else why not.
pub fn at_the_door(datagram: &[u8]) -> Verdict {
    match split(datagram).next() {
        _ if opens_association(datagram) => Verdict::Passed,
        Some(Split::Record(raw)) if raw.content == HANDSHAKE && raw.epoch == 0 => Verdict::BadHello,
        Some(Split::Record(_) | Split::Remainder(_)) | None => Verdict::Stranger,
    }
}

/// Walks a ClientHello to its exact end.
fn hello(message: &[u8]) -> Option<()> {
    if message.len() > MAX_HELLO {
        return None;
    }
    let mut at = Walk(message);
    at.skip(2 + 32)?; // version, random
    if at.u8()? != 0 {
        return None; // session identifier
    }
    let cookie = at.u8()?;
    at.skip(cookie)?;
    let suites = at.u16()?;
    if suites == 0 || !suites.is_multiple_of(2) {
        return None;
    }
    at.skip(suites)?;
    let compressions = at.u8()?;
    if compressions == 0 {
        return None;
    }
    at.skip(compressions)?;
    let extensions = at.u16()?;
    if extensions != at.0.len() {
        return None;
    }
    while !at.0.is_empty() {
        at.skip(2)?;
        let length = at.u16()?;
        at.skip(length)?;
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
