//! A recording by its topics: rows of numbers out of PX4 ULog, out of MCAP with JSON or ROS 2's CDR, or out of a MAVLink telemetry log.
//!
//! The bytes come from others. Damaged parts are left out, and [`End`] has the place of each damage; the number of topics, the size of a file, of
//! its expanded chunks and of one message are bounded. A recording may be split into several files, which are read one after another.
//! The meaning of a topic is left to `map`.

mod bag;
mod cdr;
mod found;
mod layout;
mod path;
mod rows;
mod source;
mod tlog;
mod ulog;

use std::borrow::Cow;

pub use found::Gap;
pub use path::{Path, PathError};
pub use rows::{MessageRow, Rows};

use found::Found;

/// The most that the files of a recording may have, bytes; packed as a whole, once it is expanded.
pub const MAX_LOG: u64 = 256 << 20;
/// Most topics of one log, instances counted.
const MAX_TOPICS: usize = 1024;

/// Format of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Format {
    /// PX4 ULog.
    Ulog,
    /// MCAP, as rosbag2 and Foxglove write it.
    Mcap,
    /// Telemetry log of MAVLink, as a ground station writes it.
    Tlog,
}

/// A topic of a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topic {
    /// Name; further instances of a ULog topic have a number behind it, as in `sensor_gps/1`, and further senders of a MAVLink message their system and
    /// component, as in `ATTITUDE/2.1`.
    pub name: String,
    /// Type of its messages, as the recording names it.
    pub kind: String,
    /// Number of messages.
    pub records: u64,
}

/// Place up to which a recording was read. Of several files, offsets are those in all of them, one behind another; of one that is packed as a
/// whole, those in its inside.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct End {
    /// Offset from which on no byte was read.
    pub at: u64,
    /// Length of the whole recording, bytes.
    pub of: u64,
    /// Reason for stopping before the end, and the stretches before it that could not be read, the first few in words.
    pub why: Option<String>,
    /// The first stretches before it that could not be read.
    pub gaps: Vec<Gap>,
}

/// A recording cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LogError {
    /// Not a recording of a known format and version.
    #[error("at byte {at}: {why}")]
    Refused {
        /// Offset.
        at: u64,
        /// Expected and got.
        why: String,
    },
    /// The topic is not in it.
    #[error("no topic `{topic}`{near}; --guess lists the topics")]
    NoTopic {
        /// Name.
        topic: String,
        /// A similar one, in words.
        near: String,
    },
    /// A field is not in the topic's messages.
    #[error("topic `{topic}`: {why}")]
    NoField {
        /// Name.
        topic: String,
        /// Expected and got.
        why: String,
    },
}

/// One file of a recording.
#[derive(Clone, Debug)]
struct File<'a> {
    bytes: Cow<'a, [u8]>,
    /// Index among all topics of the recording, by the file's own index.
    topics: Vec<usize>,
    /// Stretches that were lost before it.
    part: u32,
    /// Messages before it.
    before: u64,
}

/// A recording whose topics are known.
#[derive(Clone, Debug)]
pub struct Log<'a> {
    files: Vec<File<'a>>,
    /// Its format.
    pub format: Format,
    /// Its topics, in the order in which they first appear.
    pub topics: Vec<Topic>,
    /// Place up to which it was read.
    pub end: End,
    /// Oddities, sentences without a full stop.
    pub notes: Vec<String>,
    /// Time that a ULog's logger lost by its own account, milliseconds.
    pub dropouts_ms: u64,
}

impl<'a> Log<'a> {
    /// Reads the tables of a recording in one file, and counts its messages.
    ///
    /// # Errors
    /// When the first bytes are of no known format, or of a version that is not known.
    pub fn open(bytes: &'a [u8]) -> Result<Self, LogError> {
        Self::open_all(&[("", bytes)])
    }

    /// Opens a recording in several files, named and in their order.
    ///
    /// # Errors
    /// As of one file, and when they are of different formats or more than [`MAX_LOG`] together.
    pub fn open_all(files: &[(&str, &'a [u8])]) -> Result<Self, LogError> {
        let refused = |at: u64, why: String| LogError::Refused { at, why };
        let mut log: Option<Log<'a>> = None;
        let (mut found, mut length) = (Found::default(), 0_u64);
        for (i, (name, bytes)) in files.iter().enumerate() {
            // One alone needs no name.
            let name = if files.len() > 1 { *name } else { "" };
            let ((bytes, cut), format) = source::open(bytes).map_err(|error| error.in_file(name, length))?;
            let known = log.get_or_insert_with(|| Log::none(format));
            if known.format != format {
                return Err(refused(length, format!("{name}: another format than the first file's")));
            }
            let (part, before) = (found.lost(), known.topics.iter().map(|topic| topic.records).sum());
            let (topics, mut read) = match format {
                Format::Ulog => {
                    let (tables, read) =
                        ulog::walk(&bytes, &mut |_, _, _| ()).map_err(|error| error.in_file(name, length))?;
                    (tables.topics, read)
                }
                Format::Mcap => {
                    let (tables, read) = bag::walk(&bytes, &mut |_, _, _| ());
                    (tables.topics, read)
                }
                Format::Tlog => {
                    let (tables, read) = tlog::walk(&bytes, &mut |_, _, _, _| ());
                    (tables.topics, read)
                }
            };
            if let Some(cut) = cut {
                read.stop(bytes.len(), cut);
            }
            let read = if i + 1 < files.len() { read.followed(bytes.len()) } else { read };
            found.add(read, length, (files.len() > 1).then_some(name));
            length += bytes.len() as u64;
            if length > MAX_LOG {
                return Err(refused(MAX_LOG, format!("at most {MAX_LOG} bytes are read")));
            }
            let topics = topics.into_iter().map(|topic| known.merge(topic)).collect();
            known.files.push(File { bytes, topics, part, before });
        }
        let mut log = log.ok_or_else(|| refused(0, "no file".to_owned()))?;
        log.end = found.end(length);
        (log.notes, log.dropouts_ms) = (found.notes, found.dropouts_ms);
        Ok(log)
    }

    fn none(format: Format) -> Self {
        let end = End { at: 0, of: 0, why: None, gaps: Vec::new() };
        Self { files: Vec::new(), format, topics: Vec::new(), end, notes: Vec::new(), dropouts_ms: 0 }
    }

    /// Adds a file's topic to all topics; gives its index.
    fn merge(&mut self, topic: Topic) -> usize {
        match self.topics.iter().position(|known| known.name == topic.name) {
            Some(known) => {
                self.topics[known].records += topic.records;
                known
            }
            None => {
                self.topics.push(topic);
                self.topics.len() - 1
            }
        }
    }

    /// The index of a topic.
    ///
    /// # Errors
    /// When the recording has none of this name.
    pub fn topic(&self, name: &str) -> Result<usize, LogError> {
        let found = self.topics.iter().position(|topic| topic.name == name);
        found.ok_or_else(|| {
            let near = scenario::closest(name, self.topics.iter().map(|topic| topic.name.as_str()));
            let near = near.map_or_else(String::new, |near| format!("; did you mean `{}`?", near.escape_debug()));
            LogError::NoTopic { topic: name.to_owned(), near }
        })
    }
}

impl LogError {
    /// An error in a file with this name that begins at an offset of all.
    fn in_file(self, name: &str, offset: u64) -> Self {
        match &self {
            LogError::Refused { at, why } if !name.is_empty() => {
                LogError::Refused { at: at + offset, why: format!("{name}: {why}") }
            }
            LogError::Refused { .. } | LogError::NoTopic { .. } | LogError::NoField { .. } => self,
        }
    }
}
