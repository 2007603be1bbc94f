//! Attribution: the only way from fresh to attributed, and the only place where a session's peer and a record's origin
//! meet.
//!
//! Evidence, by subject: a session record is its session peer's, by the handshake; a report is its
//! origin's, if the session's peer *is* the origin and the origin's signature verifies; a shared-memory message is its
//! producer's, by the channel's keyed tag; a command is its operator's, by signature, once `intent` has no objection; a
//! statement is its signer's.

use core::marker::PhantomData;

use super::intent::Screened;
use super::{BusMessage, Decoded, Evidence, Fresh, Record, SignedReport, SignedStatement, Statement};
use crate::bus::{self, ChannelKey};
use crate::command::Intent;
use crate::id::{NodeId, PeerId, RecordId, UnitId};
use crate::policy::{Check, DisplayPolicy, Policy};
use crate::refusal::Refusal;
use crate::session::SessionMessage;
use crate::sign::{Keyring, Purpose, Signed};
use crate::time::{Age, AgeBound};

/// Attributed: its maker is known. Of an intent, `S` is the stage before.
#[derive(Debug)]
pub struct Attributed<S = ()>(PhantomData<S>);

impl<S> Attributed<S> {
    fn earned() -> Self {
        Attributed(PhantomData)
    }
}

/// The unit of `peer`'s certificate, if it is a unit's.
pub fn unit_of(peer: PeerId) -> Option<UnitId> {
    node_of(peer).unit()
}

/// The node of the same name, which is the identity that a session proves.
fn node_of(peer: PeerId) -> NodeId {
    NodeId::numbered(peer.number())
}

/// Relation of the session peer that brought a report to its origin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bearer {
    /// The origin itself.
    Origin,
    /// Another peer than the origin.
    Other(PeerId),
}

impl SignedReport<'_> {
    /// Relation of `peer`, which brought the report, to the report's origin.
    pub fn bearer(&self, peer: PeerId) -> Bearer {
        if node_of(peer) == self.report.origin { Bearer::Origin } else { Bearer::Other(peer) }
    }
}

impl Decoded<SignedReport<'_>> {
    /// Bound of the report's age. A report that claims to be of `peer` is judged by its own stamp, if `ages` has bound
    /// that clock. Any other is as old as the record that `carried` it, which leaves out the time for which the peer
    /// had held it. Only a unit reports.
    pub fn age(&self, peer: PeerId, ages: &AgeBound, carried: Evidence) -> Result<Option<Age>, Refusal> {
        let (origin, stamp) = self.claim();
        if origin.unit().is_none() {
            return Err(Refusal::Role { got: origin });
        }
        let is_own = self.message.bearer(peer) == Bearer::Origin;
        Ok(if is_own { ages.age(stamp, carried.received) } else { carried.age })
    }
}

/// A session record with the node that it is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SessionRecord<'b> {
    /// Content of the record.
    pub outer: SessionMessage<'b>,
    origin: NodeId,
}

impl SessionRecord<'_> {
    /// Identity of the record.
    pub fn id(&self) -> RecordId {
        RecordId { node: self.origin, boot: self.outer.boot, sequence: self.outer.sequence }
    }
}

impl<'b> Fresh<SessionMessage<'b>> {
    /// A session record is the session peer's: the handshake proved it, and the record claims no other.
    pub fn by_session(self, peer: PeerId) -> Record<Attributed, SessionRecord<'b>> {
        self.next(Attributed::earned()).map(|outer| SessionRecord { outer, origin: node_of(peer) })
    }
}

impl<'b> Fresh<SignedReport<'b>> {
    /// The report is `peer`'s own, and its origin signed it.
    pub fn by_origin(
        self,
        policy: &Policy,
        peer: PeerId,
        keys: &Keyring,
    ) -> Result<Record<Attributed, SignedReport<'b>>, Refusal> {
        let bound = self.judged(policy, Check::Origin, |m, _| match m.bearer(peer) {
            Bearer::Origin => Ok(()),
            Bearer::Other(peer) => Err(Refusal::Origin { peer, origin: m.report.origin }),
        })?;
        bound.signed(policy, keys)
    }

    /// The report's origin signed it, over any carrier: for a display, which has no session with it.
    pub fn by_signature(
        self,
        policy: &DisplayPolicy,
        keys: &Keyring,
    ) -> Result<Record<Attributed, SignedReport<'b>>, Refusal> {
        self.signed(policy.checks(), keys)
    }

    fn signed(self, policy: &Policy, keys: &Keyring) -> Result<Record<Attributed, SignedReport<'b>>, Refusal> {
        self.check(policy, Check::Signature, Attributed::earned(), |m, _| {
            keys.verify(m.report.origin, Purpose::Report, &m.signed)
        })
    }
}

impl<'b, M> Fresh<BusMessage<'b, M>> {
    /// The message is `producer`'s, by one of its tags under the key that this reader shares with it.
    pub fn by_tag(
        self,
        policy: &Policy,
        producer: NodeId,
        key: &ChannelKey,
    ) -> Result<Record<Attributed, BusMessage<'b, M>>, Refusal> {
        self.check(policy, Check::Tag, Attributed::earned(), |m, _| {
            let tagged = bus::has_tag(m.tags, &bus::tag(key, m.signed));
            let same = usize::from(m.header.producer) == producer.index() && tagged;
            if same { Ok(()) } else { Err(Refusal::Tag { expected: producer }) }
        })
    }
}

impl<S: Screened> Record<S, Intent> {
    /// The intent is that of the operator that it names, by its signature. The dearest check, and so the last before
    /// order is judged.
    pub fn by_operator(
        self,
        policy: &Policy,
        keys: &Keyring,
        signed: &Signed<'_>,
    ) -> Result<Record<Attributed<S>, Intent>, Refusal> {
        self.check(policy, Check::Signature, Attributed::earned(), |intent, _| {
            keys.verify(intent.id.operator, Purpose::Intent, signed)
        })
    }
}

impl<'b, M: Statement> Decoded<SignedStatement<'b, M>> {
    /// The statement is `signer`'s, by its signature.
    pub fn by_signer(self, policy: &Policy, signer: NodeId, keys: &Keyring) -> Result<Record<Attributed, M>, Refusal> {
        let signed = self
            .check(policy, Check::Signature, Attributed::earned(), |m, _| keys.verify(signer, M::PURPOSE, &m.signed))?;
        Ok(signed.map(|statement| statement.message))
    }
}
