//! Timeouts of a guest, in real time, for a guest is a process. No core gets any of it.

use std::time::{Duration, Instant};

use rustix::event::Timespec;

/// The end of a time that a guest has.
pub(crate) struct Deadline {
    at: Instant,
    ms: u64,
}

impl Deadline {
    /// Deadline `ms` milliseconds from now.
    #[expect(
        clippy::disallowed_methods,
        reason = "a guest is a process: its patience is real time, and no core is handed this"
    )]
    pub(crate) fn after_ms(ms: u64) -> Self {
        Self { at: Instant::now() + Duration::from_millis(ms), ms }
    }

    /// The whole time, milliseconds.
    pub(crate) fn ms(&self) -> u64 {
        self.ms
    }

    /// Time left; zero when it is over.
    #[expect(clippy::disallowed_methods, reason = "as above")]
    pub(crate) fn left(&self) -> Duration {
        self.at.saturating_duration_since(Instant::now())
    }
}

/// Conversion of a duration to the timeout of `poll`.
pub(crate) fn timeout(limit: Duration) -> Timespec {
    Timespec { tv_sec: limit.as_secs() as i64, tv_nsec: i64::from(limit.subsec_nanos()) }
}
