//! Schema: the only way from received bytes to a decoded message. Neither length nor schema can be waived.
//!
//! Parts of a decoded message that may be read before acceptance are here too: an [`Exchange`], and claims, which serve
//! to choose the check of a message and are untrusted.

use minicbor::{Decode, Encode};

use super::{Evidence, Record, SignedStatement, Statement};
use crate::bus;
use crate::codec;
use crate::command::{Intent, IntentHash, MAX_ORDER};
use crate::core::Topic;
use crate::id::{CommandId, NodeId, Nonce};
use crate::policy::Waived;
use crate::refusal::Refusal;
use crate::report::{MAX_REPORT, Report};
use crate::session::{SESSION_VERSION, SessionBody, SessionMessage};
use crate::sign::Signed;
use crate::time::{Echo, Instant, PeerStamp};

/// Bytes of a length within bounds.
#[derive(Debug)]
pub struct Framed(());
/// A message of the expected type, canonical and in range.
#[derive(Debug)]
pub struct Decoded(());

/// Bytes as they arrived.
#[derive(Clone, Copy, Debug)]
pub struct Received<'a> {
    at: Instant,
    bytes: &'a [u8],
}

impl<'a> Received<'a> {
    /// Anyone may receive anything.
    pub fn new(at: Instant, bytes: &'a [u8]) -> Self {
        Self { at, bytes }
    }

    /// Length: at most `max` bytes. Cannot be waived.
    pub fn frame(self, max: usize) -> Result<Record<Framed, &'a [u8]>, Refusal> {
        if self.bytes.len() > max {
            return Err(Refusal::Length { max, got: self.bytes.len() });
        }
        let evidence = Evidence { received: self.at, age: None, waived: Waived::default() };
        Ok(Record { message: self.bytes, evidence, stage: Framed(()) })
    }
}

impl<'a> Record<Framed, &'a [u8]> {
    /// Schema: one canonical `M` and no further bytes. Cannot be waived.
    pub fn decode<M: Decode<'a, ()> + Encode<()>>(self) -> Result<Record<Decoded, M>, Refusal> {
        let message = codec::decode(self.message, self.message.len())?;
        Ok(self.holds(message))
    }

    /// Schema of the session layer, with its version.
    pub fn decode_session_message(self) -> Result<Record<Decoded, SessionMessage<'a>>, Refusal> {
        let outer = self.decode::<SessionMessage<'a>>()?;
        if outer.message.version != SESSION_VERSION {
            return Err(Refusal::Version { expected: SESSION_VERSION, got: outer.message.version });
        }
        Ok(outer)
    }

    /// Schema of a shared-memory message on `topic`: header, body of type `M`, tags (kept for attribution).
    pub fn decode_bus<M: Decode<'a, ()>>(self, topic: Topic) -> Result<Record<Decoded, BusMessage<'a, M>>, Refusal> {
        let bus::Parts { header, signed, body, tags } = bus::split(self.message).ok_or(Refusal::Schema { at: 0 })?;
        if header.topic != topic {
            return Err(Refusal::Schema { at: 0 });
        }
        let mut decoder = minicbor::Decoder::new(body);
        let message = decoder.decode().map_err(|_| Refusal::Schema { at: bus::HEADER_LEN + decoder.position() })?;
        if decoder.position() != body.len() {
            return Err(Refusal::Canonical { at: bus::HEADER_LEN + decoder.position() });
        }
        Ok(self.holds(BusMessage { header, message, signed, tags }))
    }

    /// Schema of a signed `P`, with its signature, not yet checked.
    fn decode_signed<P: Decode<'a, ()> + Encode<()>>(&self, max: usize) -> Result<(P, Signed<'a>), Refusal> {
        let signed = Signed::parse(self.message, max)?;
        Ok((codec::decode::<P>(signed.payload, max)?, signed))
    }

    fn holds<M>(self, message: M) -> Record<Decoded, M> {
        Record { message, evidence: self.evidence, stage: Decoded(()) }
    }
}

/// A decoded shared-memory message with the parts that its attribution needs.
#[derive(Debug)]
pub struct BusMessage<'a, M> {
    pub(super) header: bus::Header,
    pub(super) message: M,
    pub(super) signed: &'a [u8],
    pub(super) tags: &'a [u8],
}

/// The exchange is the one part read from a record that has only been decoded. It can do no harm beyond silence: a
/// challenge or nonce only changes the records to that same peer, and an echo counts only if it repeats an unguessable
/// number that this host issued to the peer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Exchange {
    /// The peer's challenge, to be echoed.
    pub challenge: Nonce,
    /// The peer's echo of a challenge of this host.
    pub echo: Option<Echo>,
    /// The session nonce that the peer wants to see.
    pub hello: Option<Nonce>,
}

impl Record<Decoded, SessionMessage<'_>> {
    /// See [`Exchange`].
    pub fn exchange(&self) -> Exchange {
        let outer = &self.message;
        let hello = match outer.body {
            SessionBody::Hello(nonce) => Some(nonce),
            SessionBody::Report(_)
            | SessionBody::Grant(_)
            | SessionBody::Teammate(_)
            | SessionBody::Watch(_)
            | SessionBody::Crop(_)
            | SessionBody::Revoked(_) => None,
        };
        Exchange { challenge: outer.challenge, echo: outer.echo, hello }
    }
}

/// A report with the signature that it came under.
#[derive(Debug)]
pub struct SignedReport<'b> {
    /// Content of the report.
    pub report: Report,
    /// The signed bytes as they came, to be forwarded verbatim.
    pub bytes: &'b [u8],
    pub(super) signed: Signed<'b>,
}

impl<'b> SignedReport<'b> {
    /// Length and schema of a signed report that was received at `time`.
    pub fn decode(time: Instant, bytes: &'b [u8]) -> Result<Record<Decoded, SignedReport<'b>>, Refusal> {
        let framed = Received::new(time, bytes).frame(MAX_REPORT)?;
        let (report, signed) = framed.decode_signed::<Report>(MAX_REPORT)?;
        Ok(framed.holds(SignedReport { report, bytes, signed }))
    }
}

impl<'b> Record<Decoded, SignedReport<'b>> {
    /// The stamp and claimed origin, for choosing the bound of its age; untrusted.
    pub fn claim(&self) -> (NodeId, PeerStamp) {
        (self.message.report.origin, self.message.report.stamp)
    }

    /// The display's challenge that it repeats; of use only to its issuer, and untrusted.
    pub fn watched(&self) -> Option<Echo> {
        self.message.report.watched
    }
}

impl Record<Decoded, Intent> {
    /// Parses a signed intent that was received at `time`. The signature is checked later, by `by_operator`.
    pub fn parse<'b>(time: Instant, bytes: &'b [u8], max: usize) -> Result<(Self, Signed<'b>), Refusal> {
        let framed = Received::new(time, bytes).frame(max)?;
        let (intent, signed) = framed.decode_signed::<Intent>(max)?;
        Ok((framed.holds(intent), signed))
    }

    /// The intent's claims, before anything about it is believed: for judging its age and for refusing it by name.
    pub fn claim(&self) -> &Intent {
        &self.message
    }
}

impl<'b, M: Statement> Record<Decoded, SignedStatement<'b, M>> {
    /// Length and schema of a signed statement that was received at `time`.
    pub fn parse_statement(time: Instant, bytes: &'b [u8]) -> Result<Self, Refusal> {
        let framed = Received::new(time, bytes).frame(MAX_ORDER)?;
        let (message, signed) = framed.decode_signed::<M>(MAX_ORDER)?;
        Ok(framed.holds(SignedStatement { message, signed }))
    }

    /// The command and the signed intent that it claims to be about, for finding them; untrusted.
    pub fn claimed(&self) -> (CommandId, IntentHash) {
        self.message.message.subject()
    }
}
