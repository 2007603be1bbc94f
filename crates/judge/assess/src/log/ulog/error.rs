//! The error of a ULog record that is not taken.

use super::super::MAX_TOPICS;
use super::super::layout::LayoutError;
use super::sync::HEAD;

/// A record is not taken.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum RecordError {
    #[error("a record's header has {HEAD} bytes, {left} are left")]
    Header { left: usize },
    #[error("a record's type is a capital letter, got `{}`", char::from(*got).escape_default())]
    Type { got: u8 },
    #[error("a record `{}` of {size} bytes, {left} are left", char::from(*kind).escape_default())]
    Short { kind: u8, size: usize, left: usize },
    /// A sync record begins within it.
    #[error("a record `{}` of {size} bytes reaches into the sync record at byte {sync}", char::from(*kind).escape_default())]
    OverSync { kind: u8, size: usize, sync: usize },
    #[error("behind a record `{}` of {size} bytes stands none", char::from(*kind).escape_default())]
    NoneBehind { kind: u8, size: usize },
    #[error("flags have 40 bytes, got {got}")]
    Flags { got: usize },
    #[error("flags of an incompatibility that is not known")]
    Incompatible,
    #[error("a dropout has 2 bytes")]
    Dropout,
    #[error("a subscription has 4 bytes or more, got {got}")]
    Subscription { got: usize },
    #[error("a topic's name is no text")]
    TopicName,
    #[error("more than {MAX_TOPICS} topics")]
    ManyTopics,
    #[error("data has 2 bytes or more, got {got}")]
    Data { got: usize },
    #[error("data of the unknown subscription {id}")]
    UnknownSubscription { id: u16 },
    #[error("a message of `{topic}` has {expected} bytes, got {got}")]
    Message { topic: String, expected: usize, got: usize },
    #[error(transparent)]
    Layout(#[from] LayoutError),
}
