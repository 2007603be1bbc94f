//! A chunk of an MCAP file: its records expanded, and held against its CRC before any of them is believed.
//!
//! The sizes are the file's word: no more is expanded than they say, and than a budget for the whole file leaves.

use std::borrow::Cow;
use std::io::Read;

use super::error::RecordError;

/// A chunk as it describes itself, and its data as they are stored.
struct Chunk<'a> {
    size: u64,
    crc: u32,
    compression: &'a str,
    data: &'a [u8],
}

/// A chunk cannot be read.
pub(super) enum Unread {
    /// It is damaged, or packed in a way that is not known.
    Damaged(RecordError),
    /// The budget is used up.
    Large,
}

/// True if these bytes are a chunk's, as far as its sizes tell.
pub(super) fn is_one(body: &[u8]) -> bool {
    let known = |compression: &str| matches!(compression, "" | "zstd" | "lz4");
    parse(body).is_ok_and(|(chunk, stored)| known(chunk.compression) && chunk.data.len() as u64 == stored)
}

/// True if a chunk of a known compression begins these bytes, however many of them there are.
pub(super) fn begins(body: &[u8]) -> bool {
    parse(body).is_ok_and(|(chunk, _)| matches!(chunk.compression, "" | "zstd" | "lz4"))
}

/// The records of a chunk, and whether it has a CRC. Takes its cost from `budget`, in bytes.
pub(super) fn open<'a>(body: &'a [u8], budget: &mut u64) -> Result<(Cow<'a, [u8]>, bool), Unread> {
    let (chunk, stored) = parse(body).map_err(Unread::Damaged)?;
    *budget = budget.checked_sub(body.len() as u64).ok_or(Unread::Large)?;
    if chunk.data.len() as u64 != stored {
        return Err(Unread::Damaged(RecordError::ChunkData { stated: stored, got: chunk.data.len() }));
    }
    let records = expanded(&chunk, budget)?;
    if records.len() as u64 != chunk.size {
        return Err(Unread::Damaged(RecordError::ChunkRecords { stated: chunk.size, got: records.len() }));
    }
    let got = crc32fast::hash(&records);
    if chunk.crc != 0 && got != chunk.crc {
        return Err(Unread::Damaged(RecordError::ChunkCrc { stated: chunk.crc, got }));
    }
    Ok((records, chunk.crc != 0))
}

/// Records that are left of a chunk which the file's end cuts; its CRC cannot be checked.
pub(super) fn cut(body: &[u8], budget: u64) -> Cow<'_, [u8]> {
    let Ok((chunk, _)) = parse(body) else { return Cow::Borrowed(&[]) };
    match chunk.compression {
        "" => Cow::Borrowed(chunk.data),
        "zstd" => zstd::stream::read::Decoder::with_buffer(chunk.data)
            .map_or(Cow::Borrowed(&[]), |decoder| Cow::Owned(read(decoder, budget).0)),
        "lz4" => Cow::Owned(read(lz4_flex::frame::FrameDecoder::new(chunk.data), budget).0),
        _ => Cow::Borrowed(&[]),
    }
}

fn expanded<'a>(chunk: &Chunk<'a>, budget: &mut u64) -> Result<Cow<'a, [u8]>, Unread> {
    let broken = |error: std::io::Error| {
        Unread::Damaged(RecordError::Packed { compression: chunk.compression.to_owned(), error })
    };
    if chunk.compression.is_empty() {
        return Ok(Cow::Borrowed(chunk.data));
    }
    // Charged before the work: a hostile file may have any number of chunks that break at their end.
    *budget = budget.checked_sub(chunk.size).ok_or(Unread::Large)?;
    // One byte more than stated, so that a longer chunk is noticed.
    let most = chunk.size.saturating_add(1);
    let (records, ended) = match chunk.compression {
        "zstd" => read(zstd::stream::read::Decoder::with_buffer(chunk.data).map_err(broken)?, most),
        "lz4" => read(lz4_flex::frame::FrameDecoder::new(chunk.data), most),
        other => return Err(Unread::Damaged(RecordError::Compression { got: other.to_owned() })),
    };
    ended.map(|()| Cow::Owned(records)).map_err(broken)
}

/// All that comes, up to `most` bytes, and the error at its end.
pub(in crate::log) fn read(from: impl Read, most: u64) -> (Vec<u8>, std::io::Result<()>) {
    let mut bytes = Vec::new();
    let ended = from.take(most).read_to_end(&mut bytes).map(|_| ());
    (bytes, ended)
}

/// Most bytes of a compression's name: more than any known one has.
const MAX_COMPRESSION_NAME: usize = 64;

/// A chunk, and the length that it says its data have.
fn parse(body: &[u8]) -> Result<(Chunk<'_>, u64), RecordError> {
    let short = || RecordError::ChunkHeader { got: body.len() };
    let mut rest = body.get(16..).ok_or_else(short)?;
    let size = u64::from_le_bytes(take(&mut rest).ok_or_else(short)?);
    let crc = u32::from_le_bytes(take(&mut rest).ok_or_else(short)?);
    let length = u32::from_le_bytes(take(&mut rest).ok_or_else(short)?) as usize;
    let (name, mut rest) = rest.split_at_checked(length).ok_or_else(short)?;
    // Before the name is read: every offset of a damaged file may be tried, and each try has to cost little.
    if length > MAX_COMPRESSION_NAME {
        return Err(RecordError::CompressionName);
    }
    let compression = std::str::from_utf8(name).map_err(|_| RecordError::CompressionName)?;
    let stored = u64::from_le_bytes(take(&mut rest).ok_or_else(short)?);
    let data = usize::try_from(stored).ok().and_then(|stored| rest.get(..stored)).unwrap_or(rest);
    // With bytes left over the stated length is wrong: all of them are taken, and the lengths differ.
    let data = if data.len() < rest.len() { rest } else { data };
    Ok((Chunk { size, crc, compression, data }, stored))
}

fn take<const N: usize>(rest: &mut &[u8]) -> Option<[u8; N]> {
    let (bytes, left) = rest.split_first_chunk()?;
    *rest = left;
    Some(*bytes)
}
