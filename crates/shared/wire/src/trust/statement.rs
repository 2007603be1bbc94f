//! Statements about one intent: an operator's confirmation and a unit's acknowledgement.
//!
//! Evidence: the signer's signature, and the id and hash of the one signed intent that the statement is about. Such a
//! statement needs no age and no sequence of its own: it cannot serve for another intent, and saying it twice says no
//! more than saying it once. Its signer is judged in `attribution`, the binding in `acceptance`; whether the intent
//! itself is young enough, where its nonce was issued.

use minicbor::{Decode, Encode};

use crate::command::{Ack, Confirmation, IntentHash};
use crate::id::CommandId;
use crate::sign::{Purpose, Signed};

/// A message that is bound to one signed intent by id and hash.
pub trait Statement: Encode<()> + for<'b> Decode<'b, ()> {
    /// Purpose of its signature.
    const PURPOSE: Purpose;

    /// The command and the SHA-256 of its signed intent.
    fn subject(&self) -> (CommandId, IntentHash);
}

impl Statement for Confirmation {
    const PURPOSE: Purpose = Purpose::Confirmation;

    fn subject(&self) -> (CommandId, IntentHash) {
        (self.id, self.intent)
    }
}

impl Statement for Ack {
    const PURPOSE: Purpose = Purpose::Ack;

    fn subject(&self) -> (CommandId, IntentHash) {
        (self.id, self.intent)
    }
}

/// A statement with the signature that it came under.
#[derive(Debug)]
pub struct SignedStatement<'b, M> {
    pub(super) message: M,
    pub(super) signed: Signed<'b>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec;
    use crate::id::{Boot, NodeId, Sequence};
    use crate::policy::Policy;
    use crate::sign::{Key, Keyring};
    use crate::time::Instant;
    use crate::trust::Decoded;

    /// A confirmation also does not pass as an acknowledgement.
    #[test]
    fn confirmation_serves_one_intent_and_key() {
        let (key, policy) = (Key::from_bytes(&[9; 32]), Policy::default());
        let mut keys = Keyring::default();
        keys.insert(NodeId::OPERATOR, &key.public());
        keys.insert(NodeId::UNIT_A, &Key::from_bytes(&[8; 32]).public());
        let id = CommandId { operator: NodeId::OPERATOR, boot: Boot(1), sequence: Sequence(1) };
        let bytes = key.sign(Purpose::Confirmation, &codec::encode(&Confirmation { id, intent: [3; 32] }));
        let parse = || Decoded::<SignedStatement<'_, Confirmation>>::parse_statement(Instant(0), &bytes).unwrap();
        let signed_by = |signer| parse().by_signer(&policy, signer, &keys);
        assert!(signed_by(NodeId::OPERATOR).unwrap().about_intent(id, &[3; 32]).is_ok());
        assert!(signed_by(NodeId::OPERATOR).unwrap().about_intent(id, &[4; 32]).is_err());
        assert!(signed_by(NodeId::UNIT_A).is_err());
        assert!(Decoded::<SignedStatement<'_, Ack>>::parse_statement(Instant(0), &bytes).is_err());
    }
}
