//! The operator's signature: intents and confirmations, made of displayed values only.
//!
//! The operator's key is here and nowhere else. Each intent has its own id, so that it can be executed once at most,
//! and repeats the nonce that its unit last *showed*, so that the unit can tell how old it is; where it rests on a
//! track, also the hash of the report that showed it. Deciding when to give one is left to `operator`.

use std::collections::BTreeMap;

use sha2::{Digest, Sha256};
use wire::codec::{self, Text};
use wire::command::{CommandKind, Confirmation, Intent, IntentHash, ReportHash, TimeTag};
use wire::id::{Boot, CommandId, NodeId, Nonce, Sequence, UnitId};
use wire::sign::{Key, Purpose};

/// Values of the display that an intent repeats, so that its unit knows what the operator was shown, and when.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Basis {
    /// The unit's nonce.
    pub nonce: Nonce,
    /// The report, where the intent rests on a track in it.
    pub report: Option<ReportHash>,
}

/// The operator's pen.
#[derive(Clone, Debug)]
pub struct Issuer {
    key: Key,
    operator: NodeId,
    /// The last id given.
    last: (Boot, Sequence),
    /// Last command id of this operator that each unit reports, where it is beyond the issuer's own.
    heard: BTreeMap<UnitId, (Boot, Sequence)>,
}

/// A signed intent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Issued {
    /// Id of the command: by it a unit recognises repetitions.
    pub id: CommandId,
    /// Unit that the intent is for.
    pub unit: UnitId,
    /// Kind of the command.
    pub kind: CommandKind,
    /// Time of its execution; none: at once.
    pub tag: Option<TimeTag>,
    /// Hash by which all later messages name it.
    pub intent: IntentHash,
    /// COSE_Sign1 over the intent.
    pub bytes: Vec<u8>,
}

impl Issuer {
    /// An issuer for `operator`, with ids that count from 1 within `boot`.
    pub fn new(key: Key, operator: NodeId, boot: Boot) -> Self {
        Self { key, operator, last: (boot, Sequence(0)), heard: BTreeMap::new() }
    }

    /// `unit` reports `heard` as the last command it heard. An id of this operator beyond the issuer's own means that
    /// another holder of the key exists, or that the console has restarted. The next id for the unit is then above the
    /// reported one, because the unit refuses any below. Ids for other units do not change: one unit's report must not
    /// shut the operator out of another.
    pub fn skip_past(&mut self, unit: UnitId, heard: CommandId) {
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
    pub fn intent(
        &mut self,
        unit: UnitId,
        basis: Basis,
        (kind, tag): (CommandKind, Option<TimeTag>),
        reason: &str,
    ) -> Issued {
        let (boot, sequence) = self.given_to(unit);
        let next = (boot, sequence.next());
        match self.heard.get_mut(&unit).filter(|heard| **heard > self.last) {
            Some(heard) => *heard = next,
            None => self.last = next,
        }
        let id = CommandId { operator: self.operator, boot, sequence: next.1 };
        let Basis { nonce, report: shown } = basis;
        let intent = Intent { id, unit, nonce, kind, reason: Text::new(reason), tag, shown };
        let bytes = self.key.sign(Purpose::Intent, &codec::encode(&intent));
        Issued { id, unit, kind, tag, intent: Sha256::digest(&bytes).into(), bytes }
    }

    /// Signs the confirmation of an intent of this issuer.
    pub fn confirmation(&self, id: CommandId, intent: IntentHash) -> Vec<u8> {
        self.key.sign(Purpose::Confirmation, &codec::encode(&Confirmation { id, intent }))
    }
}
