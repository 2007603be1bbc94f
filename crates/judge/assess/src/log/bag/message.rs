//! A message of an MCAP file: its numbers, out of JSON or of ROS 2's CDR, packed by itself or not.

use std::borrow::Cow;
use std::cell::Cell;

use serde_json::Value;

use super::chunk::read;
use super::error::Unreadable;
use crate::log::cdr::{CdrError, Schema};
use crate::log::path::{Path, Step};

/// The longest message that is expanded, bytes. An image of 4 megapixels fits.
const MAX_MESSAGE: u64 = 16 << 20;
/// First bytes of a zstd frame. Neither JSON nor CDR begins so.
pub(in crate::log) const ZSTD: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];

/// A message.
pub(in crate::log) struct Message<'a> {
    /// Time at which the recorder took it, microseconds.
    pub(in crate::log) log_us: u64,
    pub(super) data: &'a [u8],
    pub(super) coded: Coded<'a>,
    /// Budget of bytes that are expanded of this file.
    pub(super) budget: &'a Cell<u64>,
}

/// The way in which the messages of a channel are written.
pub(super) enum Coded<'a> {
    Json,
    Cdr(&'a Schema),
    /// Reason that they cannot be read.
    Not(&'a Unreadable),
}

/// A message gives no numbers.
#[derive(Debug, thiserror::Error)]
pub(in crate::log) enum MessageError {
    #[error("a message is no JSON: {0}")]
    Json(serde_json::Error),
    #[error("a message is a broken zstd frame: {0}")]
    Packed(std::io::Error),
    #[error("messages are zstd frames, and one has more than {most} bytes once expanded")]
    Large { most: u64 },
    #[error("no field `{field}` in a message")]
    NoField { field: String },
    #[error("`{field}` is no number")]
    NoNumber { field: String },
    #[error(transparent)]
    Cdr(#[from] CdrError),
    #[error(transparent)]
    Unreadable(#[from] Unreadable),
}

impl Message<'_> {
    /// True if it is a zstd frame, as in rosbag2's compression of each message.
    pub(super) fn is_packed(&self) -> bool {
        self.data.starts_with(&ZSTD)
    }

    /// The numbers at `paths`.
    pub(in crate::log) fn numbers(&self, paths: &[Path]) -> Result<Vec<f64>, MessageError> {
        match self.coded {
            Coded::Json => {
                let value: Value = serde_json::from_slice(&self.unpacked()?).map_err(MessageError::Json)?;
                paths.iter().map(|path| number(&value, path.steps())).collect()
            }
            Coded::Cdr(schema) => Ok(schema.numbers(&self.unpacked()?, paths)?),
            Coded::Not(error) => Err(error.clone().into()),
        }
    }

    fn unpacked(&self) -> Result<Cow<'_, [u8]>, MessageError> {
        if !self.is_packed() {
            return Ok(Cow::Borrowed(self.data));
        }
        let most = self.budget.get().min(MAX_MESSAGE);
        let (bytes, ended) =
            read(zstd::stream::read::Decoder::with_buffer(self.data).map_err(MessageError::Packed)?, most + 1);
        // Charged for a broken frame too: a hostile file may have any number of frames that break at their end.
        self.budget.set(self.budget.get().saturating_sub(bytes.len() as u64));
        ended.map_err(MessageError::Packed)?;
        match bytes.len() as u64 > most {
            true => Err(MessageError::Large { most }),
            false => Ok(Cow::Owned(bytes)),
        }
    }
}

fn number(value: &Value, steps: &[Step]) -> Result<f64, MessageError> {
    let mut node = value;
    for step in steps {
        let found = node.get(&step.name).and_then(|part| step.index.map_or(Some(part), |index| part.get(index)));
        node = found.ok_or_else(|| MessageError::NoField { field: step.name.clone() })?;
    }
    match node {
        // Writers give `null` for a number that is not finite.
        Value::Null => Ok(f64::NAN),
        Value::Bool(set) => Ok(f64::from(u8::from(*set))),
        Value::Number(number) => Ok(number.as_f64().unwrap_or(f64::NAN)),
        Value::String(_) | Value::Array(_) | Value::Object(_) => {
            Err(MessageError::NoNumber { field: steps.last().map(|step| step.name.clone()).unwrap_or_default() })
        }
    }
}
