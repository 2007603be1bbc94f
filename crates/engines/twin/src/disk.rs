//! The recorder's disk: treatment of an entry by its process before its core hears of it.
//!
//! As in `link::recorder`: an entry that cannot be written waits, as long as there is room, and the core is fed only
//! written entries; a seal goes out only while none waits. Left out: entries written between two flushes.

use std::collections::VecDeque;

use ground_truth::Note;
use link::recorder::{ROOM, cost};
use wire::core::{Input, Topic};
use wire::id::NodeId;

use super::Twin;
use super::queue::NodeIndex;

/// A disk that may be full for a time.
#[derive(Clone)]
pub(super) struct Disk {
    full: bool,
    waiting: VecDeque<Vec<u8>>,
    room: usize,
    /// Bytes written.
    kept: u64,
    told: u64,
}

impl Disk {
    /// An empty disk.
    pub(super) fn new() -> Self {
        Self { full: false, waiting: VecDeque::new(), room: ROOM, kept: 0, told: 0 }
    }

    /// True if the disk takes no bytes.
    pub(super) fn full(&self) -> bool {
        self.full
    }

    /// Writes an entry, and gives it back once written. On a full disk the entry waits; without room to wait it is
    /// lost.
    fn write(&mut self, bytes: Vec<u8>) -> Option<Vec<u8>> {
        if !self.full {
            self.kept += bytes.len() as u64;
            return Some(bytes);
        }
        if let Some(left) = self.room.checked_sub(cost(bytes.len())) {
            self.room = left;
            self.waiting.push_back(bytes);
        }
        None
    }
}

impl Twin {
    /// Sets whether the disk is full. Once it has room again, the waiting entries are written.
    pub(super) fn fill(&mut self, node: NodeId, on: bool) {
        let Some(disk) = &mut self.disk else { return };
        disk.full = on;
        let waiting = if on { VecDeque::new() } else { std::mem::take(&mut disk.waiting) };
        self.note(Note::DiskFull { node, on });
        let Some(recorder) = self.index(node).filter(|_| !on) else { return };
        self.disk.iter_mut().for_each(|disk| disk.room = ROOM);
        waiting.into_iter().for_each(|bytes| self.take(recorder, Input::Audit { bytes }));
    }

    /// An input of `node` that is to be written before it is heard; given back where no entry is in the way.
    pub(super) fn written(&mut self, input: Input) -> Option<Input> {
        match (&mut self.disk, input) {
            (Some(disk), Input::Audit { bytes }) => disk.write(bytes).map(|bytes| Input::Audit { bytes }),
            (_, input) => Some(input),
        }
    }

    /// True if a publication of `node` on `topic` goes out: of seals, only while everything is on the disk.
    pub(super) fn flushed(&mut self, node: NodeIndex, topic: Topic) -> bool {
        let recorder = self.nodes[usize::from(node)].id == NodeId::RECORDER;
        let Some(disk) = self.disk.as_mut().filter(|_| recorder && topic == Topic::Seals) else { return true };
        if disk.full {
            return false;
        }
        let (written, reported) = (disk.kept, std::mem::replace(&mut disk.told, disk.kept));
        if written > reported {
            self.note(Note::Kept { bytes: written });
        }
        true
    }
}
