//! Messages between the services of the unit under test, at times of its run: for a viewer.
//!
//! The input journals of their readers have them, in the twin and live. No judgement or explanation uses them. Drawing them is left to the
//! viewer.

use std::io::BufReader;

use evidence::{Micros, Witnessed};
use link::input_journal::{self, JournalError};
use wire::core::{Input, Topic};
use wire::id::{Boot, NodeId};
use wire::time::Instant;

use crate::checked::Checked;

/// Reader of each topic: frames, the candidates that replace them, and tracks.
const READERS: [(NodeId, Topic); 3] =
    [(NodeId::PERCEPTION, Topic::Frames), (NodeId::PERCEPTION, Topic::Candidates), (NodeId::UNIT_A, Topic::Tracks)];

/// Bytes of messages that are held of a run at most: an hour of frames is more.
const ROOM: usize = 1 << 30;

/// A message between two services.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// Time of the run at which its reader received it.
    pub at: Micros,
    /// Channel of the message.
    pub topic: Topic,
    /// As it was read, header and tags too.
    pub bytes: Vec<u8>,
}

/// Messages of a live run that was recorded.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RecordedMessages {
    /// The messages, in order of time.
    pub messages: Vec<Message>,
    /// Messages of which the journals have the hash alone.
    pub left_out: u64,
}

impl Message {
    /// The message in `input`, which `reader` received at `time`; `None` where no viewer shows it.
    pub fn from_input(reader: NodeId, time: Micros, input: &Input) -> Option<Self> {
        let Input::Bus { topic, bytes } = input else { return None };
        READERS.contains(&(reader, *topic)).then(|| Self { at: time, topic: *topic, bytes: bytes.clone() })
    }
}

/// Messages of the live run `run`, in order of time, by its input journals; none where it has none. Each reader's clock is
/// set by its own entries: `entries` are at times of the run.
///
/// # Errors
/// When an input journal is damaged before its end, or they hold more than a gibibyte.
pub fn read_messages(run: &Checked, entries: &[Witnessed]) -> Result<RecordedMessages, JournalError> {
    let RecordedMessages { mut messages, mut left_out } = RecordedMessages::default();
    let mut room = ROOM;
    for reader in [NodeId::PERCEPTION, NodeId::UNIT_A] {
        let Ok(file) = link::files::open(&run.folder().input_journal(reader, Boot(1))) else { continue };
        let Some(first) = entries.iter().find(|w| w.entry.node == reader) else { continue };
        let run_time = |now: Instant| now.0.saturating_add(first.at).saturating_sub(first.entry.at.0);
        for entry in input_journal::Reader::new(BufReader::new(file))? {
            let (now, input) = match entry {
                Ok(input_journal::Entry::Input { now, input }) => (now, input),
                Ok(input_journal::Entry::Output(_)) => continue,
                Ok(input_journal::Entry::LeftOut { .. }) => {
                    left_out += 1;
                    continue;
                }
                // A writer that is killed leaves its last entry unfinished.
                Err(JournalError::Truncated { .. }) => break,
                Err(error) => return Err(error),
            };
            let Some(message) = Message::from_input(reader, run_time(now), &input) else { continue };
            room = room.checked_sub(message.bytes.len()).ok_or_else(|| {
                std::io::Error::other(format!(
                    "the input journals hold more than the {ROOM} bytes that are read of them"
                ))
            })?;
            messages.push(message);
        }
    }
    messages.sort_by_key(|message| message.at);
    Ok(RecordedMessages { messages, left_out })
}
