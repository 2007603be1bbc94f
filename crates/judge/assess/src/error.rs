//! The error of a recording that lacks an input of its map.

use crate::log::{End, LogError};

/// Most control periods from first to last reading: 24 h at 20 Hz, and room.
pub(crate) const MAX_PERIODS: u64 = 2_000_000;

impl TrackError {
    /// The error of a recording that was not read whole.
    pub(crate) fn because_of(self, end: &End) -> Self {
        match &end.why {
            Some(why) => {
                let cause = format!("read to byte {} of {}: {why}", end.at, end.of);
                TrackError::Unread { cause, then: Box::new(self) }
            }
            None => self,
        }
    }
}

/// Error of the conversion of a recording to inputs.
#[derive(Debug, thiserror::Error)]
pub enum TrackError {
    /// A topic or field is missing.
    #[error(transparent)]
    Log(#[from] LogError),
    /// No message gives the input.
    #[error("topic `{topic}` gives no {input}: {got} messages, none with a time and finite numbers{valid}")]
    Empty {
        /// Name of the topic.
        topic: String,
        /// Name of the input.
        input: &'static str,
        /// Number of messages.
        got: u64,
        /// The condition that the map states, in words.
        valid: &'static str,
    },
    /// Fix and odometry have no time in common.
    #[error(
        "fixes from {} to {} s and odometry from {} to {} s have no time in common: are both stamps of one clock?",
        fix.0 / 1_000_000, fix.1 / 1_000_000, odometry.0 / 1_000_000, odometry.1 / 1_000_000
    )]
    Apart {
        /// First and last fix, microseconds.
        fix: (u64, u64),
        /// First and last odometry, microseconds.
        odometry: (u64, u64),
    },
    /// An input is missing, and so is a part of the recording.
    #[error("{cause}; so {then}")]
    Unread {
        /// The part that could not be read.
        cause: String,
        /// The error that may follow from it.
        then: Box<TrackError>,
    },
    /// Length beyond what is judged.
    #[error(
        "stamps from {from_s} to {to_s} s, at most {MAX_PERIODS} control periods are judged: is a stamp's unit right?"
    )]
    Long {
        /// First, seconds.
        from_s: u64,
        /// Last, seconds.
        to_s: u64,
    },
}
