//! Freshness: the only way from decoded to fresh, and for an order at its unit to in time.
//!
//! Evidence: an upper bound of the age ([`Age`]), which only a challenge and its echo, or one host's own clock, can
//! give. The stamp alone is no proof.

use super::{Decoded, Record};
use crate::command::Intent;
use crate::policy::{Check, Policy};
use crate::refusal::Refusal;
use crate::time::{Age, Span};

/// A message with a bounded age within the limit.
#[derive(Debug)]
pub struct Fresh(());
/// An intent that repeats a young enough nonce of its unit.
#[derive(Debug)]
pub struct InTime(());

impl<M> Decoded<M> {
    /// Age at most `limit`; without any bound (`age` absent) it counts as stale.
    pub fn fresh(
        mut self,
        policy: &Policy,
        age: Option<Age>,
        limit: Span,
        echo_limit: Span,
    ) -> Result<Record<Fresh, M>, Refusal> {
        self.evidence.age = age;
        self.check(policy, Check::Freshness, Fresh(()), |_, evidence| match evidence.age {
            None => Err(Refusal::NoEcho { limit: echo_limit }),
            Some(age) if age.upper() > limit => Err(Refusal::Stale { limit, age: age.upper() }),
            Some(_) => Ok(()),
        })
    }
}

impl Decoded<Intent> {
    /// The intent repeats a nonce that its unit issued at most `limit` ago (`age` since that issue; absent when the
    /// nonce is not answerable), so it cannot be older than that, even if it was held back on its way.
    pub fn in_time(self, policy: &Policy, age: Option<Age>, limit: Span) -> Result<Record<InTime, Intent>, Refusal> {
        self.check(policy, Check::Late, InTime(()), |intent, _| match age {
            Some(age) if age.upper() <= limit => Ok(()),
            Some(_) | None => Err(Refusal::Late { limit, got: intent.nonce }),
        })
    }
}
