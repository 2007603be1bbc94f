//! The operator's signature: intents and confirmations, made of displayed values only.
//!
//! The operator's key is here and nowhere else. Each intent has an id of its own, so that it can be executed once at
//! most, and repeats the nonce that its unit last *showed*, so that the unit can tell how old it is. Deciding when to
//! give one is left to `operator`.

use sha2::{Digest, Sha256};
use wire::codec::{self, Text};
use wire::command::{CommandKind, Confirmation, Intent};
use wire::id::{Boot, CommandId, NodeId, Nonce, Sequence, UnitId};
use wire::sign::{Key, Purpose};

use crate::model::ShownUnit;

/// The operator's pen.
#[derive(Debug)]
pub struct Issuer {
    key: Key,
    operator: NodeId,
    boot: Boot,
    sequence: Sequence,
}

/// A signed intent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Issued {
    /// Its idempotency key.
    pub id: CommandId,
    /// Addressee.
    pub unit: UnitId,
    /// What is asked.
    pub kind: CommandKind,
    /// SHA-256 of the signed bytes.
    pub hash: [u8; 32],
    /// COSE_Sign1 over the intent.
    pub bytes: Vec<u8>,
}

impl Issuer {
    /// A pen for `operator`, whose ids count from 1 within `boot`.
    pub fn new(key: Key, operator: NodeId, boot: Boot) -> Self {
        Self { key, operator, boot, sequence: Sequence(0) }
    }

    /// The same pen in a forked world.
    #[must_use]
    pub fn fork(&self) -> Self {
        Self { key: self.key.fork(), operator: self.operator, boot: self.boot, sequence: self.sequence }
    }

    /// A unit says that this was the last command it heard. If it is of our name and beyond what we gave, somebody else
    /// holds our key, or we have started anew: we go on above it, because below it nothing of ours would be heard.
    pub fn after(&mut self, heard: CommandId) {
        if heard.operator == self.operator && (heard.boot, heard.sequence) > (self.boot, self.sequence) {
            (self.boot, self.sequence) = (heard.boot, heard.sequence);
        }
    }

    /// Signs an intent under the next id.
    pub fn intent(&mut self, unit: UnitId, nonce: Nonce, kind: CommandKind, reason: &str) -> Issued {
        self.sequence = self.sequence.next();
        let id = CommandId { operator: self.operator, boot: self.boot, sequence: self.sequence };
        let intent = Intent { id, unit, nonce, kind, reason: Text::new(reason) };
        let bytes = self.key.sign(Purpose::Intent, &codec::encode(&intent));
        Issued { id, unit, kind, hash: Sha256::digest(&bytes).into(), bytes }
    }

    /// Signs the confirmation of an intent of ours.
    pub fn confirmation(&self, id: CommandId, intent: [u8; 32]) -> Vec<u8> {
        self.key.sign(Purpose::Confirmation, &codec::encode(&Confirmation { id, intent }))
    }
}

/// The nonce that an intent of this kind may repeat. Away from safe only one that is displayed as fresh. Towards safe
/// any, even none: a HOLD is never kept back because the display is stale, for the gateway withholds the lease even if
/// the unit finds the nonce too old.
pub fn nonce_for(kind: CommandKind, shown: Option<&ShownUnit>) -> Option<Nonce> {
    if kind.towards_safe() {
        return Some(shown.map(|unit| unit.state.get().0.nonce).unwrap_or_default());
    }
    shown?.state.fresh().map(|state| state.nonce)
}
