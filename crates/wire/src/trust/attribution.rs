//! Attribution: the only way from fresh to attributed.
//!
//! Evidence, by what is attributed: a session record is its session peer's, by the handshake; a report is its
//! origin's, if the session's peer *is* the origin and the origin's signature verifies; a shared-memory message is its
//! producer's, by the channel's keyed tag; a command is its operator's, by signature and role.

use super::{Accepted, Attributed, BusMessage, Decoded, Evidence, Framed, Fresh, Ordered, Received, Record, stage};
use crate::bus::{self, ChannelKey};
use crate::command::Intent;
use crate::hop::Hop;
use crate::id::{NodeId, PeerId};
use crate::policy::{Check, Policy};
use crate::refusal::Refusal;
use crate::report::{MAX_REPORT, Report};
use crate::sign::{Keyring, Purpose, Signed};
use crate::time::Instant;

impl<'b> Fresh<Hop<'b>> {
    /// A session record is the session peer's: the handshake proved it, and nothing in the record claims otherwise.
    pub fn by_session(self) -> Attributed<Hop<'b>> {
        self.pass()
    }
}

/// A report with the signature that it came under.
#[derive(Debug)]
pub struct SignedReport<'b> {
    /// The report.
    pub report: Report,
    /// The signed bytes as they came, to be forwarded verbatim.
    pub bytes: &'b [u8],
    signed: Signed<'b>,
}

impl<'b> SignedReport<'b> {
    /// Length and schema of a signed report that was received at `at`.
    pub fn decode(at: Instant, bytes: &'b [u8]) -> Result<Decoded<SignedReport<'b>>, Refusal> {
        let framed: Framed<'b> = Received::new(at, bytes).frame(MAX_REPORT)?;
        let signed = Signed::parse(framed.message, MAX_REPORT)?;
        let report = crate::codec::decode::<Report>(signed.payload, MAX_REPORT)?;
        Ok(Record {
            message: SignedReport { report, bytes, signed },
            evidence: framed.evidence,
            stage: core::marker::PhantomData,
        })
    }
}

impl<'b> Decoded<SignedReport<'b>> {
    /// The stamp and claimed origin, for choosing how to bound its age; believed by nobody.
    pub fn claim(&self) -> (NodeId, crate::time::PeerStamp) {
        (self.message.report.origin, self.message.report.stamp)
    }

    /// The display's challenge that it repeats; of use to none but the one who issued that, and believed by nobody.
    pub fn watched(&self) -> Option<crate::time::Echo> {
        self.message.report.watched
    }
}

impl<'b> Fresh<SignedReport<'b>> {
    /// The report is `peer`'s own, and its origin signed it.
    pub fn by_origin(
        self,
        policy: &Policy,
        peer: PeerId,
        keys: &Keyring,
    ) -> Result<Attributed<SignedReport<'b>>, Refusal> {
        let bound: Fresh<SignedReport<'b>> = self.check(policy, Check::Origin, |m, _| {
            let origin = m.report.origin;
            if origin.name() == peer.name() { Ok(()) } else { Err(Refusal::Origin { peer, origin }) }
        })?;
        bound.by_signature(policy, keys)
    }

    /// The report's origin signed it, whoever carries it.
    pub fn by_signature(self, policy: &Policy, keys: &Keyring) -> Result<Attributed<SignedReport<'b>>, Refusal> {
        self.check(policy, Check::Signature, |m, _| keys.verify(m.report.origin, Purpose::Report, &m.signed))
    }
}

impl<'b, M> Fresh<BusMessage<'b, M>> {
    /// The message is `producer`'s, by one of its tags under the key that this reader shares with it.
    pub fn by_tag(
        self,
        policy: &Policy,
        producer: NodeId,
        key: &ChannelKey,
    ) -> Result<Attributed<BusMessage<'b, M>>, Refusal> {
        self.check(policy, Check::Tag, |m, _| {
            let ours = bus::tag(key, m.signed);
            let tagged = m.tags.chunks_exact(bus::TAG_LEN).any(|tag| tag == ours);
            let same = usize::from(m.header.producer) == producer.index() && tagged;
            if same { Ok(()) } else { Err(Refusal::Tag { expected: producer }) }
        })
    }
}

impl<'b, M> Ordered<BusMessage<'b, M>> {
    /// A message on a channel that belongs to its one producer.
    pub fn accept_body(self) -> Accepted<M> {
        Record { message: self.message.message, evidence: self.evidence, stage: core::marker::PhantomData }
    }
}

impl Fresh<Intent> {
    /// The identity that it names may give commands at all.
    pub fn by_role(self, policy: &Policy, operators: &[NodeId]) -> Result<Fresh<Intent>, Refusal> {
        self.check(policy, Check::Role, |intent, _| {
            let got = intent.id.operator;
            if operators.contains(&got) { Ok(()) } else { Err(Refusal::Role { got }) }
        })
    }

    /// The intent is that identity's, by its signature. The dearest check, and so the last before order is judged.
    pub fn by_operator(
        self,
        policy: &Policy,
        keys: &Keyring,
        signed: &Signed<'_>,
    ) -> Result<Attributed<Intent>, Refusal> {
        self.check(policy, Check::Signature, |intent, _| keys.verify(intent.id.operator, Purpose::Intent, signed))
    }
}

impl Decoded<Intent> {
    /// Parses a signed intent that was received at `at`. The signature is checked later, by `by_operator`.
    pub fn parse<'b>(at: Instant, bytes: &'b [u8], max: usize) -> Result<(Decoded<Intent>, Signed<'b>), Refusal> {
        let framed = Received::new(at, bytes).frame(max)?;
        let signed = Signed::parse(framed.message, max)?;
        let message = crate::codec::decode::<Intent>(signed.payload, max)?;
        let evidence: Evidence = framed.evidence;
        Ok((Record { message, evidence, stage: core::marker::PhantomData::<stage::Decoded> }, signed))
    }

    /// The intent's claims, before anything about it is believed: for judging its age and for refusing it by name.
    pub fn claim(&self) -> &Intent {
        &self.message
    }
}
