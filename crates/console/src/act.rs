//! Acts of a person at the console as the display holds them: the order that waits for its confirmation, and the
//! answers. `hand` judges the acts.

use wire::id::CommandId;
pub use wire::person::{Act, Alarm, Numbered, Order, Role, Shelf, Unable};
use wire::time::{Instant, Span};

/// Time limit for confirming a prepared order: long enough to type a reason, too short to be forgotten.
pub const PREPARED_FOR: Span = Span::s(10);
/// Answers that are kept.
pub const MAX_ANSWERS: usize = 16;

/// An order that waits to be confirmed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Prepared {
    /// The number of the act that prepared it.
    pub serial: u64,
    /// Order that waits.
    pub order: Order,
    /// Time of the preparation.
    pub since: Instant,
    /// Time at which it lapses.
    pub until: Instant,
}

/// Result of an act.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Answer {
    /// The act's number; 0 where it could not be read.
    pub serial: u64,
    /// Time of the answer.
    pub at: Instant,
    /// The act, where it could be read.
    pub act: Option<Act>,
    /// The command given, if any, or the reason for which the act was not carried out.
    pub outcome: Result<Option<CommandId>, Unable>,
}
