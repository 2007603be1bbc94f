//! Topics, channels and schemas of an MCAP file, and those that its summary repeats.

use std::cell::Cell;
use std::collections::BTreeMap;

use mcap::records::{Channel as ChannelRecord, Record};

use super::error::{RecordError, Unreadable};
use super::message::{Coded, Message};
use super::{Each, frame};
use crate::log::cdr::Schema;
use crate::log::found::Found;
use crate::log::{MAX_TOPICS, Topic};

/// Most schemas of one file.
pub(super) const MAX_SCHEMAS: usize = 1024;

/// Topics, channels and schemas of a file.
#[derive(Default)]
pub(in crate::log) struct Tables {
    pub(in crate::log) topics: Vec<Topic>,
    channels: BTreeMap<u16, Channel>,
    schemas: BTreeMap<u16, (String, Definition)>,
    /// Messages that are zstd frames by themselves.
    packed: u64,
    /// Messages of channels that the file does not describe.
    strays: u64,
}

struct Channel {
    topic: usize,
    schema: u16,
    encoding: Encoding,
}

enum Encoding {
    Json,
    Cdr,
    /// Reason that the encoding is not read.
    Other(Unreadable),
}

enum Definition {
    Ros(Schema),
    /// Reason that the definition cannot be used.
    Not(Unreadable),
}

/// Schemas and channels of the summary, which replace those that a damaged chunk had.
pub(super) struct Spare<'a> {
    schemas: BTreeMap<u16, &'a [u8]>,
    channels: BTreeMap<u16, &'a [u8]>,
    /// True if it lists chunks.
    pub(super) chunked: bool,
}

impl<'a> Spare<'a> {
    /// Index of a file with a whole footer, the CRC of which fits.
    pub(super) fn from_file(bytes: &'a [u8]) -> Option<Self> {
        const FOOTER: usize = frame::HEAD + 20;
        const CHUNK_INDEX: u8 = 0x08;
        let end = bytes.len().checked_sub(FOOTER + mcap::MAGIC.len())?;
        let footer = frame::read_frame(bytes, end).ok().filter(|frame| frame.kind == frame::FOOTER)?.body;
        let from = usize::try_from(u64::from_le_bytes(*footer.first_chunk()?)).ok()?;
        let crc = u32::from_le_bytes(*footer.get(16..)?.first_chunk()?);
        let summary = bytes.get(from..end).filter(|_| from > 0)?;
        let covered = bytes.get(from..end + FOOTER - 4)?;
        if crc != 0 && crc32fast::hash(covered) != crc {
            return None;
        }
        let mut spare = Self { schemas: BTreeMap::new(), channels: BTreeMap::new(), chunked: false };
        let mut offset = 0;
        while let Ok(frame) = frame::read_frame(summary, offset) {
            let id = frame.body.first_chunk().map(|id| u16::from_le_bytes(*id));
            match (frame.kind, id) {
                (frame::SCHEMA, Some(id)) => drop(spare.schemas.insert(id, frame.body)),
                (frame::CHANNEL, Some(id)) => drop(spare.channels.insert(id, frame.body)),
                (CHUNK_INDEX, _) => spare.chunked = true,
                _ => {}
            }
            offset = frame.next;
        }
        Some(spare)
    }
}

impl Tables {
    /// Takes a schema, a channel or a message, `part` of which is the number of places lost before.
    pub(super) fn take(
        &mut self,
        record: &Record<'_>,
        spare: Option<&Spare<'_>>,
        (part, budget): (u32, &Cell<u64>),
        each: &mut Each<'_>,
    ) -> Result<(), RecordError> {
        match record {
            Record::Schema { header, data } => self.define(header.id, &header.name, &header.encoding, data),
            Record::Channel(channel) => self.open(channel),
            Record::Message { header, data } => {
                if !self.channels.contains_key(&header.channel_id) {
                    self.adopt(header.channel_id, spare)?;
                }
                let Some(channel) = self.channels.get(&header.channel_id) else {
                    self.strays += 1;
                    return Ok(());
                };
                let coded = match (&channel.encoding, self.schemas.get(&channel.schema)) {
                    (Encoding::Json, _) => Coded::Json,
                    (Encoding::Other(error), _) => Coded::Not(error),
                    (Encoding::Cdr, Some((_, Definition::Ros(schema)))) => Coded::Cdr(schema),
                    (Encoding::Cdr, Some((_, Definition::Not(error)))) => Coded::Not(error),
                    (Encoding::Cdr, None) => Coded::Not(&Unreadable::NoDefinition),
                };
                let message = Message { log_us: header.log_time / 1000, data, coded, budget };
                self.topics[channel.topic].records += 1;
                self.packed += u64::from(message.is_packed());
                each(channel.topic, part, &message);
                Ok(())
            }
            Record::Header(_)
            | Record::Footer(_)
            | Record::Chunk { .. }
            | Record::MessageIndex(_)
            | Record::ChunkIndex(_)
            | Record::Attachment { .. }
            | Record::AttachmentIndex(_)
            | Record::Statistics(_)
            | Record::Metadata(_)
            | Record::MetadataIndex(_)
            | Record::SummaryOffset(_)
            | Record::DataEnd(_)
            | Record::Unknown { .. } => Ok(()),
        }
    }

    fn define(&mut self, id: u16, name: &str, encoding: &str, data: &[u8]) -> Result<(), RecordError> {
        if self.schemas.len() == MAX_SCHEMAS && !self.schemas.contains_key(&id) {
            return Err(RecordError::ManySchemas);
        }
        let definition = match encoding {
            "ros2msg" => Schema::parse(name, data).map_or_else(|error| Definition::Not(error.into()), Definition::Ros),
            other => Definition::Not(Unreadable::DefinitionEncoding { got: other.to_owned() }),
        };
        self.schemas.insert(id, (name.to_owned(), definition));
        Ok(())
    }

    fn open(&mut self, channel: &ChannelRecord) -> Result<(), RecordError> {
        let kind = self.schemas.get(&channel.schema_id).map_or("", |(name, _)| name);
        let topic = match self.topics.iter().position(|topic| topic.name == channel.topic) {
            Some(topic) => topic,
            None if self.topics.len() == MAX_TOPICS => return Err(RecordError::ManyTopics),
            None => {
                self.topics.push(Topic { name: channel.topic.clone(), kind: kind.to_owned(), records: 0 });
                self.topics.len() - 1
            }
        };
        let encoding = match channel.message_encoding.as_str() {
            "json" => Encoding::Json,
            "cdr" => Encoding::Cdr,
            other => Encoding::Other(Unreadable::Encoding { got: other.to_owned() }),
        };
        self.channels.insert(channel.id, Channel { topic, schema: channel.schema_id, encoding });
        Ok(())
    }

    /// Opens a channel that the summary has.
    fn adopt(&mut self, id: u16, spare: Option<&Spare<'_>>) -> Result<(), RecordError> {
        let Some((spare, body)) = spare.and_then(|spare| Some((spare, *spare.channels.get(&id)?))) else {
            return Ok(());
        };
        let Record::Channel(channel) = mcap::parse_record(frame::CHANNEL, body)? else { return Ok(()) };
        if let (false, Some(body)) =
            (self.schemas.contains_key(&channel.schema_id), spare.schemas.get(&channel.schema_id))
            && let Record::Schema { header, data } = mcap::parse_record(frame::SCHEMA, body)?
        {
            self.define(header.id, &header.name, &header.encoding, &data)?;
        }
        self.open(&channel)
    }

    /// Notes oddities of the messages.
    pub(super) fn finish(&self, found: &mut Found) {
        if self.packed > 0 {
            found.note(format!(
                "{} messages are zstd frames (rosbag2's compression mode `message`), and were expanded one by one",
                self.packed
            ));
        }
        if self.strays > 0 {
            found.note(format!("{} messages are of channels that the file does not describe", self.strays));
        }
    }
}
