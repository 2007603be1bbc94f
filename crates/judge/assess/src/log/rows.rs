//! The messages of one topic as rows of numbers.

use super::layout::{Formats, Place};
use super::{File, Format, Log, LogError, Path, Topic, bag, tlog, ulog};

/// Most rows that are taken from one topic: 24 h at 20 Hz, and room.
const MAX_ROWS: usize = 2_000_000;

/// Numbers of one message.
#[derive(Clone, Debug, PartialEq)]
pub struct MessageRow {
    /// The recorder's time, microseconds; absent in ULog, which has none beside the messages' own.
    pub log_us: Option<u64>,
    /// Number of the message among all of the recording.
    pub place: u64,
    /// Number of stretches before it that could not be read.
    pub part: u32,
    /// One for each path that was asked for; NaN where the message lacks the number.
    pub values: Vec<f64>,
}

/// The messages of a topic.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rows {
    /// Rows that could be read, no more than [`MAX_ROWS`].
    pub rows: Vec<MessageRow>,
    /// Number of those that could not.
    pub unread: u64,
    /// Reason that the first of these could not.
    pub why: Option<String>,
}

impl Log<'_> {
    /// The numbers at `paths` in each message of a topic, in the recording's order.
    ///
    /// # Errors
    /// When there is no such topic, or a path leads to no number in any of its messages.
    pub fn rows(&self, topic: &str, paths: &[Path]) -> Result<Rows, LogError> {
        let index = self.topic(topic)?;
        let mut rows = Rows::default();
        for file in &self.files {
            if let Some(own_count) = file.topics.iter().position(|topic| *topic == index) {
                match self.format {
                    Format::Ulog => self.ulog_rows((file, own_count), paths, &mut rows)?,
                    Format::Mcap => mcap_rows((file, own_count), paths, &mut rows),
                    Format::Tlog => self.tlog_rows((file, own_count), paths, &mut rows)?,
                }
            }
        }
        match rows.why.as_ref().filter(|_| rows.rows.is_empty()) {
            Some(why) => Err(LogError::NoField { topic: topic.to_owned(), why: why.clone() }),
            None => Ok(rows),
        }
    }

    /// True if each path leads to a number in the topic's messages; for MCAP, in one of them.
    pub fn has_columns(&self, topic: &str, paths: &[&str]) -> bool {
        self.numbers(topic, paths).is_some_and(|rows| !rows.is_empty())
    }

    /// The numbers at these paths, message by message; none if a path leads to none.
    pub(crate) fn numbers(&self, topic: &str, paths: &[&str]) -> Option<Vec<Vec<f64>>> {
        let paths: Result<Vec<Path>, _> = paths.iter().map(|path| path.parse()).collect();
        let rows = self.rows(topic, &paths.ok()?).ok()?;
        Some(rows.rows.into_iter().map(|row| row.values).collect())
    }

    fn ulog_rows(&self, (file, index): (&File<'_>, usize), paths: &[Path], rows: &mut Rows) -> Result<(), LogError> {
        let topic = &self.topics[file.topics[index]];
        let (tables, _) = ulog::walk(&file.bytes, &mut |_, _, _| ())?;
        let places = places(&tables.formats, topic, paths)?;
        let mut place = file.before;
        ulog::walk(&file.bytes, &mut |kind, part, message| {
            place += 1;
            if kind == index && rows.rows.len() < MAX_ROWS {
                let values = places.iter().map(|place| place.read(message).unwrap_or(f64::NAN)).collect();
                rows.rows.push(MessageRow { log_us: None, place, part: file.part + part, values });
            }
        })?;
        Ok(())
    }

    fn tlog_rows(&self, (file, index): (&File<'_>, usize), paths: &[Path], rows: &mut Rows) -> Result<(), LogError> {
        let (tables, _) = tlog::walk(&file.bytes, &mut |_, _, _, _| ());
        let places = places(&tables.formats, &self.topics[file.topics[index]], paths)?;
        let mut place = file.before;
        tlog::walk(&file.bytes, &mut |kind, part, us, message| {
            place += 1;
            if kind == index && rows.rows.len() < MAX_ROWS {
                let values = places.iter().map(|place| place.read(message).unwrap_or(f64::NAN)).collect();
                rows.rows.push(MessageRow { log_us: Some(us), place, part: file.part + part, values });
            }
        });
        Ok(())
    }
}

/// The places of numbers in the messages of a topic.
fn places(formats: &Formats, topic: &Topic, paths: &[Path]) -> Result<Vec<Place>, LogError> {
    let places = paths.iter().map(|path| formats.place(&topic.kind, path)).collect::<Result<Vec<_>, _>>();
    places.map_err(|error| LogError::NoField { topic: topic.name.clone(), why: error.to_string() })
}

fn mcap_rows((file, index): (&File<'_>, usize), paths: &[Path], rows: &mut Rows) {
    let mut place = file.before;
    bag::walk(&file.bytes, &mut |kind, part, message| {
        place += 1;
        if kind != index || rows.rows.len() == MAX_ROWS {
            return;
        }
        match message.numbers(paths) {
            Ok(values) => {
                rows.rows.push(MessageRow { log_us: Some(message.log_us), place, part: file.part + part, values });
            }
            Err(error) => {
                rows.unread += 1;
                rows.why = rows.why.take().or_else(|| Some(error.to_string()));
            }
        }
    });
}
