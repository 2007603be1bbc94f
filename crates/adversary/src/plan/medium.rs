//! The medium that a relay is in: the times at which it carries, and the time of travel. The medium is no attack, and
//! its losses are not logged as such. Datagrams that the adversary makes or holds back leave by a transmitter of its
//! own and do not depend on the medium.

use serde::{Deserialize, Serialize};
use wire::time::Span;

use super::{MAX_HOLD_MS, MAX_MS, PlanError, check_range};

/// Most stretches of a medium.
pub const MAX_STRETCHES: usize = 256;

/// Stretches in order of time; beyond them it does not carry. Without any it always carries, at once.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Medium(pub Vec<Stretch>);

/// A stretch of time in which a medium carries, from the start of the relay.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stretch {
    /// Start, milliseconds.
    pub from_ms: u64,
    /// End, milliseconds.
    pub until_ms: u64,
    /// Time of travel, microseconds.
    pub travel_us: u64,
}

impl Medium {
    /// Every magnitude within its bounds.
    pub(super) fn check(&self) -> Result<(), PlanError> {
        check_range("stretches", self.0.len() as u64, 0, MAX_STRETCHES as u64)?;
        self.0.iter().try_for_each(|stretch| {
            check_range("from_ms", stretch.from_ms, 0, MAX_MS)?;
            check_range("until_ms", stretch.until_ms, stretch.from_ms, MAX_MS)?;
            check_range("travel_us", stretch.travel_us, 0, MAX_HOLD_MS * 1000)
        })
    }

    /// Time of travel of a message that leaves this long after the start; none while it does not carry.
    pub fn travel(&self, since: Span) -> Option<Span> {
        if self.0.is_empty() {
            return Some(Span::ZERO);
        }
        let open = |stretch: &&Stretch| (Span::ms(stretch.from_ms)..Span::ms(stretch.until_ms)).contains(&since);
        self.0.iter().find(open).map(|stretch| Span(stretch.travel_us))
    }

    /// Times at which it stops to carry.
    pub fn ends(&self) -> impl Iterator<Item = Span> {
        let ends = self.0.iter().map(|stretch| Span::ms(stretch.until_ms));
        ends.filter(|end| self.travel(*end).is_none())
    }
}
