//! The operator's signature: intents and confirmations, made of displayed values only.
//!
//! The operator's key is here and nowhere else. Each intent has an id of its own, so that it can be executed once at
//! most, and repeats the nonce that its unit last *showed*, so that the unit can tell how old it is. Deciding when to
//! give one is left to `operator`.

use std::collections::BTreeMap;

use sha2::{Digest, Sha256};
use wire::codec::{self, Text};
use wire::command::{CommandKind, Confirmation, Intent, IntentHash};
use wire::id::{Boot, CommandId, NodeId, Nonce, Sequence, UnitId};
use wire::sign::{Key, Purpose};

use crate::shown::ShownUnit;

/// The operator's pen.
#[derive(Debug)]
pub struct Issuer {
    key: Key,
    operator: NodeId,
    /// The last id given.
    last: (Boot, Sequence),
    /// What each unit says that it heard last of our name, where that is beyond what we gave it.
    heard: BTreeMap<UnitId, (Boot, Sequence)>,
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
    /// What everything about it names.
    pub intent: IntentHash,
    /// COSE_Sign1 over the intent.
    pub bytes: Vec<u8>,
}

impl Issuer {
    /// A pen for `operator`, whose ids count from 1 within `boot`.
    pub fn new(key: Key, operator: NodeId, boot: Boot) -> Self {
        Self { key, operator, last: (boot, Sequence(0)), heard: BTreeMap::new() }
    }

    /// The same pen in a forked world.
    #[must_use]
    pub fn fork(&self) -> Self {
        Self { key: self.key.fork(), operator: self.operator, last: self.last, heard: self.heard.clone() }
    }

    /// `unit` says that this was the last command it heard. If it is of our name and beyond what we gave it, somebody else
    /// holds our key, or we have started anew: we go on above it, because below it nothing of ours would be heard. For this
    /// unit alone: what one unit says must not shut the operator out of another.
    pub fn after(&mut self, unit: UnitId, heard: CommandId) {
        let place = (heard.boot, heard.sequence);
        if heard.operator == self.operator && place > self.given_to(unit) {
            self.heard.insert(unit, place);
        }
    }

    /// The id above which the next one for `unit` is.
    fn given_to(&self, unit: UnitId) -> (Boot, Sequence) {
        self.heard.get(&unit).map_or(self.last, |heard| self.last.max(*heard))
    }

    /// Signs an intent under the next id.
    pub fn intent(&mut self, unit: UnitId, nonce: Nonce, kind: CommandKind, reason: &str) -> Issued {
        let (boot, sequence) = self.given_to(unit);
        let next = (boot, sequence.next());
        match self.heard.get_mut(&unit).filter(|heard| **heard > self.last) {
            Some(heard) => *heard = next,
            None => self.last = next,
        }
        let id = CommandId { operator: self.operator, boot, sequence: next.1 };
        let intent = Intent { id, unit, nonce, kind, reason: Text::new(reason) };
        let bytes = self.key.sign(Purpose::Intent, &codec::encode(&intent));
        Issued { id, unit, kind, intent: Sha256::digest(&bytes).into(), bytes }
    }

    /// Signs the confirmation of an intent of ours.
    pub fn confirmation(&self, id: CommandId, intent: IntentHash) -> Vec<u8> {
        self.key.sign(Purpose::Confirmation, &codec::encode(&Confirmation { id, intent }))
    }
}

/// The nonce that an intent of this kind may repeat. Away from safe only one that is displayed as fresh. Towards safe
/// any, even none: a HOLD is never kept back because the display is stale, for the gateway withholds the lease even if
/// the unit finds the nonce too old.
pub fn nonce_for(kind: CommandKind, shown: Option<&ShownUnit>) -> Option<Nonce> {
    if kind.towards_safe() {
        return Some(shown.map_or(Nonce::NONE, |unit| unit.state.get().0.nonce));
    }
    shown?.state.fresh().map(|state| state.nonce)
}
