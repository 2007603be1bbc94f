//! MCAP: the messages of a file in order, as JSON or as ROS 2's CDR.
//!
//! Framing and decompression are the crate `mcap`'s, within a bound on one record and on all that a file's chunks expand to. Its
//! offset is that of the last whole record outside of chunks that was handed to it.

use std::collections::BTreeMap;

use mcap::records::Record;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use serde_json::Value;

use super::cdr::Schema;
use super::path::{Path, Step};
use super::{End, MAX_TOPICS, Topic};

/// The longest record that is loaded, bytes: the library takes a file's word for a length. An image of 4 megapixels fits.
const MAX_RECORD: usize = 16 << 20;
/// The most that the records of one file may be in all once its chunks are expanded, bytes.
const MAX_EXPANDED: usize = 1 << 30;
/// Most schemas of one file.
const MAX_SCHEMAS: usize = 1024;

/// Topics, channels and schemas of a file.
#[derive(Default)]
pub(super) struct Tables {
    pub(super) topics: Vec<Topic>,
    channels: BTreeMap<u16, Channel>,
    schemas: BTreeMap<u16, (String, Option<Schema>)>,
}

struct Channel {
    topic: usize,
    schema: u16,
    json: bool,
    cdr: bool,
}

/// A message.
pub(super) struct Message<'a> {
    /// Time at which the recorder took it, microseconds.
    pub(super) log_us: u64,
    body: Body<'a>,
}

enum Body<'a> {
    Json(&'a [u8]),
    Cdr(&'a [u8], &'a Schema),
    /// An encoding, or a schema, that is not read.
    Other,
}

/// Reads every message; `each` takes the index of a topic and the message.
pub(super) fn walk(bytes: &[u8], each: &mut dyn FnMut(usize, &Message<'_>)) -> (Tables, End) {
    let options = LinearReaderOptions::default().with_skip_end_magic(true).with_record_length_limit(MAX_RECORD);
    let mut reader = LinearReader::new_with_options(options);
    let (mut tables, mut at, mut whole, mut expanded, mut footer) =
        (Tables::default(), 0_usize, 0_usize, 0_usize, false);
    loop {
        let event = match reader.next_event() {
            None => break,
            Some(Err(why)) => return (tables, End::stopped(whole, bytes.len(), why.to_string())),
            Some(Ok(event)) => event,
        };
        match event {
            LinearReadEvent::ReadRequest(need) => {
                let next = &bytes[at..at.saturating_add(need).min(bytes.len())];
                reader.insert(next.len()).copy_from_slice(next);
                reader.notify_read(next.len());
                at += next.len();
            }
            LinearReadEvent::Record { data, opcode } => {
                expanded = expanded.saturating_add(data.len());
                if expanded > MAX_EXPANDED {
                    let why = format!("its records are more than {MAX_EXPANDED} bytes once expanded");
                    return (tables, End::stopped(whole, bytes.len(), why));
                }
                footer |= opcode == mcap::records::op::FOOTER;
                let taken = mcap::parse_record(opcode, data).map_err(|why| why.to_string());
                if let Err(why) = taken.and_then(|record| tables.take(&record, each)) {
                    return (tables, End::stopped(whole, bytes.len(), why));
                }
                whole = at;
            }
        }
    }
    match footer {
        true => (tables, End::whole(bytes.len())),
        false => {
            (tables, End::stopped(whole, bytes.len(), "the file ends without a footer, as a cut one does".to_owned()))
        }
    }
}

impl Tables {
    fn take(&mut self, record: &Record<'_>, each: &mut dyn FnMut(usize, &Message<'_>)) -> Result<(), String> {
        match record {
            Record::Schema { header, data } => {
                if self.schemas.len() == MAX_SCHEMAS && !self.schemas.contains_key(&header.id) {
                    return Err(format!("more than {MAX_SCHEMAS} schemas"));
                }
                let schema = (header.encoding == "ros2msg").then(|| Schema::parse(&header.name, data)).transpose()?;
                self.schemas.insert(header.id, (header.name.clone(), schema));
                Ok(())
            }
            Record::Channel(channel) => self.open(channel),
            Record::Message { header, data } => {
                let id = header.channel_id;
                let channel = self.channels.get(&id).ok_or_else(|| format!("a message of the unknown channel {id}"))?;
                self.topics[channel.topic].records += 1;
                let schema = self.schemas.get(&channel.schema).and_then(|(_, schema)| schema.as_ref());
                let body = match (channel.json, schema.filter(|_| channel.cdr)) {
                    (true, _) => Body::Json(data),
                    (false, Some(schema)) => Body::Cdr(data, schema),
                    (false, None) => Body::Other,
                };
                each(channel.topic, &Message { log_us: header.log_time / 1000, body });
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

    fn open(&mut self, channel: &mcap::records::Channel) -> Result<(), String> {
        let kind = self.schemas.get(&channel.schema_id).map_or("", |(name, _)| name);
        let topic = match self.topics.iter().position(|topic| topic.name == channel.topic) {
            Some(topic) => topic,
            None if self.topics.len() == MAX_TOPICS => return Err(format!("more than {MAX_TOPICS} topics")),
            None => {
                self.topics.push(Topic { name: channel.topic.clone(), kind: kind.to_owned(), records: 0 });
                self.topics.len() - 1
            }
        };
        let (json, cdr) = (channel.message_encoding == "json", channel.message_encoding == "cdr");
        self.channels.insert(channel.id, Channel { topic, schema: channel.schema_id, json, cdr });
        Ok(())
    }
}

impl Message<'_> {
    /// The numbers at `paths`.
    pub(super) fn numbers(&self, paths: &[Path]) -> Result<Vec<f64>, String> {
        match &self.body {
            Body::Json(text) => {
                let value: Value =
                    serde_json::from_slice(text).map_err(|why| format!("a message is no JSON: {why}"))?;
                paths.iter().map(|path| number(&value, path.steps())).collect()
            }
            Body::Cdr(bytes, schema) => schema.numbers(bytes, paths),
            Body::Other => Err("its encoding is neither JSON nor CDR with a schema in ros2msg".to_owned()),
        }
    }
}

fn number(value: &Value, steps: &[Step]) -> Result<f64, String> {
    let mut at = value;
    for step in steps {
        let within = at.get(&step.name).and_then(|part| step.index.map_or(Some(part), |index| part.get(index)));
        at = within.ok_or_else(|| format!("no field `{}` in a message", step.name))?;
    }
    match at {
        // Writers give `null` for a number that is not finite.
        Value::Null => Ok(f64::NAN),
        Value::Bool(set) => Ok(f64::from(u8::from(*set))),
        Value::Number(number) => Ok(number.as_f64().unwrap_or(f64::NAN)),
        Value::String(_) | Value::Array(_) | Value::Object(_) => {
            Err(format!("`{}` is no number", steps.last().map_or("", |step| &step.name)))
        }
    }
}
