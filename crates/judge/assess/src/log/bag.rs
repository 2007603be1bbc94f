//! MCAP: the messages of a file in order, and the places that could not be read.
//!
//! `frame` finds records, `chunk` expands them, `message` reads numbers. The crate `mcap` parses single records. A chunk with a wrong CRC
//! is left out whole, and reading goes on with the next sound record. Schemas and channels that were lost with a chunk are taken from the
//! summary at the file's end. A topic with an unreadable definition is skipped; a request for it is answered with the error.

mod chunk;
mod error;
mod frame;
mod message;
mod tables;

pub(super) use chunk::read;
pub(super) use message::{Message, ZSTD};
pub(super) use tables::Tables;

use std::cell::Cell;

use super::found::Found;
use chunk::Unread;
use error::RecordError;
use tables::Spare;

/// Most bytes of all records of one file once its chunks are expanded.
const MAX_EXPANDED: u64 = 1 << 30;

/// Takes the index of a topic, the number of places that were lost before, and a message.
pub(super) type Each<'a> = dyn FnMut(usize, u32, &Message<'_>) + 'a;

/// A walk through one file.
struct Walk<'a, 'e> {
    bytes: &'a [u8],
    tables: Tables,
    spare: Option<Spare<'a>>,
    found: Found,
    /// Budget of bytes that are expanded.
    budget: Cell<u64>,
    chunked: bool,
    /// Chunks, and the number without a CRC.
    chunks: [u64; 2],
    /// Messages by the file's own account.
    counted: Option<u64>,
    footer: bool,
    each: &'e mut Each<'e>,
}

/// Reads every message.
pub(super) fn walk<'e>(bytes: &[u8], each: &'e mut Each<'e>) -> (Tables, Found) {
    let mut walk = Walk {
        bytes,
        tables: Tables::default(),
        spare: Spare::from_file(bytes),
        found: Found::default(),
        budget: Cell::new(MAX_EXPANDED),
        chunked: false,
        chunks: [0; 2],
        counted: None,
        footer: false,
        each,
    };
    walk.chunked = walk.spare.as_ref().is_some_and(|spare| spare.chunked);
    walk.records();
    walk.end()
}

/// Reason that a record was not taken.
enum Lost {
    /// The record is left out; reading goes on.
    Left(RecordError),
    /// Reading ends.
    All(RecordError),
}

impl<'a> Walk<'a, '_> {
    fn records(&mut self) {
        let mut offset = mcap::MAGIC.len();
        while offset < self.bytes.len() && !self.footer {
            let (result, next) = match frame::read_frame(self.bytes, offset) {
                Ok(frame) => (self.take(frame.kind, frame.body), Some(frame.next)),
                Err(error) => (Err(Lost::Left(error)), None),
            };
            let reason = match result {
                Ok(()) => {
                    offset = next.unwrap_or(self.bytes.len());
                    continue;
                }
                Err(Lost::Left(error)) => error,
                Err(Lost::All(error)) => return self.found.stop(offset, error.to_string()),
            };
            self.chunked |= self.body_at(offset).is_some_and(chunk::begins);
            // A damaged record's length is trusted only if another record follows it.
            let next = next.filter(|next| frame::good(self.bytes, *next, self.chunked));
            match next.or_else(|| frame::find(self.bytes, offset + 1, self.chunked)) {
                Some(next) => {
                    self.found.lose(offset, next, &reason);
                    offset = next;
                }
                None => return self.stop(offset, &reason),
            }
        }
        if !self.footer {
            let offset = offset.min(self.bytes.len());
            self.found.stop(offset, "the file ends without a footer, as a cut one does".to_owned());
        }
    }

    /// The bytes behind the header of a chunk here, to the file's end.
    fn body_at(&self, at: usize) -> Option<&'a [u8]> {
        self.bytes.get(at).filter(|kind| **kind == frame::CHUNK).and(self.bytes.get(at + frame::HEAD..))
    }

    /// Ends the reading at a record that is not whole; of a chunk, with the messages that are there.
    fn stop(&mut self, at: usize, reason: &RecordError) {
        if let Some(body) = self.body_at(at) {
            let records = chunk::cut(body, self.budget.get());
            let _at_the_cut = self.walk_chunk(&records);
        }
        self.found.stop(at, reason.to_string());
    }

    fn take(&mut self, kind: u8, body: &'a [u8]) -> Result<(), Lost> {
        match kind {
            frame::CHUNK => self.chunk(body),
            // After the loss of a chunk its content may look like records of the file.
            frame::MESSAGE if self.chunked && self.found.lost() > 0 => Err(Lost::Left(RecordError::OutsideChunks)),
            frame::SCHEMA | frame::CHANNEL | frame::MESSAGE => self.record(kind, body).map_err(Lost::Left),
            frame::FOOTER => {
                self.footer = true;
                Ok(())
            }
            frame::DATA_END => {
                self.check_data(body);
                Ok(())
            }
            frame::STATISTICS => {
                self.counted = body.first_chunk().map(|bytes| u64::from_le_bytes(*bytes));
                Ok(())
            }
            _ if chunk::is_one(body) => Err(Lost::Left(RecordError::ChunkUnderKind { kind })),
            _ => Ok(()),
        }
    }

    fn chunk(&mut self, body: &'a [u8]) -> Result<(), Lost> {
        self.chunked = true;
        let mut budget = self.budget.get();
        let opened = chunk::open(body, &mut budget);
        self.budget.set(budget);
        let (records, checked) = opened.map_err(|unread| match unread {
            Unread::Damaged(error) => Lost::Left(error),
            Unread::Large => Lost::All(RecordError::Expanded),
        })?;
        self.chunks[0] += 1;
        self.chunks[1] += u64::from(!checked);
        self.walk_chunk(&records).map_err(Lost::Left)
    }

    /// The records of a chunk. One that cannot be read is noted: the next is found by its length.
    fn walk_chunk(&mut self, records: &[u8]) -> Result<(), RecordError> {
        let mut offset = 0;
        while offset < records.len() {
            let frame = frame::read_frame(records, offset)?;
            if let frame::SCHEMA | frame::CHANNEL | frame::MESSAGE = frame.kind {
                self.record(frame.kind, frame.body)?;
            }
            offset = frame.next;
        }
        Ok(())
    }

    fn record(&mut self, kind: u8, body: &[u8]) -> Result<(), RecordError> {
        let record = mcap::parse_record(kind, body)?;
        self.tables.take(&record, self.spare.as_ref(), (self.found.lost(), &self.budget), self.each)
    }

    /// Holds the data against the CRC over all of them, where the file has one.
    fn check_data(&mut self, body: &[u8]) {
        let stated = body.first_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes));
        // `body` is a slice of `bytes`: its address gives the offset of the record, which callers do not pass on.
        let from = self.bytes.as_ptr_range().start as usize;
        let end = (body.as_ptr_range().start as usize - from).saturating_sub(frame::HEAD);
        let data = self.bytes.get(..end).unwrap_or_default();
        if stated != 0 && self.found.lost() == 0 && crc32fast::hash(data) != stated {
            self.found
                .note("The CRC over the file's data does not fit, and the place of the damage is not known".to_owned());
        }
    }

    fn end(mut self) -> (Tables, Found) {
        let read: u64 = self.tables.topics.iter().map(|topic| topic.records).sum();
        if let Some(counted) = self.counted.filter(|counted| *counted != read && self.found.is_whole()) {
            self.found.note(format!("The file's summary counts {counted} messages, {read} were read"));
        }
        if self.chunks[1] > 0 {
            let [all, unchecked] = self.chunks;
            self.found.note(format!("{unchecked} of {all} chunks have no CRC: damage within them cannot be seen"));
        }
        self.tables.finish(&mut self.found);
        (self.tables, self.found)
    }
}
