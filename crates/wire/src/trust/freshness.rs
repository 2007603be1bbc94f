//! Freshness: the only way from decoded to fresh.
//!
//! Evidence: an upper bound of the age ([`Age`]), which only a challenge and its echo, or one host's own clock, can
//! give. The stamp alone proves nothing.

use super::{Decoded, Fresh};
use crate::command::Intent;
use crate::policy::{Check, Policy};
use crate::refusal::Refusal;
use crate::time::{Age, Span};

impl<M> Decoded<M> {
    /// Age at most `limit`; without any bound (`age` absent) it counts as stale.
    pub fn fresh(
        mut self,
        policy: &Policy,
        age: Option<Age>,
        limit: Span,
        echo_limit: Span,
    ) -> Result<Fresh<M>, Refusal> {
        self.evidence.age = age;
        self.check(policy, Check::Freshness, |_, evidence| match evidence.age {
            None => Err(Refusal::NoEcho { limit: echo_limit }),
            Some(age) if age.upper() > limit => Err(Refusal::Stale { limit, age: age.upper() }),
            Some(_) => Ok(()),
        })
    }
}

impl Decoded<Intent> {
    /// The intent repeats a nonce that its unit issued at most `limit` ago (`age` since that issue; absent when the
    /// nonce is not answerable), so it cannot be older than that, whoever held it back.
    pub fn in_time(self, policy: &Policy, age: Option<Age>, limit: Span) -> Result<Fresh<Intent>, Refusal> {
        self.check(policy, Check::Late, |intent, _| match age {
            Some(age) if age.upper() <= limit => Ok(()),
            Some(_) | None => Err(Refusal::Late { limit, got: intent.nonce }),
        })
    }
}
