//! The trust boundary as types.
//!
//! `Received → Framed → Decoded → Fresh → Attributed → Ordered → Accepted`
//!
//! Each check is the only way to the next stage. A stage is a token that no file can make but the one with the check
//! that earns it; none of the types serialises, because a message that crosses a process is untrusted again on arrival.
//! A check either gives the next stage or one [`Refusal`]. A waived check gives the stage by waiver and the record
//! carries that from then on.
//!
//! | stage | earned in | evidence |
//! |---|---|---|
//! | `Framed`, `Decoded` | `schema` | the bytes |
//! | `Fresh`, `InTime` | `freshness` | a challenge and its echo, a nonce, or one host's clock |
//! | `Attributed` | `attribution` | the session, a signature, a tag |
//! | `Live` | `acceptance` | the product's own mark, on shared memory |
//! | `Ordered` | `ordering`, and `orders` in it for commands | boot, sequence, command id |
//! | `Accepted` | `acceptance` | the product's own mark, or the intent that a statement is about |
//!
//! An intent passes more stages between `Fresh` and `Attributed`, which cost less than its signature: `revocation`,
//! `orders` and `rate` earn them, `intent` gives their order for each service. Deciding about an accepted record is
//! left to the services.

mod acceptance;
mod attribution;
mod freshness;
mod gates;
mod intent;
mod ordering;
pub mod rate;
mod revocation;
mod schema;
mod statement;

use crate::policy::{Check, Policy, Requirement, Waived};
use crate::refusal::Refusal;
use crate::time::{Age, Instant};

pub use acceptance::Provenance;
pub use attribution::{Bearer, SessionRecord, unit_of};
pub use gates::{BusGate, SessionGate};
pub use intent::{AtGateway, AtUnit};
pub use ordering::orders::Counters;
pub use ordering::{Window, Windows};
pub use rate::Rates;
pub use revocation::{Revocation, RevocationList, Validity};
pub use schema::{BusMessage, Exchange, Received, SignedReport};
pub use statement::{SignedStatement, Statement};

/// The stages, as types.
pub mod stage {
    pub use super::acceptance::{Accepted, Live};
    pub use super::attribution::Attributed;
    pub use super::freshness::{Fresh, InTime};
    pub use super::ordering::Ordered;
    pub use super::ordering::orders::NotRepeated;
    pub use super::rate::{WithinRate, WorthVerifying};
    pub use super::revocation::{InRole, NotRevoked};
    pub use super::schema::{Decoded, Framed};
}

/// A record on its way through the boundary: at `stage::S`, with message `M`.
#[derive(Debug)]
pub struct Record<S, M> {
    message: M,
    evidence: Evidence,
    stage: S,
}

/// Facts established about a record so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Evidence {
    /// Time at which it was received, on this host's clock.
    pub received: Instant,
    /// Upper bound of its age at reception, once freshness was judged.
    pub age: Option<Age>,
    /// Checks that were passed over.
    pub waived: Waived,
}

/// Bytes of a length within bounds.
pub type Framed<'a> = Record<stage::Framed, &'a [u8]>;
/// A message of the expected type.
pub type Decoded<M> = Record<stage::Decoded, M>;
/// A message with a bounded age.
pub type Fresh<M> = Record<stage::Fresh, M>;
/// A record with a known maker.
pub type Attributed<M> = Record<stage::Attributed, M>;
/// A message in order.
pub type Ordered<M> = Record<stage::Ordered, M>;
/// A message that may influence state.
pub type Accepted<M> = Record<stage::Accepted, M>;

impl<S, M> Record<S, M> {
    /// Facts established so far.
    pub fn evidence(&self) -> Evidence {
        self.evidence
    }

    /// The next stage, by the token of the file that earns it.
    fn next<T>(self, earned: T) -> Record<T, M> {
        Record { message: self.message, evidence: self.evidence, stage: earned }
    }

    /// The record with another view of its message, at the same stage.
    fn map<N>(self, view: impl FnOnce(M) -> N) -> Record<S, N> {
        Record { message: view(self.message), evidence: self.evidence, stage: self.stage }
    }

    /// The record, if `check` is waived or `judge` has no objection: one of several checks before the next stage.
    fn judged(
        mut self,
        policy: &Policy,
        check: Check,
        judge: impl FnOnce(&M, &Evidence) -> Result<(), Refusal>,
    ) -> Result<Self, Refusal> {
        match policy.check(check) {
            Requirement::Required => judge(&self.message, &self.evidence)?,
            Requirement::Waived => self.evidence.waived = self.evidence.waived.with_check(check),
        }
        Ok(self)
    }

    /// The next stage, on the same terms.
    fn check<T>(
        self,
        policy: &Policy,
        check: Check,
        earned: T,
        judge: impl FnOnce(&M, &Evidence) -> Result<(), Refusal>,
    ) -> Result<Record<T, M>, Refusal> {
        Ok(self.judged(policy, check, judge)?.next(earned))
    }
}

impl<M> Accepted<M> {
    /// The message.
    pub fn message(&self) -> &M {
        &self.message
    }

    /// The message with its evidence, for the service that acts on it.
    pub fn into_parts(self) -> (M, Evidence) {
        (self.message, self.evidence)
    }
}
