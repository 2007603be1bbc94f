//! The recording: audit frames in MCAP files, one channel per node.
//!
//! A chunk is closed whenever something has to be on file before the world hears of it ([`Recording::flush`]), so a
//! killed recorder loses nothing it has sealed. When a file cannot be written the next one is tried; what could not be
//! written is counted and, by whoever drives the recorder, not fed to its core: a seal never covers an entry that is
//! on no file. Chains and seals are the core's business (`wire::audit`).

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::PathBuf;

use mcap::records::MessageHeader;
use mcap::{McapResult, WriteOptions, Writer};
use serde::Serialize;
use wire::id::NodeId;

use crate::clock::trace_us;
use crate::instrument::Frame;

/// A chunk is closed at this size at the latest, in bytes.
const CHUNK: u64 = 64 * 1024;

/// Pause between attempts to open a file after a failure, in microseconds.
const PAUSE_US: u64 = 100_000;

/// Files that one recorder may begin.
const MAX_FILES: u32 = 1_000;

/// What became of frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RecordingStats {
    /// Frames written.
    pub written: u64,
    /// Frames that could not be written.
    pub lost: u64,
    /// Files begun.
    pub files: u32,
}

/// The recording of one run.
pub struct Recording {
    directory: PathBuf,
    open: Option<Open>,
    retry_at_us: u64,
    stats: RecordingStats,
}

struct Open {
    writer: Writer<BufWriter<File>>,
    channels: BTreeMap<NodeId, (u16, u32)>,
}

impl Recording {
    /// A recording in `directory`; the first file is begun with the first frame.
    pub fn new(directory: PathBuf) -> Self {
        Self { directory, open: None, retry_at_us: 0, stats: RecordingStats::default() }
    }

    /// Writes a frame; false when it could not be written.
    pub fn write(&mut self, frame: &Frame) -> bool {
        let written = match self.file() {
            Some(open) => self::Open::write(open, frame).is_ok(),
            None => false,
        };
        if written {
            self.stats.written += 1;
        } else {
            self.fail();
            self.stats.lost += 1;
        }
        written
    }

    /// Closes the chunk and hands it to the operating system; false when that failed.
    pub fn flush(&mut self) -> bool {
        let Some(open) = &mut self.open else { return self.stats.lost == 0 };
        let flushed = open.writer.flush().is_ok();
        if !flushed {
            self.fail();
        }
        flushed
    }

    /// Writes the index and closes the file.
    pub fn finish(&mut self) -> RecordingStats {
        if let Some(mut open) = self.open.take()
            && let Err(error) = open.writer.finish()
        {
            tracing::warn!(%error, "recording not closed");
        }
        self.stats
    }

    /// What has been counted so far.
    pub fn stats(&self) -> RecordingStats {
        self.stats
    }

    fn fail(&mut self) {
        if self.open.take().is_some() {
            self.retry_at_us = trace_us() + PAUSE_US;
        }
    }

    fn file(&mut self) -> Option<&mut Open> {
        if self.open.is_none() && trace_us() >= self.retry_at_us && self.stats.files < MAX_FILES {
            match self.begin() {
                Ok(open) => self.open = Some(open),
                Err(error) => {
                    tracing::warn!(%error, "no recording can be begun");
                    self.retry_at_us = trace_us() + PAUSE_US;
                }
            }
        }
        self.open.as_mut()
    }

    fn begin(&mut self) -> McapResult<Open> {
        std::fs::create_dir_all(&self.directory)?;
        // A recorder that was restarted goes on in the next free file.
        let file = loop {
            let path = self.directory.join(format!("audit-{}.mcap", self.stats.files));
            self.stats.files += 1;
            match File::create_new(&path) {
                Ok(file) => break file,
                Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists && self.stats.files < MAX_FILES => {}
                Err(error) => return Err(error.into()),
            }
        };
        let options = WriteOptions::new().library("holdsafe").compression(None).chunk_size(Some(CHUNK));
        Ok(Open { writer: options.create(BufWriter::new(file))?, channels: BTreeMap::new() })
    }
}

impl Open {
    fn write(&mut self, frame: &Frame) -> McapResult<()> {
        let (channel, sequence) = match self.channels.get(&frame.node) {
            Some(known) => *known,
            None => {
                let topic = format!("/audit/{}", frame.node);
                (self.writer.add_channel(0, &topic, "cbor", &BTreeMap::new())?, 0)
            }
        };
        self.channels.insert(frame.node, (channel, sequence.wrapping_add(1)));
        let time = frame.trace_us.saturating_mul(1_000);
        let header = MessageHeader { channel_id: channel, sequence, log_time: time, publish_time: time };
        self.writer.write_to_known_channel(&header, &frame.bytes)
    }
}
