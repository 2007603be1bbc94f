//! What happened at this display: modes as they were reported, alarms as they came, went and were taken note of.
//!
//! It is bounded, and what it no longer has the recording has. What an operator still has to take note of is `alarm`'s, and
//! never leaves a list for want of room here.

use std::collections::VecDeque;

use wire::id::UnitId;
use wire::mode::{Cause, Mode};
use wire::person::Alarm;
use wire::time::Instant;

use crate::alarm::{self, Priority};

/// The most that is kept.
pub const MAX_PAST: usize = 256;

/// What can happen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Happened {
    /// A unit was reported in another mode than before, by this cause.
    Mode(UnitId, Mode, Cause),
    /// An alarm was raised.
    Raised(Alarm),
    /// What it was about is over.
    Over(Alarm),
    /// Somebody here took note of it.
    Acknowledged(Alarm),
}

impl Happened {
    /// How urgent it was, where it was an alarm that was raised.
    pub fn priority(&self) -> Option<Priority> {
        match self {
            Happened::Raised(alarm) => Some(Priority::of(alarm)),
            Happened::Mode(..) | Happened::Over(_) | Happened::Acknowledged(_) => None,
        }
    }

    /// What it says.
    pub fn words(&self) -> String {
        match self {
            Happened::Mode(unit, mode, cause) => format!("{unit} went to {}, cause {}", mode.name(), cause.label()),
            Happened::Raised(alarm) => alarm::words(alarm),
            Happened::Over(alarm) => format!("over: {}", alarm::words(alarm)),
            Happened::Acknowledged(alarm) => format!("acknowledged: {}", alarm::words(alarm)),
        }
    }
}

/// What happened, and when.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Past {
    /// On the console's clock.
    pub at: Instant,
    /// What.
    pub what: Happened,
}

/// The newest [`MAX_PAST`] of what happened.
#[derive(Clone, Debug, Default)]
pub struct History {
    kept: VecDeque<Past>,
    more: u32,
}

impl History {
    /// Keeps one more, and gives up the oldest where there is no room.
    pub fn note(&mut self, at: Instant, what: Happened) {
        if self.kept.len() == MAX_PAST {
            self.kept.pop_front();
            self.more = self.more.saturating_add(1);
        }
        self.kept.push_back(Past { at, what });
    }

    /// As drawn: oldest first, and how many are no longer there.
    pub fn shown(&self) -> (Vec<Past>, u32) {
        (self.kept.iter().copied().collect(), self.more)
    }
}
