//! One topic's numbers by the entries of a map, converted to metres, radians, seconds and microseconds.

use crate::log::{Log, LogError, MessageRow, Path, PathError, Rows};
use crate::map::{Field, Stamp, StampUnit};

/// A question to one topic; its columns are added one by one.
pub(crate) struct Columns<'a> {
    log: &'a Log<'a>,
    topic: &'a str,
    paths: Vec<Path>,
}

/// A column with its factor to SI.
#[derive(Clone, Copy)]
pub(crate) struct Column {
    at: usize,
    factor: f64,
}

/// The columns of a stamp.
#[derive(Clone, Copy)]
pub(crate) enum Clock {
    /// The recorder's time.
    Log,
    /// A number of this unit in microseconds.
    One(Column),
    /// Seconds and nanoseconds.
    Two(Column, Column),
}

impl<'a> Columns<'a> {
    pub(crate) fn new(log: &'a Log<'a>, topic: &'a str) -> Self {
        Self { log, topic, paths: Vec::new() }
    }

    fn path(&mut self, path: Path) -> usize {
        self.paths.push(path);
        self.paths.len() - 1
    }

    fn parsed(&self, text: &str) -> Result<Path, LogError> {
        text.parse()
            .map_err(|error: PathError| LogError::NoField { topic: self.topic.to_owned(), why: error.to_string() })
    }

    /// A number without a unit.
    pub(crate) fn plain(&mut self, path: &str) -> Result<Column, LogError> {
        let path = self.parsed(path)?;
        Ok(Column { at: self.path(path), factor: 1.0 })
    }

    pub(crate) fn field(&mut self, field: &Field) -> Result<Column, LogError> {
        let column = self.plain(&field.field)?;
        Ok(Column { factor: field.scale * field.unit.si(), ..column })
    }

    pub(crate) fn optional(&mut self, field: Option<&toml::Spanned<Field>>) -> Result<Option<Column>, LogError> {
        field.map(|field| self.field(field.as_ref())).transpose()
    }

    pub(crate) fn stamp(&mut self, stamp: &Stamp) -> Result<Clock, LogError> {
        let Some(field) = stamp.field.as_deref() else { return Ok(Clock::Log) };
        let path = self.parsed(field)?;
        let column = |at| Column { at, factor: stamp.unit.us() };
        Ok(match stamp.unit {
            StampUnit::Ros => {
                let (seconds, rest) = (self.path(path.join("sec")), self.path(path.join("nanosec")));
                Clock::Two(column(seconds), Column { at: rest, factor: 1e-3 })
            }
            StampUnit::S | StampUnit::Ms | StampUnit::Us | StampUnit::Ns | StampUnit::Log => {
                Clock::One(column(self.path(path)))
            }
        })
    }

    pub(crate) fn rows(self) -> Result<Rows, LogError> {
        self.log.rows(self.topic, &self.paths)
    }
}

impl Column {
    /// Its number in a row; none if the number is not finite.
    pub(crate) fn read(self, row: &MessageRow) -> Option<f64> {
        row.values.get(self.at).map(|value| value * self.factor).filter(|value| value.is_finite())
    }
}

impl Clock {
    /// Microseconds; none if the stamp is no time.
    pub(crate) fn read(self, row: &MessageRow) -> Option<u64> {
        /// A time that leaves room for sums, as microseconds: the year 100,000.
        const LATEST: f64 = 3.2e18;
        let us = match self {
            Clock::Log => return row.log_us.filter(|us| (*us as f64) < LATEST),
            Clock::One(column) => column.read(row)?,
            Clock::Two(seconds, rest) => seconds.read(row)? + rest.read(row)?,
        };
        (0.0..LATEST).contains(&us).then(|| libm::round(us) as u64)
    }
}

/// Keeps what has a stamp later than all before it. Also gives the number of those left out.
pub(crate) fn in_order<T>(rows: impl IntoIterator<Item = (u64, T)>) -> (Vec<(u64, T)>, u64) {
    let (mut ordered, mut back): (Vec<(u64, T)>, u64) = (Vec::new(), 0);
    for row in rows {
        match ordered.last().is_none_or(|(last, _)| row.0 > *last) {
            true => ordered.push(row),
            false => back += 1,
        }
    }
    (ordered, back)
}
