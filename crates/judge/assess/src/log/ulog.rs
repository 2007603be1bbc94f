//! PX4 ULog: the records of a file in order, and the places that could not be read.
//!
//! Written after the format's description (<https://docs.px4.io/main/en/dev_log/ulog_file_format.html>, version 1), because a
//! judged log needs the offset of each damage, which the crate `px4-ulog` 0.6.1 does not give. Behind a damage reading goes on at the next
//! record of `sync`; where there is none, it ends. The layout of messages is in `layout`. Parameters, texts and the logger's own statistics are
//! skipped.

mod error;
mod sync;

use std::collections::BTreeMap;

use super::found::Found;
use super::layout::Formats;
use super::{LogError, MAX_TOPICS, Topic};
use error::RecordError;
use sync::{Record, There};

/// First bytes of a file; the eighth is the version.
pub(super) const MAGIC: [u8; 7] = *b"ULog\x01\x12\x35";
/// Length of the header: magic, version, start time.
const HEADER: usize = 16;
/// Bit of the first incompatibility byte: data is appended behind the offsets that the flags name.
const APPENDED: u8 = 1;

/// A subscription: messages of one instance of a topic.
struct Subscription {
    topic: usize,
    /// Length of a message, bytes.
    size: usize,
}

/// The tables that records refer to.
#[derive(Default)]
pub(super) struct Tables {
    pub(super) formats: Formats,
    pub(super) topics: Vec<Topic>,
    subscriptions: BTreeMap<u16, Subscription>,
    /// Time that the logger lost, milliseconds.
    dropouts_ms: u64,
    /// Messages of subscriptions that were lost with a damaged place.
    strays: u64,
}

/// Takes the index of a topic, the number of places that were lost before, and a message.
pub(super) type Each<'a> = dyn FnMut(usize, u32, &[u8]) + 'a;

/// Reads every message.
///
/// # Errors
/// When the bytes are not a log of version 0 or 1, or its flags name an incompatibility that is not known.
pub(super) fn walk(bytes: &[u8], each: &mut Each<'_>) -> Result<(Tables, Found), LogError> {
    let refuse = |at: usize, why: String| LogError::Refused { at: at as u64, why };
    let header = bytes.get(..HEADER).ok_or_else(|| {
        refuse(bytes.len(), format!("a ULog header has {HEADER} bytes, the file ends after {}", bytes.len()))
    })?;
    if let Some(version) = header.get(7).filter(|version| **version > 1) {
        return Err(refuse(7, format!("ULog version {version}, expected 0 or 1")));
    }
    let (mut tables, mut found) = (Tables::default(), Found::default());
    let mut appended = Vec::new();
    let mut offset = HEADER;
    while offset < bytes.len() {
        let cut = appended.first().copied().filter(|start| *start > offset);
        let result = match sync::read_record(bytes, offset, cut) {
            Ok(There::Record(record)) if record.kind == b'B' => {
                appended = flags(record.body).map_err(|error| refuse(offset, error.to_string()))?;
                Ok(record.next)
            }
            Ok(There::Record(record)) => {
                sync::check(bytes, offset, &record, cut).and_then(|()| tables.take(&record, found.lost(), each))
            }
            // The logger crashed within a record and appended what it saved: reading goes on there.
            Ok(There::Cut(start)) => {
                appended.remove(0);
                Ok(start)
            }
            Err(error) => Err(error),
        };
        offset = match result {
            Ok(next) => next,
            Err(error) => match sync::find(bytes, offset + 1) {
                Some(next) => {
                    found.lose(offset, next, &error);
                    next
                }
                None => {
                    found.stop(offset, error.to_string());
                    break;
                }
            },
        };
    }
    found.dropouts_ms = tables.dropouts_ms;
    if tables.strays > 0 {
        found.note(format!("{} messages are of subscriptions that were lost with a damaged place", tables.strays));
    }
    Ok((tables, found))
}

/// Starts of the data appended to the log.
fn flags(body: &[u8]) -> Result<Vec<usize>, RecordError> {
    let [_, _, _, _, _, _, _, _, first, rest @ ..] = body else {
        return Err(RecordError::Flags { got: body.len() });
    };
    let (Some(incompatible), Some(offsets)) = (rest.get(..7), rest.get(7..31)) else {
        return Err(RecordError::Flags { got: body.len() });
    };
    if first & !APPENDED != 0 || incompatible.iter().any(|byte| *byte != 0) {
        return Err(RecordError::Incompatible);
    }
    let starts = offsets.as_chunks::<8>().0.iter().map(|word| u64::from_le_bytes(*word));
    let mut starts: Vec<usize> = starts.filter(|start| *start > 0).filter_map(|start| start.try_into().ok()).collect();
    starts.sort_unstable();
    Ok(starts)
}

impl Tables {
    /// Takes a record; gives the place of the next.
    fn take(&mut self, record: &Record<'_>, part: u32, each: &mut Each<'_>) -> Result<usize, RecordError> {
        let body = record.body;
        let result = match record.kind {
            b'F' => self.formats.add(body).map_err(RecordError::from),
            b'A' => self.subscribe(body),
            b'D' => self.data(body, part, each),
            b'O' => {
                let lost = body.first_chunk().ok_or(RecordError::Dropout)?;
                self.dropouts_ms += u64::from(u16::from_le_bytes(*lost));
                Ok(())
            }
            _ => Ok(()),
        };
        result.map(|()| record.next)
    }

    fn subscribe(&mut self, body: &[u8]) -> Result<(), RecordError> {
        let [instance, low, high, name @ ..] = body else {
            return Err(RecordError::Subscription { got: body.len() });
        };
        let kind = std::str::from_utf8(name).map_err(|_| RecordError::TopicName)?;
        let size = self.formats.size(kind)?;
        let name = if *instance == 0 { kind.to_owned() } else { format!("{kind}/{instance}") };
        let topic = match self.topics.iter().position(|topic| topic.name == name) {
            Some(topic) => topic,
            None if self.topics.len() == MAX_TOPICS => return Err(RecordError::ManyTopics),
            None => {
                self.topics.push(Topic { name, kind: kind.to_owned(), records: 0 });
                self.topics.len() - 1
            }
        };
        self.subscriptions.insert(u16::from_le_bytes([*low, *high]), Subscription { topic, size });
        Ok(())
    }

    fn data(&mut self, body: &[u8], part: u32, each: &mut Each<'_>) -> Result<(), RecordError> {
        let [low, high, message @ ..] = body else {
            return Err(RecordError::Data { got: body.len() });
        };
        let id = u16::from_le_bytes([*low, *high]);
        let Some(subscription) = self.subscriptions.get(&id) else {
            // Its subscription was lost with a damaged place.
            self.strays += u64::from(part > 0);
            return if part > 0 { Ok(()) } else { Err(RecordError::UnknownSubscription { id }) };
        };
        let topic = &mut self.topics[subscription.topic];
        if message.len() < subscription.size {
            let (topic, expected, got) = (topic.name.clone(), subscription.size, message.len());
            return Err(RecordError::Message { topic, expected, got });
        }
        topic.records += 1;
        each(subscription.topic, part, message);
        Ok(())
    }
}
