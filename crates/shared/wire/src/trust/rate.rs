//! Rates: the number of commands needed from one sender, with a rate class for each need.
//!
//! Evidence: this host's clock. A bucket is asked before a signature is verified and is charged only for a message that
//! passed (or came over a channel that already attributes it), so that no sender can empty another's. Reasons for the
//! numbers are in `docs/reference/bounds.md`.

use core::marker::PhantomData;

use super::Record;
use crate::command::{CommandKind, Intent};
use crate::id::NodeId;
use crate::policy::{Check, Policy};
use crate::refusal::Refusal;
use crate::time::{Instant, Span};

/// An intent within the rate of its sender; `S` came before.
#[derive(Debug)]
pub struct WithinRate<S>(PhantomData<S>);
/// An intent that is verified although verifications failed lately; `S` came before.
#[derive(Debug)]
pub struct WorthVerifying<S>(PhantomData<S>);

/// Number at once, and rate a second.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Allowance {
    /// Commands at once.
    pub burst: u32,
    /// Limit in a second, in the long run.
    pub per_s: u32,
}

/// Need for a command. Each rate class has its own bucket, so that requests in one take no
/// allowance from another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RateClass {
    /// Commands that lead away from safe.
    Away,
    /// Commands that take authority, or an identity's validity, away without stopping the unit.
    Withdraw,
    /// The command to stop, alone in its class. A HOLD refused for its rate therefore comes after eight HOLDs of the
    /// same sender: no flood of another kind keeps one out, even from another holder of the sender's key.
    Hold,
}

/// Failed verifications, for any claimed sender: at a tenth of a millisecond each, a few thousandths
/// of a processor.
const UNPROVEN: Allowance = Allowance { burst: 16, per_s: 16 };
/// Refusals that are logged and answered; every refusal is counted. The rate keeps a flood of messages from becoming a
/// flood of log entries and answers. The burst is that of one operator, so that each operator is informed of each
/// refusal while there is no flood.
const TOLD: Allowance = Allowance { burst: 8, per_s: 4 };

/// Buckets: one for each sender and class, one for failed verifications of any sender, and one for reported refusals.
#[derive(Clone, Debug, Default)]
pub struct Rates {
    /// Time at which each bucket is full again, by rate class.
    full: Vec<(NodeId, [Instant; CLASSES])>,
    unproven: Instant,
    told: Instant,
}

/// Number of rate classes.
const CLASSES: usize = 3;

impl RateClass {
    /// Rate class of a command of this kind.
    pub fn from_kind(kind: CommandKind) -> RateClass {
        match kind {
            CommandKind::Hold => RateClass::Hold,
            CommandKind::Disarm => RateClass::Withdraw,
            CommandKind::Enable
            | CommandKind::Resume
            | CommandKind::Arm(_)
            | CommandKind::Confirm(_)
            | CommandKind::Configure(_) => RateClass::Away,
        }
    }

    /// Number of commands of one sender that pass.
    pub fn allowance(self) -> Allowance {
        match self {
            RateClass::Away | RateClass::Withdraw => Allowance { burst: 8, per_s: 4 },
            RateClass::Hold => Allowance { burst: 8, per_s: 10 },
        }
    }
}

impl Allowance {
    fn interval(self) -> Span {
        Span(1_000_000 / u64::from(self.per_s))
    }

    /// True if one more passes at `now` into a bucket that is full again at `full`.
    fn room(self, full: Instant, now: Instant) -> bool {
        full.since(now).0 <= self.interval().0 * u64::from(self.burst - 1)
    }

    /// Time at which the bucket is full again after one more.
    fn charged(self, full: Instant, now: Instant) -> Instant {
        full.max(now) + self.interval()
    }
}

impl Rates {
    /// Checks that one more of `who` passes at `now`.
    pub fn room(&self, who: NodeId, class: RateClass, now: Instant) -> Result<(), Refusal> {
        let full = self.full.iter().find(|(node, _)| *node == who).map_or(now, |(_, full)| full[class as usize]);
        let allowance = class.allowance();
        if allowance.room(full, now) {
            Ok(())
        } else {
            Err(Refusal::Rate { burst: allowance.burst, per_s: allowance.per_s, got: who })
        }
    }

    /// Charges `who` for one.
    pub fn charge(&mut self, who: NodeId, class: RateClass, now: Instant) {
        let index = self.full.iter().position(|(node, _)| *node == who).unwrap_or_else(|| {
            self.full.push((who, [now; CLASSES]));
            self.full.len() - 1
        });
        let full = &mut self.full[index].1[class as usize];
        *full = class.allowance().charged(*full, now);
    }

    /// Checks that one more of this class is to be verified at `now`, after failed verifications. Only a HOLD always
    /// is: forgeries of others must not keep one out.
    fn room_to_verify(&self, class: RateClass, now: Instant) -> Result<(), Refusal> {
        if class == RateClass::Hold || UNPROVEN.room(self.unproven, now) {
            Ok(())
        } else {
            Err(Refusal::Unproven { burst: UNPROVEN.burst, per_s: UNPROVEN.per_s })
        }
    }

    /// A command of this class failed verification at `now`. The charge is to no sender: a forger would otherwise use
    /// up the rate of the sender in the forged name.
    pub fn unproven(&mut self, class: RateClass, now: Instant) {
        if class != RateClass::Hold {
            self.unproven = UNPROVEN.charged(self.unproven, now);
        }
    }

    /// True if a refusal at `now` is to be logged, beside being counted.
    pub fn should_report(&mut self, now: Instant) -> bool {
        let due = TOLD.room(self.told, now);
        if due {
            self.told = TOLD.charged(self.told, now);
        }
        due
    }
}

impl<S> Record<S, Intent> {
    /// Checks that one more is needed of `node`, the command's sender or the channel's owner.
    pub fn within_rate(
        self,
        policy: &Policy,
        rates: &Rates,
        node: NodeId,
        now: Instant,
    ) -> Result<Record<WithinRate<S>, Intent>, Refusal> {
        self.check(policy, Check::Rate, WithinRate(PhantomData), |intent, _| {
            rates.room(node, RateClass::from_kind(intent.kind), now)
        })
    }

    /// Checks that failed verifications lately leave room for one more.
    pub fn worth_verifying(
        self,
        policy: &Policy,
        rates: &Rates,
        now: Instant,
    ) -> Result<Record<WorthVerifying<S>, Intent>, Refusal> {
        self.check(policy, Check::Rate, WorthVerifying(PhantomData), |intent, _| {
            rates.room_to_verify(RateClass::from_kind(intent.kind), now)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Number of `tries`, evenly over a second, that pass.
    fn count_passed(rates: &mut Rates, node: NodeId, class: RateClass, from: Instant, tries: u64) -> u32 {
        let try_at = |n| from + Span(n * 1_000_000 / tries);
        let mut passed = 0;
        for now in (0..tries).map(try_at) {
            if rates.room(node, class, now).is_ok() {
                rates.charge(node, class, now);
                passed += 1;
            }
        }
        passed
    }

    /// A flood takes no allowance from another sender or rate class.
    #[test]
    fn flood_gets_burst_and_rate_alone() {
        for class in [RateClass::Away, RateClass::Withdraw, RateClass::Hold] {
            let mut rates = Rates::default();
            let start = Instant(5_000_000);
            let Allowance { burst, per_s } = class.allowance();
            let first = count_passed(&mut rates, NodeId::OPERATOR_2, class, start, 1000);
            assert_eq!(first, burst + per_s - 1, "{class:?}");
            let next = count_passed(&mut rates, NodeId::OPERATOR_2, class, start + Span::s(1), 1000);
            assert_eq!(next, per_s, "{class:?}");
            let now = start + Span::s(2);
            assert_eq!(rates.room(NodeId::OPERATOR, class, now), Ok(()), "{class:?}");
            for other in
                [RateClass::Away, RateClass::Withdraw, RateClass::Hold].into_iter().filter(|other| *other != class)
            {
                assert_eq!(rates.room(NodeId::OPERATOR_2, other, now), Ok(()), "{other:?} beside {class:?}");
            }
        }
    }

    #[test]
    fn an_idle_bucket_fills_up_and_no_further() {
        let mut rates = Rates::default();
        let Allowance { burst, per_s } = RateClass::Hold.allowance();
        count_passed(&mut rates, NodeId::OPERATOR, RateClass::Hold, Instant(0), 500);
        let after = count_passed(&mut rates, NodeId::OPERATOR, RateClass::Hold, Instant(60_000_000), 500);
        assert_eq!(after, burst + per_s - 1);
    }
}
