//! A telemetry log of MAVLink (`.tlog`), as QGroundControl, Mission Planner and MAVProxy write it: the records in order, and the places that
//! could not be read.
//!
//! `frame` reads a record, `messages` has the messages that carry an input of the guards. The crate `mavlink` was measured and left out: it builds
//! for 9 s, and gives typed messages where a map asks for fields by name, without the offset of a damage. Behind a damage reading goes on at
//! the next sound record. A link that lost messages leaves no trace here: a ground station writes the frames that came through.

mod frame;
mod messages;

use std::collections::{BTreeMap, BTreeSet};

use super::found::Found;
use super::layout::Formats;
use super::{MAX_TOPICS, Topic};
use frame::Record;
use messages::MESSAGES;

/// Most numbers of skipped messages that the note about them names.
const MAX_NAMED: usize = 8;
/// Longest payload of a frame: its length is one byte.
const MAX_PAYLOAD: usize = u8::MAX as usize;

/// The tables that records refer to.
pub(super) struct Tables {
    pub(super) formats: Formats,
    pub(super) topics: Vec<Topic>,
    /// Topics by message and sender.
    senders: BTreeMap<(usize, (u8, u8)), usize>,
    /// Length of each message with the fields of every version, bytes.
    sizes: Vec<usize>,
    skipped: u64,
    /// The numbers of the first skipped messages.
    skipped_ids: BTreeSet<u32>,
    signed: u64,
}

/// Takes the index of a topic, the number of places that were lost before, the recorder's time in microseconds, and a message.
pub(super) type Each<'a> = dyn FnMut(usize, u32, u64, &[u8]) + 'a;

/// True if a telemetry log begins with these bytes.
pub(super) fn begins(bytes: &[u8]) -> bool {
    frame::begins(bytes)
}

/// Reads every message.
pub(super) fn walk(bytes: &[u8], each: &mut Each<'_>) -> (Tables, Found) {
    let (mut tables, mut found) = (Tables::new(), Found::default());
    let mut offset = 0;
    while offset < bytes.len() {
        match frame::read_record(bytes, offset) {
            Ok(record) => {
                tables.take(&record, found.lost(), each);
                offset = record.next;
            }
            Err(error) => match find(bytes, offset + 1) {
                Some(next) => {
                    found.lose(offset, next, &error);
                    offset = next;
                }
                None => {
                    found.stop(offset, error.to_string());
                    break;
                }
            },
        }
    }
    tables.finish(&mut found);
    (tables, found)
}

/// The first sound record at `from` or behind it.
fn find(bytes: &[u8], from: usize) -> Option<usize> {
    // The first byte of every time from 2000 to 2100 is 0: the other places cost one comparison.
    (from..bytes.len()).find(|offset| bytes[*offset] == 0 && frame::read_record(bytes, *offset).is_ok())
}

impl Tables {
    fn new() -> Self {
        let mut formats = Formats::default();
        for message in &MESSAGES {
            let text = format!("{}:{}{}", message.name, message.fields, message.added);
            formats.add(text.as_bytes()).expect("invariant: each listed message is a format");
        }
        let size = |message: &messages::Definition| {
            formats.size(message.name).expect("invariant: a listed message has fields of known types")
        };
        let sizes = MESSAGES.iter().map(size).collect();
        let (topics, senders, skipped_ids) = (Vec::new(), BTreeMap::new(), BTreeSet::new());
        Self { formats, topics, senders, sizes, skipped: 0, skipped_ids, signed: 0 }
    }

    fn take(&mut self, record: &Record<'_>, part: u32, each: &mut Each<'_>) {
        self.signed += u64::from(record.is_signed);
        let Some((kind, _)) = messages::find(record.id) else { return self.skip(record.id) };
        let Some(topic) = self.topic(kind, record.sender) else { return self.skip(record.id) };
        self.topics[topic].records += 1;
        // A sender leaves out zeros at the end, and fields that its version does not have.
        let mut message = [0; MAX_PAYLOAD];
        let size = self.sizes[kind].min(MAX_PAYLOAD);
        let sent = record.payload.len().min(size);
        message[..sent].copy_from_slice(&record.payload[..sent]);
        each(topic, part, record.us, &message[..size]);
    }

    /// The topic of a message from a sender: the first sender's has the message's name alone. None beyond the most topics.
    fn topic(&mut self, kind: usize, sender: (u8, u8)) -> Option<usize> {
        if let Some(known) = self.senders.get(&(kind, sender)) {
            return Some(*known);
        }
        if self.topics.len() == MAX_TOPICS {
            return None;
        }
        let message = MESSAGES[kind].name;
        let name = match self.topics.iter().any(|topic| topic.kind == message) {
            true => format!("{message}/{}.{}", sender.0, sender.1),
            false => message.to_owned(),
        };
        self.topics.push(Topic { name, kind: message.to_owned(), records: 0 });
        self.senders.insert((kind, sender), self.topics.len() - 1);
        Some(self.topics.len() - 1)
    }

    fn skip(&mut self, id: u32) {
        self.skipped += 1;
        if self.skipped_ids.len() < MAX_NAMED {
            self.skipped_ids.insert(id);
        }
    }

    /// Notes the messages that were not read, and signatures.
    fn finish(&self, found: &mut Found) {
        if self.skipped > 0 {
            let ids = self.skipped_ids.iter().map(u32::to_string).collect::<Vec<_>>().join(", ");
            let first = if self.skipped_ids.len() == MAX_NAMED { "the first numbers" } else { "numbers" };
            found.note(format!(
                "{} messages are of kinds that carry no input and are not checked ({first}: {ids})",
                self.skipped
            ));
        }
        if self.signed > 0 {
            found.note(format!("{} frames are signed; a log has no key to check them by", self.signed));
        }
    }
}
