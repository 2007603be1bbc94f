//! A recording by its topics: rows of numbers out of PX4 ULog, or out of MCAP with JSON or ROS 2's CDR.
//!
//! The bytes are somebody else's. A damaged or cut file is read up to the damage, and [`End`] has its offset; the number of topics, the
//! size of a file, of its expanded chunks and of one record are bounded. The meaning of a topic is left to `map`.

mod bag;
mod cdr;
mod layout;
mod path;
mod ulog;

pub use path::Path;

use layout::Place;

/// The largest file that is read, bytes.
pub const MAX_LOG: u64 = 256 << 20;
/// Most topics of one log, instances counted.
const MAX_TOPICS: usize = 1024;
/// Most rows that are taken from one topic: 24 h at 20 Hz, and room.
pub const MAX_ROWS: usize = 2_000_000;

/// Format of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Format {
    /// PX4 ULog.
    Ulog,
    /// MCAP, as rosbag2 and Foxglove write it.
    Mcap,
}

/// A topic of a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topic {
    /// Name; further instances of a ULog topic have a number behind it, as in `sensor_gps/1`.
    pub name: String,
    /// Type of its messages, as the recording names it.
    pub kind: String,
    /// Number of messages.
    pub records: u64,
}

/// Place up to which a recording was read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct End {
    /// Offset of the first byte that was not read.
    pub at: u64,
    /// Length of the file, bytes.
    pub of: u64,
    /// Reason for stopping before the file's end.
    pub why: Option<String>,
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

/// Numbers of one message.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The recorder's time, microseconds; absent in ULog, which has none beside the messages' own.
    pub log_us: Option<u64>,
    /// One for each path that was asked for; NaN where the message lacks the number.
    pub values: Vec<f64>,
}

/// A recording whose topics are known.
#[derive(Clone, Debug)]
pub struct Log<'a> {
    bytes: &'a [u8],
    /// Its format.
    pub format: Format,
    /// Its topics, in the order in which they first appear.
    pub topics: Vec<Topic>,
    /// Place up to which it was read.
    pub end: End,
    /// Time that a ULog's logger lost by its own account, milliseconds.
    pub dropouts_ms: u64,
}

impl End {
    fn stopped(at: usize, of: usize, why: String) -> Self {
        Self { at: at as u64, of: of as u64, why: Some(why) }
    }

    fn whole(of: usize) -> Self {
        Self { at: of as u64, of: of as u64, why: None }
    }
}

impl<'a> Log<'a> {
    /// Reads the tables of a recording, and counts its messages.
    ///
    /// # Errors
    /// When the first bytes are of no known format, or of a version that is not known.
    pub fn open(bytes: &'a [u8]) -> Result<Self, LogError> {
        if bytes.len() as u64 > MAX_LOG {
            return Err(LogError::Refused { at: MAX_LOG, why: format!("at most {MAX_LOG} bytes are read") });
        }
        if bytes.starts_with(&ulog::MAGIC) {
            let (tables, end) = ulog::walk(bytes, &mut |_, _| ())?;
            let (topics, dropouts_ms) = (tables.topics, tables.dropouts_ms);
            return Ok(Self { bytes, format: Format::Ulog, topics, end, dropouts_ms });
        }
        if bytes.starts_with(mcap::MAGIC) {
            let (tables, end) = bag::walk(bytes, &mut |_, _| ());
            return Ok(Self { bytes, format: Format::Mcap, topics: tables.topics, end, dropouts_ms: 0 });
        }
        let why = "neither a ULog (`ULog`, 01 12 35) nor an MCAP file (89 `MCAP0`) by its first bytes".to_owned();
        Err(LogError::Refused { at: 0, why })
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

    /// The numbers at `paths` in each message of a topic, in the file's order; no more than [`MAX_ROWS`].
    ///
    /// # Errors
    /// When there is no such topic, or a path leads to no number in its messages.
    pub fn rows(&self, topic: &str, paths: &[Path]) -> Result<Vec<Row>, LogError> {
        let index = self.topic(topic)?;
        match self.format {
            Format::Ulog => self.ulog_rows(index, paths),
            Format::Mcap => self.mcap_rows(index, paths),
        }
    }

    /// True if each path leads to a number in the topic's messages; for MCAP, in the first of them.
    pub fn has(&self, topic: &str, paths: &[&str]) -> bool {
        let paths: Result<Vec<Path>, _> = paths.iter().map(|path| path.parse()).collect();
        let Ok(paths) = paths else { return false };
        self.rows(topic, &paths).is_ok_and(|rows| !rows.is_empty())
    }

    fn ulog_rows(&self, index: usize, paths: &[Path]) -> Result<Vec<Row>, LogError> {
        let topic = &self.topics[index];
        let (tables, _) = ulog::walk(self.bytes, &mut |_, _| ())?;
        let field = |why| LogError::NoField { topic: topic.name.clone(), why };
        let places = paths.iter().map(|path| tables.formats.place(&topic.kind, path));
        let places: Vec<Place> = places.collect::<Result<_, _>>().map_err(field)?;
        let mut rows = Vec::new();
        ulog::walk(self.bytes, &mut |of, message| {
            if of == index && rows.len() < MAX_ROWS {
                let values = places.iter().map(|place| place.read(message).unwrap_or(f64::NAN)).collect();
                rows.push(Row { log_us: None, values });
            }
        })?;
        Ok(rows)
    }

    fn mcap_rows(&self, index: usize, paths: &[Path]) -> Result<Vec<Row>, LogError> {
        let topic = &self.topics[index];
        let mut rows = Vec::new();
        let mut missing = None;
        bag::walk(self.bytes, &mut |of, message| {
            if of != index || rows.len() == MAX_ROWS {
                return;
            }
            match message.numbers(paths) {
                Ok(values) => rows.push(Row { log_us: Some(message.log_us), values }),
                Err(why) => missing = missing.take().or(Some(why)),
            }
        });
        match missing.filter(|_| rows.is_empty()) {
            Some(why) => Err(LogError::NoField { topic: topic.name.clone(), why }),
            None => Ok(rows),
        }
    }
}
