//! PX4 ULog: the records of a file, in order, up to its end or to the first that is damaged.
//!
//! Written after the format's description (<https://docs.px4.io/main/en/dev_log/ulog_file_format.html>, version 1), because a
//! judged log needs the offset at which reading stopped, which the crate `px4-ulog` 0.6.1 does not give. The layout of messages is in `layout`.
//! Parameters, texts and the logger's own statistics are skipped.

use std::collections::BTreeMap;

use super::layout::Formats;
use super::{End, LogError, MAX_TOPICS, Topic};

/// First bytes of a file; the eighth is the version.
pub(super) const MAGIC: [u8; 7] = *b"ULog\x01\x12\x35";
/// Length of the header: magic, version, start time.
const HEADER: usize = 16;
/// Length of a record's own header: its size, its type.
const RECORD: usize = 3;
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
    pub(super) dropouts_ms: u64,
}

/// Reads every record; `each` takes the index of a topic and the message.
///
/// # Errors
/// When the bytes are not a log of version 0 or 1, or its flags name an incompatibility that is not known.
pub(super) fn walk(bytes: &[u8], each: &mut dyn FnMut(usize, &[u8])) -> Result<(Tables, End), LogError> {
    let refuse = |at: usize, why: String| LogError::Refused { at: at as u64, why };
    let header = bytes.get(..HEADER).ok_or_else(|| {
        refuse(bytes.len(), format!("a ULog header has {HEADER} bytes, the file ends after {}", bytes.len()))
    })?;
    if let Some(version) = header.get(7).filter(|version| **version > 1) {
        return Err(refuse(7, format!("ULog version {version}, expected 0 or 1")));
    }
    let mut tables = Tables::default();
    let mut appended = Vec::new();
    let mut at = HEADER;
    while at < bytes.len() {
        let cut = appended.first().copied().filter(|start| *start > at);
        let (kind, body, next) = match record(bytes, at, cut) {
            Ok(Found::Record(kind, body, next)) => (kind, body, next),
            // The logger crashed within a record and appended what it saved: reading goes on there.
            Ok(Found::Cut(start)) => {
                appended.remove(0);
                at = start;
                continue;
            }
            Err(why) => return Ok((tables, End::stopped(at, bytes.len(), why))),
        };
        if kind == b'B' {
            appended = flags(body).map_err(|why| refuse(at, why))?;
        } else if let Err(why) = tables.take(kind, body, each) {
            return Ok((tables, End::stopped(at, bytes.len(), why)));
        }
        at = next;
    }
    Ok((tables, End::whole(bytes.len())))
}

enum Found<'a> {
    /// Type, body, and the place of the next.
    Record(u8, &'a [u8], usize),
    /// The record is cut by data that is appended here.
    Cut(usize),
}

fn record(bytes: &[u8], at: usize, cut: Option<usize>) -> Result<Found<'_>, String> {
    let left = bytes.len() - at;
    if let (Some(start), true) = (cut, left < RECORD) {
        return Ok(Found::Cut(start));
    }
    let [low, high, kind, ..] = bytes[at..] else {
        return Err(format!("a record's header has {RECORD} bytes, {left} are left"));
    };
    let size = usize::from(u16::from_le_bytes([low, high]));
    let end = at + RECORD + size;
    if let Some(start) = cut.filter(|start| end > *start && *start < bytes.len()) {
        return Ok(Found::Cut(start));
    }
    let shown = char::from(kind).escape_default();
    // Records of types from after this program are skipped, as the format wants; anything but a capital letter is damage.
    if !kind.is_ascii_uppercase() {
        return Err(format!("a record's type is a capital letter, got `{shown}`"));
    }
    let body = bytes.get(at + RECORD..end);
    let body =
        body.ok_or_else(|| format!("a record `{shown}` of {size} bytes, {} are left", left.saturating_sub(RECORD)))?;
    Ok(Found::Record(kind, body, end))
}

/// Starts of the data appended to the log.
fn flags(body: &[u8]) -> Result<Vec<usize>, String> {
    let [_, _, _, _, _, _, _, _, first, rest @ ..] = body else {
        return Err(format!("flags have 40 bytes, got {}", body.len()));
    };
    let (Some(incompatible), Some(offsets)) = (rest.get(..7), rest.get(7..31)) else {
        return Err(format!("flags have 40 bytes, got {}", body.len()));
    };
    if first & !APPENDED != 0 || incompatible.iter().any(|byte| *byte != 0) {
        return Err("flags of an incompatibility that is not known".to_owned());
    }
    let starts = offsets.as_chunks::<8>().0.iter().map(|word| u64::from_le_bytes(*word));
    let mut starts: Vec<usize> = starts.filter(|start| *start > 0).filter_map(|start| start.try_into().ok()).collect();
    starts.sort_unstable();
    Ok(starts)
}

impl Tables {
    fn take(&mut self, kind: u8, body: &[u8], each: &mut dyn FnMut(usize, &[u8])) -> Result<(), String> {
        match kind {
            b'F' => self.formats.add(body),
            b'A' => self.subscribe(body),
            b'D' => self.data(body, each),
            b'O' => {
                let lost = body.first_chunk().ok_or("a dropout has 2 bytes")?;
                self.dropouts_ms += u64::from(u16::from_le_bytes(*lost));
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn subscribe(&mut self, body: &[u8]) -> Result<(), String> {
        let [instance, low, high, name @ ..] = body else {
            return Err(format!("a subscription has 4 bytes or more, got {}", body.len()));
        };
        let kind = std::str::from_utf8(name).map_err(|_| "a topic's name is no text".to_owned())?;
        let size = self.formats.size(kind)?;
        let name = if *instance == 0 { kind.to_owned() } else { format!("{kind}/{instance}") };
        let topic = match self.topics.iter().position(|topic| topic.name == name) {
            Some(topic) => topic,
            None if self.topics.len() == MAX_TOPICS => {
                return Err(format!("more than {MAX_TOPICS} topics"));
            }
            None => {
                self.topics.push(Topic { name, kind: kind.to_owned(), records: 0 });
                self.topics.len() - 1
            }
        };
        self.subscriptions.insert(u16::from_le_bytes([*low, *high]), Subscription { topic, size });
        Ok(())
    }

    fn data(&mut self, body: &[u8], each: &mut dyn FnMut(usize, &[u8])) -> Result<(), String> {
        let [low, high, message @ ..] = body else {
            return Err(format!("data has 2 bytes or more, got {}", body.len()));
        };
        let id = u16::from_le_bytes([*low, *high]);
        let of = self.subscriptions.get(&id).ok_or_else(|| format!("data of the unknown subscription {id}"))?;
        let topic = &mut self.topics[of.topic];
        if message.len() < of.size {
            return Err(format!("a message of `{}` has {} bytes, got {}", topic.name, of.size, message.len()));
        }
        topic.records += 1;
        each(of.topic, message);
        Ok(())
    }
}
