//! The whole ways of a session record and of a shared-memory message: the order in which the checks stand is the order
//! in which they are read here.

use minicbor::Decode;

use super::schema::Framed;
use super::{Accepted, Attributed, BusMessage, Decoded, Exchange, Provenance, Received, Record, SessionRecord, Window};
use crate::bus;
use crate::core::Topic;
use crate::id::{NodeId, Nonce, PeerId};
use crate::policy::Policy;
use crate::refusal::Refusal;
use crate::session::{MAX_SESSION_MESSAGE, SessionMessage};
use crate::time::{Age, AgeBound, Instant, Span};

/// The whole way of a session record.
pub struct SessionGate<'a> {
    /// Policy in force.
    pub policy: &'a Policy,
    /// The peer that the session authenticated.
    pub peer: PeerId,
    /// Ages of this peer's records.
    pub ages: &'a mut AgeBound,
    /// The session nonce that the receiver announced to this peer.
    pub session: Nonce,
    /// Records of this session seen so far.
    pub window: &'a mut Window,
    /// Largest age of an accepted record, *Tf*.
    pub freshness: Span,
    /// Longest time that an echo may serve, from the issue of its nonce.
    pub echo_limit: Span,
}

impl SessionGate<'_> {
    /// Decodes and gives the exchange to the caller, then judges freshness, session and sequence.
    pub fn admit<'b>(
        &mut self,
        now: Instant,
        bytes: &'b [u8],
    ) -> (Option<Exchange>, Result<Accepted<SessionRecord<'b>>, Refusal>) {
        let decoded = match Received::new(now, bytes)
            .frame(MAX_SESSION_MESSAGE)
            .and_then(Record::<Framed, _>::decode_session_message)
        {
            Ok(decoded) => decoded,
            Err(refusal) => return (None, Err(refusal)),
        };
        // Taken before any verdict: session nonces and echoes are what later records are judged by, and the first ones
        // pass no check yet.
        let exchange = decoded.exchange();
        if let Some(echo) = exchange.echo {
            self.ages.prove(echo);
        }
        (Some(exchange), self.judge(now, decoded))
    }

    fn judge<'b>(
        &mut self,
        now: Instant,
        decoded: Decoded<SessionMessage<'b>>,
    ) -> Result<Accepted<SessionRecord<'b>>, Refusal> {
        let age = self.ages.age(decoded.message.stamp, now);
        let fresh = decoded.fresh(self.policy, age, self.freshness, self.echo_limit)?;
        let attributed = fresh.by_session(self.peer);
        let ordered = attributed.in_session(self.policy, self.session, self.window)?;
        ordered.accept(self.policy)
    }
}

/// The whole way of a shared-memory message from `producer`.
#[derive(Clone, Debug)]
pub struct BusGate {
    /// Channel of the messages.
    pub topic: Topic,
    /// The only node that may write the channel.
    pub producer: NodeId,
    /// Key of the channel.
    pub key: bus::ChannelKey,
    /// Messages seen so far.
    pub window: Window,
    /// The oldest a message may be.
    pub freshness: Span,
}

impl BusGate {
    /// A gate on `topic` from `producer`; `freshness` bounds the age by this host's clock.
    pub fn new(topic: Topic, producer: NodeId, key: bus::ChannelKey, freshness: Span) -> Self {
        // A channel keeps order, so width 0; a slow reader misses any number of messages, so no limit of the step.
        Self { topic, producer, key, window: Window::new(0, u64::MAX), freshness }
    }

    /// Judges length, schema, freshness, tag, of a sensor product whether it is live, and order.
    pub fn admit<'b, M: Decode<'b, ()> + Provenance>(
        &mut self,
        policy: &Policy,
        now: Instant,
        bytes: &'b [u8],
    ) -> Result<Accepted<M>, Refusal> {
        let live = self.attribute::<M>(policy, now, bytes)?.of_live(policy)?;
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
