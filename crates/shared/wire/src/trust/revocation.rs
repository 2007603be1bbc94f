//! Revocation: who may give commands, and who is still admitted. Evidence: the list of operators, the authority's
//! signature over a revocation, and this host's clock.
//!
//! The authority signs a revocation of every operator and teammate when the keys are made, and its own key is gone
//! before the first service starts; the console keeps them, as one keeps a revocation certificate. Its holder can only
//! revoke that identity, permanently.

use core::marker::PhantomData;
use std::collections::{BTreeMap, BTreeSet};

use minicbor::{Decode, Encode};

use super::{Received, Record};
use crate::codec;
use crate::command::{Intent, MAX_ORDER};
use crate::id::NodeId;
use crate::policy::{Check, Policy};
use crate::refusal::Refusal;
use crate::sign::{Key, Keyring, Purpose, Signed};
use crate::time::{Instant, Span};

/// An intent of an identity that may give commands; `S` came before.
#[derive(Debug)]
pub struct InRole<S>(PhantomData<S>);
/// An intent of an identity that is neither revoked nor past its time; `S` came before.
#[derive(Debug)]
pub struct NotRevoked<S>(PhantomData<S>);

/// Statement of the authority: this identity is admitted no longer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Revocation {
    /// Identity that is revoked.
    #[n(0)]
    pub of: NodeId,
}

impl Revocation {
    /// The signed statement, by the authority's key.
    pub fn sign(self, authority: &Key) -> Vec<u8> {
        authority.sign(Purpose::Revocation, &codec::encode(&self))
    }
}

/// Time for which an identity is admitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Validity {
    /// Identity with a limited admission.
    pub who: NodeId,
    /// End of admission, milliseconds from the start of the judging process. A restart within a run shortens the time
    /// by the elapsed part.
    pub until_ms: u64,
}

/// Identities that are admitted no longer.
#[derive(Clone, Debug)]
pub struct RevocationList {
    /// At most one for each identity.
    ends: BTreeMap<NodeId, Instant>,
    revoked: BTreeSet<NodeId>,
}

impl RevocationList {
    /// A list without revocations; identities in `mandates` are admitted until their end, counted from `now`.
    pub fn new(mandates: &[Validity], now: Instant) -> Self {
        let ends = mandates.iter().map(|mandate| (mandate.who, now + Span::ms(mandate.until_ms))).collect();
        RevocationList { ends, revoked: BTreeSet::new() }
    }

    /// Takes a signed revocation that came at `now`; gives the identity that it revoked, `None` where it was revoked
    /// before. The authority's signature cannot be waived.
    pub fn revoke(&mut self, keys: &Keyring, now: Instant, bytes: &[u8]) -> Result<Option<NodeId>, Refusal> {
        let framed = Received::new(now, bytes).frame(MAX_ORDER)?;
        let signed = Signed::parse(framed.message, MAX_ORDER)?;
        let revocation: Revocation = codec::decode(signed.payload, MAX_ORDER)?;
        // A repetition costs no verification: the gateway sends every revocation again each challenge period.
        if self.revoked.contains(&revocation.of) {
            return Ok(None);
        }
        keys.verify(NodeId::AUTHORITY, Purpose::Revocation, &signed)?;
        self.revoked.insert(revocation.of);
        Ok(Some(revocation.of))
    }

    /// Checks that `node` is admitted at `now`.
    pub fn check_admitted(&self, node: NodeId, now: Instant) -> Result<(), Refusal> {
        if self.revoked.contains(&node) {
            return Err(Refusal::Revoked { got: node });
        }
        match self.ends.get(&node).copied() {
            Some(end) if now >= end => Err(Refusal::Expired { got: node, over: now.since(end) }),
            Some(_) | None => Ok(()),
        }
    }
}

impl<S> Record<S, Intent> {
    /// Checks that the intent names an identity that may give commands at all.
    pub fn by_role(self, policy: &Policy, operators: &[NodeId]) -> Result<Record<InRole<S>, Intent>, Refusal> {
        self.check(policy, Check::Role, InRole(PhantomData), |intent, _| {
            let got = intent.id.operator;
            if operators.contains(&got) { Ok(()) } else { Err(Refusal::Role { got }) }
        })
    }

    /// Checks that the operator whom the intent names is still admitted.
    pub fn admitted(
        self,
        policy: &Policy,
        revoked: &RevocationList,
        now: Instant,
    ) -> Result<Record<NotRevoked<S>, Intent>, Refusal> {
        self.check(policy, Check::Revocation, NotRevoked(PhantomData), |intent, _| {
            revoked.check_admitted(intent.id.operator, now)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_authority_or_time_ends_validity() {
        let (authority, operator) = (Key::from_bytes(&[1; 32]), Key::from_bytes(&[2; 32]));
        let mut keys = Keyring::default();
        keys.insert(NodeId::AUTHORITY, &authority.public());
        keys.insert(NodeId::OPERATOR, &operator.public());
        let mandate = Validity { who: NodeId::OPERATOR, until_ms: 100 };
        let mut revoked = RevocationList::new(&[mandate], Instant(0));
        let second = Revocation { of: NodeId::OPERATOR_2 };
        let time = Instant(99_999);
        assert!(matches!(revoked.revoke(&keys, time, &second.sign(&operator)), Err(Refusal::Signature { .. })));
        assert_eq!(revoked.check_admitted(NodeId::OPERATOR_2, time), Ok(()));
        assert_eq!(revoked.revoke(&keys, time, &second.sign(&authority)), Ok(Some(NodeId::OPERATOR_2)));
        assert_eq!(revoked.revoke(&keys, time, &second.sign(&authority)), Ok(None));
        assert_eq!(revoked.check_admitted(NodeId::OPERATOR_2, time), Err(Refusal::Revoked { got: NodeId::OPERATOR_2 }));
        assert_eq!(revoked.check_admitted(NodeId::OPERATOR, time), Ok(()));
        let over = Span::ms(1);
        let expired = Refusal::Expired { got: NodeId::OPERATOR, over };
        assert_eq!(revoked.check_admitted(NodeId::OPERATOR, Instant(101_000)), Err(expired));
    }

    #[test]
    fn revocation_and_other_statements_are_not_interchangeable() {
        let authority = Key::from_bytes(&[1; 32]);
        let mut keys = Keyring::default();
        keys.insert(NodeId::AUTHORITY, &authority.public());
        let mut revoked = RevocationList::new(&[], Instant(0));
        let payload = codec::encode(&Revocation { of: NodeId::OPERATOR });
        let head = authority.sign(Purpose::Head, &payload);
        assert!(matches!(revoked.revoke(&keys, Instant(0), &head), Err(Refusal::Signature { .. })));
        assert!(revoked.revoke(&keys, Instant(0), &payload).is_err());
    }
}
