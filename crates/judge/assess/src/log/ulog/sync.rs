//! Records of a ULog by their headers, and the sync record behind a damaged place.
//!
//! PX4 writes a sync record twice a second: eleven bytes that no message has by chance. Reading goes on there, as pyulog's does.

use super::error::RecordError;

/// Length of a record's own header: its size, its type.
pub(super) const HEAD: usize = 3;
/// A whole sync record.
const SYNC: [u8; 11] = [8, 0, b'S', 0x2f, 0x73, 0x13, 0x20, 0x25, 0x0c, 0xbb, 0x12];
/// Types of records that the format has.
const TYPES: &[u8] = b"ABCDFILMOPQRS";

/// A record.
pub(super) struct Record<'a> {
    pub(super) kind: u8,
    pub(super) body: &'a [u8],
    /// Place of the next.
    pub(super) next: usize,
}

/// The record at a place, if it is whole.
pub(super) enum There<'a> {
    Record(Record<'a>),
    /// A record that data appended here cuts.
    Cut(usize),
}

/// The record at `at`; `cut` is where appended data begin, if behind `at`.
///
/// # Errors
/// Reason for which no record can be read at `at`.
pub(super) fn read_record(bytes: &[u8], at: usize, cut: Option<usize>) -> Result<There<'_>, RecordError> {
    let left = bytes.len() - at;
    if let (Some(start), true) = (cut, left < HEAD) {
        return Ok(There::Cut(start));
    }
    let [low, high, kind, ..] = bytes[at..] else {
        return Err(RecordError::Header { left });
    };
    let size = usize::from(u16::from_le_bytes([low, high]));
    let next = at + HEAD + size;
    if let Some(start) = cut.filter(|start| next > *start && *start < bytes.len()) {
        return Ok(There::Cut(start));
    }
    // Records of types from after this program are skipped, as the format wants; anything but a capital letter is damage.
    if !kind.is_ascii_uppercase() {
        return Err(RecordError::Type { got: kind });
    }
    let short = || RecordError::Short { kind, size, left: left.saturating_sub(HEAD) };
    let body = bytes.get(at + HEAD..next).ok_or_else(short)?;
    Ok(There::Record(Record { kind, body, next }))
}

/// The first sync record at `from` or behind it.
pub(super) fn find(bytes: &[u8], from: usize) -> Option<usize> {
    let offset = bytes.get(from..)?.windows(SYNC.len()).position(|window| window == SYNC)?;
    Some(from + offset)
}

/// Holds a record against its content and its successor.
///
/// # Errors
/// When a sync record begins within it, or none of any kind behind it: its length is false, or bytes of it are missing.
pub(super) fn check(bytes: &[u8], at: usize, record: &Record<'_>, cut: Option<usize>) -> Result<(), RecordError> {
    let (kind, size) = (record.kind, record.body.len());
    if let Some(sync) = find_sync(bytes, at, record) {
        return Err(RecordError::OverSync { kind, size, sync });
    }
    let cut = cut.is_some_and(|start| record.next + HEAD > start);
    match cut || plausible(bytes, record.next) || find(bytes, record.next).is_none() {
        true => Ok(()),
        false => Err(RecordError::NoneBehind { kind, size }),
    }
}

/// The sync record that begins within this one.
fn find_sync(bytes: &[u8], at: usize, record: &Record<'_>) -> Option<usize> {
    if record.kind == b'S' {
        return None;
    }
    // The last bytes of this one may be its first.
    let end = (record.next + SYNC.len() - 1).min(bytes.len());
    find(bytes.get(..end)?, at + 1).filter(|sync| *sync < record.next)
}

/// True if a record's header stands here, be it of a type from after this program, or the file ends.
fn plausible(bytes: &[u8], at: usize) -> bool {
    let kind = |at: usize| bytes.get(at..at + HEAD).map(|head| head[2]);
    let known = |at: usize| kind(at).is_none_or(|kind| TYPES.contains(&kind));
    let size =
        || bytes.get(at..).and_then(|rest| rest.first_chunk()).map_or(0, |size| usize::from(u16::from_le_bytes(*size)));
    known(at) || kind(at).is_some_and(|kind| kind.is_ascii_uppercase()) && known(at + HEAD + size())
}
