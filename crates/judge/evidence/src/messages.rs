//! Messages between the services of the unit under test, at times of its run: for a viewer.
//!
//! They are read from the input journals of their readers, of a run in the twin or of a live one. No judgement or explanation uses them.

use std::io::BufReader;
use std::path::Path;

use link::input_journal::{self, JournalError};
use wire::core::{Input, Topic};
use wire::id::NodeId;
use wire::time::Instant;

use crate::{Micros, Witnessed};

/// Reader of each topic: frames or the candidates that stand in for them, and tracks.
const READERS: [(NodeId, Topic); 3] =
    [(NodeId::PERCEPTION, Topic::Frames), (NodeId::PERCEPTION, Topic::Candidates), (NodeId::UNIT_A, Topic::Tracks)];

/// The most that is kept of a run, bytes: an hour of frames is more.
pub const ROOM: usize = 1 << 30;

/// A message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// Time at which its reader took it in, time of the run.
    pub at: Micros,
    /// On which channel.
    pub topic: Topic,
    /// As it was read, header and tags too.
    pub bytes: Vec<u8>,
}

/// Messages of a live run that was recorded.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Recorded {
    /// The messages, in order of time.
    pub messages: Vec<Message>,
    /// Messages of which the logs have the hash alone.
    pub left_out: u64,
}

/// `input` of `reader`'s, where it is one of those that are kept.
pub fn kept(reader: NodeId, at: Micros, input: &Input) -> Option<Message> {
    let Input::Bus { topic, bytes } = input else { return None };
    READERS.contains(&(reader, *topic)).then(|| Message { at, topic: *topic, bytes: bytes.clone() })
}

/// Messages of the live run in `directory`, in order of time, by the input journals there; none where it has none. Each reader's clock is
/// set by its own entries: `entries` are at times of the run.
///
/// # Errors
/// When an input journal is damaged before its end, or they hold more than [`ROOM`].
pub fn recorded(directory: &Path, entries: &[Witnessed]) -> Result<Recorded, JournalError> {
    let Recorded { mut messages, mut left_out } = Recorded::default();
    let mut room = ROOM;
    for reader in [NodeId::PERCEPTION, NodeId::UNIT_A] {
        let Ok(file) = link::files::open(&directory.join("mouth").join(format!("{reader}.cbor"))) else { continue };
        let Some(first) = entries.iter().find(|w| w.entry.node == reader) else { continue };
        let on_run = |now: Instant| now.0.saturating_add(first.at).saturating_sub(first.entry.at.0);
        for entry in input_journal::Reader::new(BufReader::new(file))? {
            let (now, input) = match entry {
                Ok(input_journal::Entry::Input { now, input }) => (now, input),
                Ok(input_journal::Entry::Output(_)) => continue,
                Ok(input_journal::Entry::LeftOut { .. }) => {
                    left_out += 1;
                    continue;
                }
                // Its writer was killed.
                Err(JournalError::Truncated { .. }) => break,
                Err(error) => return Err(error),
            };
            let Some(of) = kept(reader, on_run(now), &input) else { continue };
            room = room.checked_sub(of.bytes.len()).ok_or_else(|| {
                std::io::Error::other(format!(
                    "the input journals hold more than the {ROOM} bytes that are read of them"
                ))
            })?;
            messages.push(of);
        }
    }
    messages.sort_by_key(|of| of.at);
    Ok(Recorded { messages, left_out })
}
