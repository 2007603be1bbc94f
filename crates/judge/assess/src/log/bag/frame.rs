//! The records of an MCAP file by their headers, and the next good one behind a damaged place.
//!
//! A header is a kind and a length. The meaning of records is left to `bag`; the inside of a chunk to `chunk`.

use super::chunk;
use super::error::RecordError;

/// Kinds of records that are looked into.
pub(super) const HEADER: u8 = 0x01;
pub(super) const FOOTER: u8 = 0x02;
pub(super) const SCHEMA: u8 = 0x03;
pub(super) const CHANNEL: u8 = 0x04;
pub(super) const MESSAGE: u8 = 0x05;
pub(super) const CHUNK: u8 = 0x06;
pub(super) const STATISTICS: u8 = 0x0b;
pub(super) const DATA_END: u8 = 0x0f;
/// Last kind of the format's version 1; kinds from [`PRIVATE`] on are a writer's own.
const LAST: u8 = DATA_END;
const PRIVATE: u8 = 0x80;
/// Length of a header: its kind, its length.
pub(super) const HEAD: usize = 9;
/// Records in a row by which a place is recognised as sound, in a file without chunks.
const IN_A_ROW: usize = 3;

/// A record.
pub(super) struct Frame<'a> {
    pub(super) kind: u8,
    pub(super) body: &'a [u8],
    /// Place of the next.
    pub(super) next: usize,
}

/// The record at `at`.
///
/// # Errors
/// Reason for which no record can be read there.
pub(super) fn read_frame(bytes: &[u8], at: usize) -> Result<Frame<'_>, RecordError> {
    let left = bytes.len().saturating_sub(at);
    let Some((kind, length)) = head(bytes, at) else {
        return Err(RecordError::Header { left });
    };
    let body = usize::try_from(length).ok().and_then(|length| bytes.get(at + HEAD..)?.get(..length));
    match body {
        Some(body) if known(kind) => Ok(Frame { kind, body, next: at + HEAD + body.len() }),
        Some(_) => Err(RecordError::Kind { kind }),
        None => Err(RecordError::Short { length, left: left - HEAD }),
    }
}

/// The first good record at `from` or behind it; in a file with chunks none of the messages inside one.
pub(super) fn find(bytes: &[u8], from: usize, chunked: bool) -> Option<usize> {
    (from..bytes.len()).find(|offset| good(bytes, *offset, chunked))
}

/// True if a record begins here, and others follow it.
pub(super) fn good(bytes: &[u8], at: usize, chunked: bool) -> bool {
    match head(bytes, at) {
        Some((CHUNK, _)) => self::read_frame(bytes, at).is_ok_and(|frame| chunk::is_one(frame.body)),
        Some(_) | None => row(bytes, at, chunked),
    }
}

/// True if a few records stand here in a row, or as many as there are up to the end mark.
fn row(bytes: &[u8], mut at: usize, chunked: bool) -> bool {
    for i in 0..IN_A_ROW {
        let left = bytes.get(at..).unwrap_or_default();
        if i > 0 && (left.is_empty() || left == mcap::MAGIC) {
            return true;
        }
        match self::read_frame(bytes, at) {
            Ok(frame) if frame.kind >= PRIVATE => return false,
            Ok(frame) if chunked && matches!(frame.kind, HEADER | MESSAGE) => return false,
            // Records of the summary stand behind other records; these may be inside of a chunk.
            Ok(frame) if chunked && i == 0 && matches!(frame.kind, SCHEMA | CHANNEL) => return false,
            Ok(frame) => at = frame.next,
            Err(_) => return false,
        }
    }
    true
}

fn known(kind: u8) -> bool {
    (1..=LAST).contains(&kind) || kind >= PRIVATE
}

fn head(bytes: &[u8], at: usize) -> Option<(u8, u64)> {
    let (kind, rest) = bytes.get(at..)?.split_first()?;
    Some((*kind, u64::from_le_bytes(*rest.first_chunk()?)))
}
