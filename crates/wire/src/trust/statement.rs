//! Statements about one intent: an operator's confirmation and a unit's acknowledgement.
//!
//! Evidence: the signer's signature, and the id and hash of the one signed intent that the statement is about. Such a
//! statement needs no age and no sequence of its own: it cannot serve for another intent, and saying it twice says no
//! more than saying it once. Whether the intent itself is young enough is judged where its nonce was issued.

use minicbor::{Decode, Encode};

use super::{Accepted, Attributed, Decoded, Received, Record};
use crate::codec;
use crate::command::{Ack, Confirmation, IntentHash, MAX_ORDER};
use crate::id::{CommandId, NodeId};
use crate::policy::{Check, Policy};
use crate::refusal::Refusal;
use crate::sign::{Keyring, Purpose, Signed};
use crate::time::Instant;

/// A message that is bound to one signed intent by id and hash.
pub trait Statement: Encode<()> + for<'b> Decode<'b, ()> {
    /// What its signature is over.
    const PURPOSE: Purpose;

    /// The command and the SHA-256 of its signed intent.
    fn about(&self) -> (CommandId, IntentHash);
}

impl Statement for Confirmation {
    const PURPOSE: Purpose = Purpose::Confirmation;

    fn about(&self) -> (CommandId, IntentHash) {
        (self.id, self.intent)
    }
}

impl Statement for Ack {
    const PURPOSE: Purpose = Purpose::Ack;

    fn about(&self) -> (CommandId, IntentHash) {
        (self.id, self.intent)
    }
}

/// A statement with the signature that it came under.
#[derive(Debug)]
pub struct SignedStatement<'b, M> {
    message: M,
    signed: Signed<'b>,
}

impl<'b, M: Statement> Decoded<SignedStatement<'b, M>> {
    /// Length and schema of a signed statement that was received at `at`.
    pub fn parse_statement(at: Instant, bytes: &'b [u8]) -> Result<Self, Refusal> {
        let framed = Received::new(at, bytes).frame(MAX_ORDER)?;
        let signed = Signed::parse(framed.message, MAX_ORDER)?;
        let message = codec::decode::<M>(signed.payload, MAX_ORDER)?;
        let message = SignedStatement { message, signed };
        Ok(Record { message, evidence: framed.evidence, stage: core::marker::PhantomData })
    }

    /// The command and the signed intent that it claims to be about, for finding them; believed by nobody.
    pub fn claimed(&self) -> (CommandId, IntentHash) {
        self.message.message.about()
    }

    /// The statement is `signer`'s, by its signature.
    pub fn by_signer(self, policy: &Policy, signer: NodeId, keys: &Keyring) -> Result<Attributed<M>, Refusal> {
        let signed: Attributed<SignedStatement<'b, M>> =
            self.check(policy, Check::Signature, |m, _| keys.verify(signer, M::PURPOSE, &m.signed))?;
        let message = signed.message.message;
        Ok(Record { message, evidence: signed.evidence, stage: core::marker::PhantomData })
    }
}

impl<M: Statement> Attributed<M> {
    /// The statement is about this very intent. Cannot be waived.
    pub fn about(self, command: CommandId, intent: &IntentHash) -> Result<Accepted<M>, Refusal> {
        if self.message.about() == (command, *intent) {
            Ok(self.pass())
        } else {
            Err(Refusal::Confirmation { expected: command })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::id::{Boot, Sequence};
    use crate::sign::Key;

    #[test]
    fn a_confirmation_serves_for_one_intent_under_one_key_and_not_as_an_acknowledgement() {
        let (key, policy) = (Key::from_bytes(&[9; 32]), Policy::default());
        let mut keys = Keyring::default();
        keys.insert(NodeId::OPERATOR, &key.public());
        keys.insert(NodeId::UNIT_A, &Key::from_bytes(&[8; 32]).public());
        let id = CommandId { operator: NodeId::OPERATOR, boot: Boot(1), sequence: Sequence(1) };
        let bytes = key.sign(Purpose::Confirmation, &codec::encode(&Confirmation { id, intent: [3; 32] }));
        let parse = || Decoded::<SignedStatement<'_, Confirmation>>::parse_statement(Instant(0), &bytes).unwrap();
        let by = |signer| parse().by_signer(&policy, signer, &keys);
        assert!(by(NodeId::OPERATOR).unwrap().about(id, &[3; 32]).is_ok());
        assert!(by(NodeId::OPERATOR).unwrap().about(id, &[4; 32]).is_err());
        assert!(by(NodeId::UNIT_A).is_err());
        assert!(Decoded::<SignedStatement<'_, Ack>>::parse_statement(Instant(0), &bytes).is_err());
    }
}
