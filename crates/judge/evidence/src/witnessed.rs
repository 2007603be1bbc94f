//! An event of the log with the time at which it was seen.

use ground_truth::Entry;

/// Microseconds of trace time: true time in the twin, one common host clock live. No core reads it.
pub type Micros = u64;

/// An event with the time at which the instrument plane saw it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Witnessed {
    /// Trace time.
    pub at: Micros,
    /// The audit entry.
    pub entry: Entry,
}
