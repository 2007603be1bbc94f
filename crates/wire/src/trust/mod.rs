//! The trust boundary as types.
//!
//! `Received → Framed → Decoded → Fresh → Attributed → Ordered → Accepted`
//!
//! Each check is the only way to the next stage. A stage is a type whose constructor is private to this module; none
//! of them serialises, because what crosses a process is untrusted again on arrival. A check either gives the next
//! stage or one [`Refusal`]. A waived check gives the stage by waiver and the record carries that from then on.
//!
//! What the stages prove, and on what evidence, is told in the file of each check: `freshness`, `attribution`,
//! `ordering`, and for commands `orders`, `rate` and `standing`. Deciding what to do with an accepted record is left to the services.

mod attribution;
mod freshness;
mod ordering;
mod orders;
pub mod rate;
mod standing;
mod statement;

use minicbor::{Decode, Encode};

use crate::bus;
use crate::codec;
use crate::core::Topic;
use crate::hop::{HOP_VERSION, Hop, HopBody, MAX_HOP};
use crate::id::{NodeId, Nonce, PeerId};
use crate::policy::{Check, Policy, Requirement, Waived};
use crate::refusal::Refusal;
use crate::sensor::ProductMode;
use crate::time::{Age, Echo, Instant, Span};

pub use ordering::{Window, Windows};
pub use orders::Counters;
pub use rate::Rates;
pub use standing::{Mandate, Revocation, Roll};

/// The stages, as types.
pub mod stage {
    /// Length is within bounds.
    #[derive(Clone, Copy, Debug)]
    pub enum Framed {}
    /// It is a message of the expected type, canonical and in range.
    #[derive(Clone, Copy, Debug)]
    pub enum Decoded {}
    /// Its age is bounded and within the limit.
    #[derive(Clone, Copy, Debug)]
    pub enum Fresh {}
    /// Who made it is known.
    #[derive(Clone, Copy, Debug)]
    pub enum Attributed {}
    /// It is of this session and boot and was not seen before.
    #[derive(Clone, Copy, Debug)]
    pub enum Ordered {}
    /// It may influence state.
    #[derive(Clone, Copy, Debug)]
    pub enum Accepted {}
}

/// A record on its way through the boundary: at `stage::S`, with message `M`.
#[derive(Debug)]
pub struct Record<S, M> {
    message: M,
    evidence: Evidence,
    stage: core::marker::PhantomData<S>,
}

/// What has been established about a record so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Evidence {
    /// When it was received, on this host's clock.
    pub received: Instant,
    /// Upper bound of its age at reception, once freshness was judged.
    pub age: Option<Age>,
    /// Checks that were passed over.
    pub waived: Waived,
}

/// Bytes as they arrived.
#[derive(Clone, Copy, Debug)]
pub struct Received<'a> {
    at: Instant,
    bytes: &'a [u8],
}

/// Length is within bounds.
pub type Framed<'a> = Record<stage::Framed, &'a [u8]>;
/// It is a message of the expected type.
pub type Decoded<M> = Record<stage::Decoded, M>;
/// Its age is bounded.
pub type Fresh<M> = Record<stage::Fresh, M>;
/// Who made it is known.
pub type Attributed<M> = Record<stage::Attributed, M>;
/// It is in order.
pub type Ordered<M> = Record<stage::Ordered, M>;
/// It may influence state.
pub type Accepted<M> = Record<stage::Accepted, M>;

impl<'a> Received<'a> {
    /// Anyone may receive anything.
    pub fn new(at: Instant, bytes: &'a [u8]) -> Self {
        Self { at, bytes }
    }

    /// Length: at most `max` bytes. Cannot be waived.
    pub fn frame(self, max: usize) -> Result<Framed<'a>, Refusal> {
        if self.bytes.len() > max {
            return Err(Refusal::Length { max, got: self.bytes.len() });
        }
        let evidence = Evidence { received: self.at, age: None, waived: Waived::default() };
        Ok(Record { message: self.bytes, evidence, stage: core::marker::PhantomData })
    }
}

impl<'a> Framed<'a> {
    /// Schema: one canonical `M`, nothing else. Cannot be waived.
    pub fn decode<M: Decode<'a, ()> + Encode<()>>(self) -> Result<Decoded<M>, Refusal> {
        let message = codec::decode(self.message, self.message.len())?;
        Ok(Record { message, evidence: self.evidence, stage: core::marker::PhantomData })
    }

    /// Schema of the session layer, with its version.
    pub fn decode_hop(self) -> Result<Decoded<Hop<'a>>, Refusal> {
        let hop = self.decode::<Hop<'a>>()?;
        if hop.message.version != HOP_VERSION {
            return Err(Refusal::Version { expected: HOP_VERSION, got: hop.message.version });
        }
        Ok(hop)
    }

    /// Schema of a shared-memory message on `topic`: header, body of type `M`, tags (kept for attribution).
    pub fn decode_bus<M: Decode<'a, ()>>(self, topic: Topic) -> Result<Decoded<BusMessage<'a, M>>, Refusal> {
        let bus::Parts { header, signed, body, tags } = bus::split(self.message).ok_or(Refusal::Schema { at: 0 })?;
        if header.topic != topic {
            return Err(Refusal::Schema { at: 0 });
        }
        let mut decoder = minicbor::Decoder::new(body);
        let message = decoder.decode().map_err(|_| Refusal::Schema { at: bus::HEADER_LEN + decoder.position() })?;
        if decoder.position() != body.len() {
            return Err(Refusal::Canonical { at: bus::HEADER_LEN + decoder.position() });
        }
        let message = BusMessage { header, message, signed, tags };
        Ok(Record { message, evidence: self.evidence, stage: core::marker::PhantomData })
    }
}

/// A decoded shared-memory message with what its attribution needs.
#[derive(Debug)]
pub struct BusMessage<'a, M> {
    pub(crate) header: bus::Header,
    pub(crate) message: M,
    signed: &'a [u8],
    tags: &'a [u8],
}

/// What the session layer exchanges before any of its records can be accepted: challenges, echoes, session nonces.
///
/// This is the one thing read from a record that has only been decoded. It can do no harm beyond silence: a challenge
/// or nonce only changes what *we* write to that same peer, and an echo counts only if it repeats an unguessable
/// number that we issued to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Exchange {
    /// The peer's challenge, to be echoed.
    pub challenge: Nonce,
    /// The peer's echo of ours.
    pub echo: Option<Echo>,
    /// The session nonce that the peer wants to see.
    pub hello: Option<Nonce>,
}

impl Decoded<Hop<'_>> {
    /// See [`Exchange`].
    pub fn exchange(&self) -> Exchange {
        let hop = &self.message;
        let hello = match hop.body {
            HopBody::Hello(nonce) => Some(nonce),
            HopBody::Report(_) | HopBody::Grant(_) | HopBody::Teammate(_) | HopBody::Watch(_) | HopBody::Revoked(_) => {
                None
            }
        };
        Exchange { challenge: hop.challenge, echo: hop.echo, hello }
    }
}

impl<S, M> Record<S, M> {
    /// What has been established so far.
    pub fn evidence(&self) -> Evidence {
        self.evidence
    }

    fn pass<T>(self) -> Record<T, M> {
        Record { message: self.message, evidence: self.evidence, stage: core::marker::PhantomData }
    }

    /// The next stage if `check` is waived or `judge` finds nothing against it.
    fn check<T>(
        mut self,
        policy: &Policy,
        check: Check,
        judge: impl FnOnce(&M, &Evidence) -> Result<(), Refusal>,
    ) -> Result<Record<T, M>, Refusal> {
        match policy.check(check) {
            Requirement::Required => judge(&self.message, &self.evidence)?,
            Requirement::Waived => self.evidence.waived = self.evidence.waived.with(check),
        }
        Ok(self.pass())
    }
}

impl<'b, M> Attributed<BusMessage<'b, M>> {
    /// Provenance: only a live product may influence a live platform.
    fn live(self, policy: &Policy, product: impl FnOnce(&M) -> ProductMode) -> Result<Self, Refusal> {
        self.check(policy, Check::Product, |bus, _| match product(&bus.message) {
            ProductMode::Live => Ok(()),
            got @ (ProductMode::Synthetic | ProductMode::Replay) => Err(Refusal::Product { got }),
        })
    }
}

impl<M> Ordered<M> {
    /// Provenance: only a live product may influence a live platform.
    pub fn accept(self, policy: &Policy, product: impl FnOnce(&M) -> ProductMode) -> Result<Accepted<M>, Refusal> {
        self.check(policy, Check::Product, |message, _| match product(message) {
            ProductMode::Live => Ok(()),
            got @ (ProductMode::Synthetic | ProductMode::Replay) => Err(Refusal::Product { got }),
        })
    }

    /// For messages that are no sensor product.
    pub fn accept_message(self) -> Accepted<M> {
        self.pass()
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

/// The whole way of a session record: the order in which the checks stand is the order in which they are read here.
pub struct SessionGate<'a> {
    /// Policy in force.
    pub policy: &'a Policy,
    /// The peer that the session authenticated.
    pub peer: PeerId,
    /// Ages of this peer's records.
    pub ages: &'a mut crate::time::AgeBound,
    /// The session nonce that we announced to this peer.
    pub session: Nonce,
    /// Records of this session seen so far.
    pub window: &'a mut Window,
    /// *Tf*.
    pub freshness: Span,
    /// How long an echo may serve.
    pub echo_limit: Span,
}

impl SessionGate<'_> {
    /// Decodes and gives the exchange to the caller, then judges freshness, session and sequence.
    pub fn admit<'b>(
        &mut self,
        now: Instant,
        bytes: &'b [u8],
    ) -> (Option<Exchange>, Result<Accepted<Hop<'b>>, Refusal>) {
        let decoded = match Received::new(now, bytes).frame(MAX_HOP).and_then(Framed::decode_hop) {
            Ok(decoded) => decoded,
            Err(refusal) => return (None, Err(refusal)),
        };
        let exchange = decoded.exchange();
        if let Some(echo) = exchange.echo {
            self.ages.prove(echo);
        }
        (Some(exchange), self.judge(now, decoded))
    }

    fn judge<'b>(&mut self, now: Instant, decoded: Decoded<Hop<'b>>) -> Result<Accepted<Hop<'b>>, Refusal> {
        let age = self.ages.age(decoded.message.stamp, now);
        let fresh = decoded.fresh(self.policy, age, self.freshness, self.echo_limit)?;
        let attributed = fresh.by_session();
        let ordered = attributed.in_session(self.policy, self.session, self.window)?;
        Ok(ordered.accept_message())
    }
}

/// The whole way of a shared-memory message from `producer`.
#[derive(Debug)]
pub struct BusGate {
    /// Channel.
    pub topic: Topic,
    /// Who alone may write it.
    pub producer: NodeId,
    /// Its key.
    pub key: bus::ChannelKey,
    /// Messages seen so far.
    pub window: Window,
    /// The oldest a message may be.
    pub freshness: Span,
}

impl BusGate {
    /// A gate on `topic` from `producer`; `freshness` bounds the age by this host's clock.
    pub fn new(topic: Topic, producer: NodeId, key: bus::ChannelKey, freshness: Span) -> Self {
        Self { topic, producer, key, window: Window::new(0, u64::MAX), freshness }
    }

    /// Judges length, schema, freshness, tag and order.
    pub fn admit<'b, M: Decode<'b, ()>>(
        &mut self,
        policy: &Policy,
        now: Instant,
        bytes: &'b [u8],
    ) -> Result<Accepted<M>, Refusal> {
        let attributed = self.attribute(policy, now, bytes)?;
        Ok(attributed.on_channel(policy, &mut self.window)?.accept_body())
    }

    /// The same for a sensor product, which also has to be a live one. That is judged before the order is, so that one which
    /// is not leaves nothing behind in the window.
    pub fn admit_product<'b, M: Decode<'b, ()>>(
        &mut self,
        policy: &Policy,
        now: Instant,
        bytes: &'b [u8],
        product: impl FnOnce(&M) -> ProductMode,
    ) -> Result<Accepted<M>, Refusal> {
        let live = self.attribute(policy, now, bytes)?.live(policy, product)?;
        Ok(live.on_channel(policy, &mut self.window)?.accept_body())
    }

    fn attribute<'b, M: Decode<'b, ()>>(
        &self,
        policy: &Policy,
        now: Instant,
        bytes: &'b [u8],
    ) -> Result<Attributed<BusMessage<'b, M>>, Refusal> {
        let max = self.topic.max_len() + bus::HEADER_LEN + self.topic.readers() * bus::TAG_LEN;
        let decoded = Received::new(now, bytes).frame(max)?.decode_bus::<M>(self.topic)?;
        let age = Age::on_one_host(decoded.message.header.stamp, now);
        let fresh = decoded.fresh(policy, Some(age), self.freshness, Span::ZERO)?;
        fresh.by_tag(policy, self.producer, &self.key)
    }
}

impl Clone for BusGate {
    fn clone(&self) -> Self {
        Self {
            topic: self.topic,
            producer: self.producer,
            key: self.key.clone(),
            window: self.window.clone(),
            freshness: self.freshness,
        }
    }
}

pub use attribution::SignedReport;
pub use statement::{SignedStatement, Statement};
