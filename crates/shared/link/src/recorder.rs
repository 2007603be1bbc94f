//! The recording: audit frames in MCAP files, one channel per node.
//!
//! A chunk is closed before any output that depends on it is sent ([`Recording::flush`]), so a killed recorder loses no sealed
//! entry. A frame counts as on file only after its flush. On a full disk frames wait, within a bound, and go to the next file that can
//! be written. Until then the waiting frames do not reach the recorder's core and no seal is sent, so that a seal never covers an entry
//! that is on no file. Chains and seals are left to the core (`wire::audit`).

use std::collections::{BTreeMap, VecDeque};
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

/// A file is closed at this size, in bytes, and the next one begun: until then the index of its chunks is in memory.
const FILE: u64 = 16 << 20;

/// Pause between attempts to open a file after a failure, in microseconds.
const PAUSE_US: u64 = 100_000;

/// Files that one recorder may begin.
const MAX_FILES: u32 = 1_000;

/// Number of written frames at which they are flushed.
const UNFLUSHED: usize = 1_024;

/// Room for frames that wait for a file, in bytes, each with its overhead.
pub const ROOM: usize = 16 << 20;

/// Share of [`ROOM`] that a frame of this many bytes takes.
pub fn cost(bytes: usize) -> usize {
    bytes + size_of::<Waiting>()
}

/// Counts of frames by outcome.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RecordingStats {
    /// Frames on file.
    pub written: u64,
    /// Frames that are on no file: there was no room for them to wait, or no file could be written until the end.
    pub lost: u64,
    /// Files begun.
    pub files: u32,
}

/// The recording of one run.
pub struct Recording {
    directory: PathBuf,
    open: Option<Open>,
    retry_at_us: u64,
    /// Frames that are not known to be on file, oldest first.
    waiting: VecDeque<Waiting>,
    /// Number of them, from the oldest on, already written to the open file.
    unflushed: usize,
    room: usize,
    /// Entries that were written and are not yet taken by [`Recording::written`].
    fresh: VecDeque<Vec<u8>>,
    stats: RecordingStats,
}

struct Waiting {
    frame: Frame,
    /// True if the recorder's core has not got it yet.
    feeds: bool,
}

struct Open {
    writer: Writer<BufWriter<File>>,
    /// Handle of the writer's file, for cutting off an incomplete write.
    file: File,
    path: PathBuf,
    /// Its length after the last flush.
    length: u64,
    /// Frames in that length.
    frames: u64,
    channels: BTreeMap<NodeId, (u16, u32)>,
}

impl Recording {
    /// A recording in `directory`; the first file is begun with the first frame.
    pub fn new(directory: PathBuf) -> Self {
        Self {
            directory,
            open: None,
            retry_at_us: 0,
            waiting: VecDeque::new(),
            unflushed: 0,
            room: ROOM,
            fresh: VecDeque::new(),
            stats: RecordingStats::default(),
        }
    }

    /// Writes a frame, or queues it.
    pub fn write(&mut self, frame: Frame) {
        self.take(frame, false);
    }

    /// Writes a frame for the recorder's core, or queues it; [`Recording::written`] returns it after it is written.
    pub fn receive(&mut self, frame: Frame) {
        self.take(frame, true);
    }

    /// The next entry that was received and is now written.
    pub fn written(&mut self) -> Option<Vec<u8>> {
        self.fresh.pop_front()
    }

    /// Closes the chunk and hands it to the operating system; true when every frame so far is on file.
    pub fn flush(&mut self) -> bool {
        self.write_waiting();
        let Some(open) = &mut self.open else { return self.waiting.is_empty() };
        if self.unflushed < self.waiting.len() || open.flush(self.unflushed as u64).is_err() {
            self.fail();
            return false;
        }
        self.stats.written += self.unflushed as u64;
        self.unflushed = 0;
        self.waiting.clear();
        self.room = ROOM;
        if open.length >= FILE {
            self.close();
        }
        true
    }

    /// Writes the index of the open file.
    fn close(&mut self) {
        if let Some(mut open) = self.open.take()
            && let Err(error) = open.writer.finish()
        {
            tracing::warn!(%error, "recording not closed");
            open.cut();
        }
    }

    /// Writes the index and closes the file.
    pub fn finish(&mut self) -> RecordingStats {
        // The last attempt does not wait for the pause after a failure.
        self.retry_at_us = 0;
        self.flush();
        self.close();
        self.stats.lost += self.waiting.len() as u64;
        self.waiting.clear();
        self.stats
    }

    /// The counters so far.
    pub fn stats(&self) -> RecordingStats {
        self.stats
    }

    fn take(&mut self, frame: Frame, feeds: bool) {
        let cost = cost(frame.bytes.len());
        if cost > self.room {
            self.stats.lost += 1;
            return;
        }
        self.room -= cost;
        self.waiting.push_back(Waiting { frame, feeds });
        self.write_waiting();
        if self.unflushed >= UNFLUSHED {
            self.flush();
        }
    }

    /// Writes waiting frames, up to the first failure.
    fn write_waiting(&mut self) {
        if self.unflushed < self.waiting.len() {
            self.begin_if_due();
        }
        let Some(open) = &mut self.open else { return };
        for waiting in self.waiting.iter_mut().skip(self.unflushed) {
            if let Err(error) = open.write(&waiting.frame) {
                tracing::debug!(%error, "frame not written");
                return self.fail();
            }
            self.unflushed += 1;
            // Once: after a failure the frame is written again, to the next file. The core may have it before its flush, since its
            // seals wait for that flush (`drive::ports`).
            if std::mem::take(&mut waiting.feeds) {
                self.fresh.push_back(waiting.frame.bytes.clone());
            }
        }
    }

    /// Closes the file at its last flush; the frames after it wait for the next file.
    fn fail(&mut self) {
        self.unflushed = 0;
        let Some(open) = self.open.take() else { return };
        self.retry_at_us = trace_us() + PAUSE_US;
        // A removed file does not count: on a full disk each attempt makes one, and would use up `MAX_FILES`.
        self.stats.files -= u32::from(open.cut());
    }

    fn begin_if_due(&mut self) {
        if self.open.is_some() || trace_us() < self.retry_at_us || self.stats.files >= MAX_FILES {
            return;
        }
        match self.begin() {
            Ok(open) => self.open = Some(open),
            Err(error) => {
                tracing::debug!(%error, "no recording can be begun");
                self.retry_at_us = trace_us() + PAUSE_US;
            }
        }
    }

    fn begin(&mut self) -> McapResult<Open> {
        std::fs::create_dir_all(&self.directory)?;
        // A restarted recorder continues in the next free file, and never overwrites one of its earlier life.
        let (path, file) = loop {
            let path = self.directory.join(format!("audit-{}.mcap", self.stats.files));
            match File::create_new(&path) {
                Ok(file) => break (path, file),
                Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists && self.stats.files < MAX_FILES => {
                    self.stats.files += 1;
                }
                Err(error) => return Err(error.into()),
            }
        };
        let options = WriteOptions::new().library("holdsafe").compression(None).chunk_size(Some(CHUNK));
        let writer = options.create(BufWriter::new(file.try_clone()?))?;
        let mut open = Open { writer, file, path, length: 0, frames: 0, channels: BTreeMap::new() };
        // A full disk shows here, before any frame is written to it.
        if let Err(error) = open.flush(0) {
            open.cut();
            return Err(error);
        }
        self.stats.files += 1;
        Ok(open)
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

    /// Hands everything to the operating system, with `frames` new frames in it.
    fn flush(&mut self, frames: u64) -> McapResult<()> {
        self.writer.flush()?;
        self.length = self.file.metadata()?.len();
        self.frames += frames;
        Ok(())
    }

    /// Cuts off the unflushed part; true when no frame is left and the file is removed.
    fn cut(self) -> bool {
        let Open { writer, file, path, length, frames, .. } = self;
        // Dropped before the cut: the writer tries to write its end, which is cut off too.
        drop(writer);
        let done = if frames == 0 { std::fs::remove_file(&path) } else { file.set_len(length) };
        if let Err(error) = &done {
            tracing::warn!(%error, "a file that could not be written on was not cut");
        }
        frames == 0 && done.is_ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(trace_us: u64, length: usize) -> Frame {
        Frame { trace_us, node: NodeId::SIM, bytes: vec![trace_us as u8; length] }
    }

    /// A recording in a folder that cannot be created, since a file has its path.
    fn blocked(parent: &tempfile::TempDir) -> (Recording, PathBuf) {
        let folder = parent.path().join("recording");
        std::fs::write(&folder, "in the way").unwrap();
        (Recording::new(folder.clone()), folder)
    }

    /// Frames wait for a file, and are reported in order once they are in one.
    #[test]
    fn waiting_frames_are_reported_in_file_order() {
        let parent = tempfile::tempdir().unwrap();
        let (mut recording, folder) = blocked(&parent);
        (1..=3).for_each(|time| recording.receive(frame(time, 10)));
        recording.write(frame(4, 10));
        assert!(!recording.flush() && recording.written().is_none());
        std::fs::remove_file(&folder).unwrap();
        while !recording.flush() {
            std::thread::yield_now();
        }
        let fed: Vec<u8> = std::iter::from_fn(|| recording.written()).map(|bytes| bytes[0]).collect();
        assert_eq!(fed, [1, 2, 3], "without the recorder's own");
        assert_eq!(recording.finish(), RecordingStats { written: 4, lost: 0, files: 1 });
        let recorded = crate::mcap_frames::frames_of_folder(&folder).unwrap();
        assert_eq!(recorded.iter().map(|f| f.trace_us).collect::<Vec<_>>(), [1, 2, 3, 4]);
    }

    /// They never reach the recorder's core.
    #[test]
    fn frames_beyond_the_room_are_lost_unreported() {
        let parent = tempfile::tempdir().unwrap();
        let (mut recording, _folder) = blocked(&parent);
        let room = ROOM / cost(1000);
        (0..=room as u64).for_each(|time| recording.receive(frame(time, 1000)));
        assert_eq!((recording.stats().lost, recording.written()), (1, None));
        assert_eq!(recording.finish(), RecordingStats { written: 0, lost: room as u64 + 1, files: 0 });
    }

    #[test]
    fn long_recording_goes_on_in_further_files() {
        let parent = tempfile::tempdir().unwrap();
        let folder = parent.path().join("recording");
        let mut recording = Recording::new(folder.clone());
        let frames = 2 * FILE / 50_000 + 100;
        (1..=frames).for_each(|time| {
            recording.receive(frame(time, 50_000));
            assert!(recording.flush());
        });
        assert_eq!(recording.finish(), RecordingStats { written: frames, lost: 0, files: 3 });
        let recorded = crate::mcap_frames::frames_of_folder(&folder).unwrap();
        assert!(recorded.iter().map(|f| f.trace_us).eq(1..=frames));
    }

    #[test]
    fn unflushed_frames_go_to_the_next_file_once() {
        let parent = tempfile::tempdir().unwrap();
        let folder = parent.path().join("recording");
        let mut recording = Recording::new(folder.clone());
        recording.receive(frame(1, 10));
        assert!(recording.flush());
        recording.receive(frame(2, 10));
        assert_eq!(recording.written().zip(recording.written()).map(|(a, b)| (a[0], b[0])), Some((1, 2)));
        recording.fail();
        while !recording.flush() {
            std::thread::yield_now();
        }
        assert_eq!(recording.written(), None, "the core has it already");
        assert_eq!(recording.finish(), RecordingStats { written: 2, lost: 0, files: 2 });
        let recorded = crate::mcap_frames::frames_of_folder(&folder).unwrap();
        assert_eq!(recorded.iter().map(|f| f.trace_us).collect::<Vec<_>>(), [1, 2]);
    }
}
