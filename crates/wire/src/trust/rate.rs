//! Rates: how many commands of one sender there can be need for, with a lane for each of what they are needed for.
//!
//! Evidence: this host's clock. A bucket is asked before a signature is verified and is charged only for what passed
//! (or for what came over a channel that already says whose it is), so that nobody can empty another's. Reasons for the
//! numbers are in `docs/reference/bounds.md`.

use core::marker::PhantomData;

use super::Record;
use crate::command::{CommandKind, Intent};
use crate::id::NodeId;
use crate::policy::{Check, Policy};
use crate::refusal::Refusal;
use crate::time::{Instant, Span};

/// There is need for one more of its sender; `S` came before.
#[derive(Debug)]
pub struct WithinRate<S>(PhantomData<S>);
/// Little enough was verified in vain; `S` came before.
#[derive(Debug)]
pub struct WorthVerifying<S>(PhantomData<S>);

/// So many at once, and so many a second.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Allowance {
    /// At once.
    pub burst: u32,
    /// In a second, in the long run.
    pub per_s: u32,
}

/// What a command is needed for. Each lane has a bucket of its own, so that what a sender asks for in one takes nothing
/// from another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lane {
    /// To lead away from safe.
    Away,
    /// To take something away without stopping the unit: authority, or somebody's standing.
    Withdraw,
    /// To stop. Nothing else is in this lane, so a HOLD that is refused for its rate comes after eight HOLDs of the same
    /// sender: no flood of another kind keeps one out, whoever else has the sender's key.
    Hold,
}

/// Verifications that came to nothing, whoever they were said to be of: at a tenth of a millisecond each, a few thousandths
/// of a processor.
const UNPROVEN: Allowance = Allowance { burst: 16, per_s: 16 };
/// Refusals are counted one by one and told at most so often, so that a flood is not one in the log and in answers too. At
/// once as many as one operator may ask for, so that whoever asks in vain is told each time while nobody floods.
const TOLD: Allowance = Allowance { burst: 8, per_s: 4 };

/// A bucket for each sender and lane, bounded by the closed set of identities, and two that are nobody's.
#[derive(Clone, Debug, Default)]
pub struct Rates {
    /// When each bucket is full again, by lane.
    full: Vec<(NodeId, [Instant; LANES])>,
    unproven: Instant,
    told: Instant,
}

/// Lanes of a sender.
const LANES: usize = 3;

impl Lane {
    /// Where a command of this kind goes.
    pub fn of(kind: CommandKind) -> Lane {
        match kind {
            CommandKind::Hold => Lane::Hold,
            CommandKind::Disarm => Lane::Withdraw,
            CommandKind::Enable
            | CommandKind::Resume
            | CommandKind::Arm(_)
            | CommandKind::Confirm(_)
            | CommandKind::Configure(_) => Lane::Away,
        }
    }

    /// How many of one sender go in.
    pub fn allowance(self) -> Allowance {
        match self {
            Lane::Away | Lane::Withdraw => Allowance { burst: 8, per_s: 4 },
            Lane::Hold => Allowance { burst: 8, per_s: 10 },
        }
    }
}

impl Allowance {
    fn interval(self) -> Span {
        Span(1_000_000 / u64::from(self.per_s))
    }

    /// Whether one more goes in at `now` into a bucket that is full again at `full`.
    fn room(self, full: Instant, now: Instant) -> bool {
        full.since(now).0 <= self.interval().0 * u64::from(self.burst - 1)
    }

    /// When the bucket is full again after one more.
    fn charged(self, full: Instant, now: Instant) -> Instant {
        full.max(now) + self.interval()
    }
}

impl Rates {
    /// Whether one more of `who` goes in at `now`.
    pub fn room(&self, who: NodeId, lane: Lane, now: Instant) -> Result<(), Refusal> {
        let full = self.full.iter().find(|(node, _)| *node == who).map_or(now, |(_, full)| full[lane as usize]);
        let allowance = lane.allowance();
        if allowance.room(full, now) {
            Ok(())
        } else {
            Err(Refusal::Rate { burst: allowance.burst, per_s: allowance.per_s, got: who })
        }
    }

    /// Charges `who` for one.
    pub fn charge(&mut self, who: NodeId, lane: Lane, now: Instant) {
        let at = self.full.iter().position(|(node, _)| *node == who).unwrap_or_else(|| {
            self.full.push((who, [now; LANES]));
            self.full.len() - 1
        });
        let full = &mut self.full[at].1[lane as usize];
        *full = lane.allowance().charged(*full, now);
    }

    /// Whether one more of this lane is to be verified at `now`, after what came to nothing. Only a HOLD always is: what
    /// others forge must not keep one out.
    fn room_to_verify(&self, lane: Lane, now: Instant) -> Result<(), Refusal> {
        if lane == Lane::Hold || UNPROVEN.room(self.unproven, now) {
            Ok(())
        } else {
            Err(Refusal::Unproven { burst: UNPROVEN.burst, per_s: UNPROVEN.per_s })
        }
    }

    /// One of this lane was verified at `now` in vain. It is nobody's: who forges in another's name would empty that one's.
    pub fn unproven(&mut self, lane: Lane, now: Instant) {
        if lane != Lane::Hold {
            self.unproven = UNPROVEN.charged(self.unproven, now);
        }
    }

    /// Whether a refusal at `now` is to be told, beside being counted.
    pub fn tell(&mut self, now: Instant) -> bool {
        let due = TOLD.room(self.told, now);
        if due {
            self.told = TOLD.charged(self.told, now);
        }
        due
    }
}

impl<S> Record<S, Intent> {
    /// There is need for one more of `who`, whose command it is or over whose channel it came.
    pub fn within_rate(
        self,
        policy: &Policy,
        rates: &Rates,
        who: NodeId,
        now: Instant,
    ) -> Result<Record<WithinRate<S>, Intent>, Refusal> {
        self.check(policy, Check::Rate, WithinRate(PhantomData), |intent, _| {
            rates.room(who, Lane::of(intent.kind), now)
        })
    }

    /// Not so much has come to nothing lately that no more is verified.
    pub fn worth_verifying(
        self,
        policy: &Policy,
        rates: &Rates,
        now: Instant,
    ) -> Result<Record<WorthVerifying<S>, Intent>, Refusal> {
        self.check(policy, Check::Rate, WorthVerifying(PhantomData), |intent, _| {
            rates.room_to_verify(Lane::of(intent.kind), now)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How many of `tries`, evenly over a second, go in.
    fn through(rates: &mut Rates, who: NodeId, lane: Lane, from: Instant, tries: u64) -> u32 {
        let try_at = |n| from + Span(n * 1_000_000 / tries);
        let mut through = 0;
        for now in (0..tries).map(try_at) {
            if rates.room(who, lane, now).is_ok() {
                rates.charge(who, lane, now);
                through += 1;
            }
        }
        through
    }

    #[test]
    fn a_flood_gets_its_burst_and_its_rate_and_takes_nothing_from_another_sender_or_lane() {
        for lane in [Lane::Away, Lane::Withdraw, Lane::Hold] {
            let mut rates = Rates::default();
            let start = Instant(5_000_000);
            let Allowance { burst, per_s } = lane.allowance();
            let first = through(&mut rates, NodeId::OPERATOR_2, lane, start, 1000);
            assert_eq!(first, burst + per_s - 1, "{lane:?}");
            let next = through(&mut rates, NodeId::OPERATOR_2, lane, start + Span::s(1), 1000);
            assert_eq!(next, per_s, "{lane:?}");
            let now = start + Span::s(2);
            assert_eq!(rates.room(NodeId::OPERATOR, lane, now), Ok(()), "{lane:?}");
            for other in [Lane::Away, Lane::Withdraw, Lane::Hold].into_iter().filter(|other| *other != lane) {
                assert_eq!(rates.room(NodeId::OPERATOR_2, other, now), Ok(()), "{other:?} beside {lane:?}");
            }
        }
    }

    #[test]
    fn an_idle_bucket_fills_up_and_no_further() {
        let mut rates = Rates::default();
        let Allowance { burst, per_s } = Lane::Hold.allowance();
        through(&mut rates, NodeId::OPERATOR, Lane::Hold, Instant(0), 500);
        let after = through(&mut rates, NodeId::OPERATOR, Lane::Hold, Instant(60_000_000), 500);
        assert_eq!(after, burst + per_s - 1);
    }
}
