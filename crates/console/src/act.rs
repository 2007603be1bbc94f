//! What a person does at the console, and what is drawn of it: the order that waits for its confirmation, and the answers.
//! Judging an act is `hand`'s.

use wire::id::CommandId;
pub use wire::person::{Act, Alarm, Numbered, Order, Role, Unable};
use wire::time::{Instant, Span};

/// How long a prepared order waits for its confirmation: long enough to type a reason, too short to be forgotten.
pub const PREPARED_FOR: Span = Span::s(10);
/// Answers that are kept.
pub const MAX_ANSWERS: usize = 16;

/// An order that waits to be confirmed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Prepared {
    /// The number of the act that prepared it.
    pub serial: u64,
    /// What.
    pub order: Order,
    /// Since when.
    pub since: Instant,
    /// When it lapses.
    pub until: Instant,
}

/// What came of an act.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Answer {
    /// The act's number; 0 where it could not be read.
    pub serial: u64,
    /// When.
    pub at: Instant,
    /// The act, where it could be read.
    pub act: Option<Act>,
    /// The command given, if any, or why nothing was done.
    pub outcome: Result<Option<CommandId>, Unable>,
}
