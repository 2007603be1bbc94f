//! Rates: how many commands of one sender there can be need for, with a lane of its own for what leads towards safe.
//!
//! Evidence: this host's clock. A bucket is asked before a signature is verified and is charged only for what passed
//! (or for what came over a channel that already says whose it is), so that nobody can empty another's. Reasons for the
//! numbers are in `docs/bounds.md`.

use super::Fresh;
use crate::command::Intent;
use crate::id::NodeId;
use crate::policy::{Check, Policy};
use crate::refusal::Refusal;
use crate::time::{Instant, Span};

/// So many at once, and so many a second.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lane {
    /// At once.
    pub burst: u32,
    /// In a second, in the long run.
    pub per_s: u32,
}

/// Commands away from safe.
pub const AWAY: Lane = Lane { burst: 8, per_s: 4 };
/// Commands towards safe. That one is refused for its rate means that eight of the same sender went through just before.
pub const SAFE: Lane = Lane { burst: 8, per_s: 10 };
/// Refusals for rate are counted one by one and told at most so often, so that a flood is not one in the log too.
const TELL: Span = Span::ms(250);

/// A bucket for each sender and lane, bounded by the closed set of identities.
#[derive(Clone, Debug, Default)]
pub struct Rates {
    /// When each bucket is full again, away from safe and towards it.
    full: Vec<(NodeId, [Instant; 2])>,
    told: Option<Instant>,
}

impl Lane {
    fn of(towards_safe: bool) -> (usize, Lane) {
        if towards_safe { (1, SAFE) } else { (0, AWAY) }
    }

    fn interval(self) -> Span {
        Span(1_000_000 / u64::from(self.per_s))
    }
}

impl Rates {
    /// Whether one more of `who` goes in at `now`.
    pub fn room(&self, who: NodeId, towards_safe: bool, now: Instant) -> Result<(), Refusal> {
        let (at, lane) = Lane::of(towards_safe);
        let full = self.full.iter().find(|(node, _)| *node == who).map(|(_, full)| full[at]);
        let owed = full.map_or(Span::ZERO, |full| full.since(now));
        if owed.0 <= lane.interval().0 * u64::from(lane.burst - 1) {
            Ok(())
        } else {
            Err(Refusal::Rate { burst: lane.burst, per_s: lane.per_s, got: who })
        }
    }

    /// Charges `who` for one.
    pub fn charge(&mut self, who: NodeId, towards_safe: bool, now: Instant) {
        let (at_lane, lane) = Lane::of(towards_safe);
        let at = self.full.iter().position(|(node, _)| *node == who).unwrap_or_else(|| {
            self.full.push((who, [now; 2]));
            self.full.len() - 1
        });
        let full = &mut self.full[at].1[at_lane];
        *full = (*full).max(now) + lane.interval();
    }

    /// Whether a refusal for rate at `now` is to be told, beside being counted.
    pub fn tell(&mut self, now: Instant) -> bool {
        let due = self.told.is_none_or(|told| now.since(told) >= TELL);
        if due {
            self.told = Some(now);
        }
        due
    }
}

impl Fresh<Intent> {
    /// There is need for one more of `who`, whose command it is or over whose channel it came.
    pub fn within_rate(
        self,
        policy: &Policy,
        rates: &Rates,
        who: NodeId,
        now: Instant,
    ) -> Result<Fresh<Intent>, Refusal> {
        self.check(policy, Check::Rate, |intent, _| rates.room(who, intent.kind.towards_safe(), now))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How many of `tries`, evenly over a second, go in.
    fn through(rates: &mut Rates, who: NodeId, towards_safe: bool, from: Instant, tries: u64) -> u32 {
        let try_at = |n| from + Span(n * 1_000_000 / tries);
        let mut through = 0;
        for now in (0..tries).map(try_at) {
            if rates.room(who, towards_safe, now).is_ok() {
                rates.charge(who, towards_safe, now);
                through += 1;
            }
        }
        through
    }

    #[test]
    fn a_flood_gets_its_burst_and_its_rate_and_takes_nothing_from_another_sender_or_lane() {
        let mut rates = Rates::default();
        let start = Instant(5_000_000);
        let first = through(&mut rates, NodeId::OPERATOR_2, false, start, 1000);
        assert_eq!(first, AWAY.burst + AWAY.per_s - 1);
        let next = through(&mut rates, NodeId::OPERATOR_2, false, start + Span::s(1), 1000);
        assert_eq!(next, AWAY.per_s);
        let now = start + Span::s(2);
        assert_eq!(rates.room(NodeId::OPERATOR, false, now), Ok(()));
        assert_eq!(rates.room(NodeId::OPERATOR_2, true, now), Ok(()), "holding has its own lane");
    }

    #[test]
    fn an_idle_bucket_fills_up_and_no_further() {
        let mut rates = Rates::default();
        through(&mut rates, NodeId::OPERATOR, true, Instant(0), 500);
        assert_eq!(through(&mut rates, NodeId::OPERATOR, true, Instant(60_000_000), 500), SAFE.burst + SAFE.per_s - 1);
    }
}
