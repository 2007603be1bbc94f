//! The session with the supervisor, and the way of a teammate's report through the trust boundary.
//!
//! A [`Session`] answers challenges, issues its own and admits records through `wire::trust::SessionGate`, the only way
//! in. The meaning of an accepted record is left to the core; the agreement of teammates' claims, to `consistency`.

use minicbor::bytes::ByteSlice;
use wire::bounds::Bounds;
use wire::codec;
use wire::id::{Boot, Nonce, PeerId, Sequence, SessionId};
use wire::policy::Policy;
use wire::refusal::Refusal;
use wire::session::{SESSION_VERSION, SessionBody, SessionMessage, Teammate};
use wire::sign::Keyring;
use wire::time::{Age, AgeBound, Echo, Instant};
use wire::trust::{Accepted, Decoded, Exchange, SessionGate, SessionRecord, SignedReport, Window, Windows};

/// A secure session with the supervisor, seen from the unit.
#[derive(Clone, Debug)]
pub struct Session {
    id: SessionId,
    peer: PeerId,
    /// Nonce that the peer is to put into its records.
    nonce: Nonce,
    /// Nonce that this unit is to put into its records, on the peer's demand.
    theirs: Option<Nonce>,
    /// True once an accepted record has carried the nonce.
    heard: bool,
    ages: AgeBound,
    window: Window,
    /// The peer's two newest challenges with their first sight, newest first. Two, so that a late record with the
    /// older one does not make the newer look newly seen.
    challenges: [Option<Echo>; 2],
    /// The display's newest challenge, with its first sight.
    watched: Option<Echo>,
    sent: Sequence,
}

impl Session {
    /// A session that has just opened; `nonce` is fresh and unguessable.
    pub fn new(id: SessionId, peer: PeerId, nonce: Nonce, bounds: &Bounds) -> Self {
        Session {
            id,
            peer,
            nonce,
            theirs: None,
            heard: false,
            ages: AgeBound::new(bounds.echo_limit()),
            window: Window::new(bounds.replay_window, bounds.sequence_jump),
            challenges: [None; 2],
            watched: None,
            sent: Sequence(0),
        }
    }

    /// Local handle of the session.
    pub fn id(&self) -> SessionId {
        self.id
    }

    /// Peer that the handshake authenticated.
    pub fn peer(&self) -> PeerId {
        self.peer
    }

    /// The nonce that records on this session have to carry.
    pub fn nonce(&self) -> Nonce {
        self.nonce
    }

    /// Judges one record.
    pub fn admit<'b>(
        &mut self,
        policy: &Policy,
        bounds: &Bounds,
        now: Instant,
        bytes: &'b [u8],
    ) -> Result<Accepted<SessionRecord<'b>>, Refusal> {
        let mut gate = SessionGate {
            policy,
            peer: self.peer,
            ages: &mut self.ages,
            session: self.nonce,
            window: &mut self.window,
            freshness: bounds.freshness(),
            echo_limit: bounds.echo_limit(),
        };
        let (exchange, verdict) = gate.admit(now, bytes);
        if let Some(exchange) = exchange {
            self.note(now, &exchange);
        }
        if let Ok(record) = &verdict {
            self.heard |= record.message().outer.session == self.nonce;
        }
        verdict
    }

    /// The display's challenge came at `now`; only its first sight counts.
    pub fn watch(&mut self, challenge: Nonce, now: Instant) {
        if self.watched.is_none_or(|echo| echo.nonce != challenge) {
            self.watched = Some(Echo { nonce: challenge, seen: now.stamp() });
        }
    }

    /// Echo that a report has to repeat of it.
    pub fn watched(&self) -> Option<Echo> {
        self.watched
    }

    /// Time at which the present challenge was issued.
    pub fn challenged_at(&self) -> Option<Instant> {
        self.ages.issued_at()
    }

    /// Puts a new challenge into the records from now on.
    pub fn challenge(&mut self, nonce: Nonce, now: Instant) {
        self.ages.issue(nonce, now);
    }

    /// This unit's nonce, until the peer has used it: to be sent again.
    pub fn introduction(&self) -> Option<Nonce> {
        (!self.heard).then_some(self.nonce)
    }

    /// True if the peer's nonce is known: without it the peer refuses every record but Hello.
    pub fn introduced(&self) -> bool {
        self.theirs.is_some()
    }

    /// The next record to send.
    pub fn session_message(&mut self, now: Instant, boot: Boot, body: SessionBody<'_>) -> Vec<u8> {
        self.sent = self.sent.next();
        codec::encode(&SessionMessage {
            version: SESSION_VERSION,
            session: self.theirs.unwrap_or(Nonce::NONE),
            boot,
            sequence: self.sent,
            stamp: now.stamp(),
            challenge: self.ages.current().unwrap_or(Nonce::NONE),
            echo: self.challenges[0],
            body,
        })
    }

    fn note(&mut self, now: Instant, exchange: &Exchange) {
        self.theirs = exchange.hello.or(self.theirs);
        let known = self.challenges.iter().flatten().any(|echo| echo.nonce == exchange.challenge);
        if !known {
            self.challenges = [Some(Echo { nonce: exchange.challenge, seen: now.stamp() }), self.challenges[0]];
        }
    }
}

/// A report as the body of a record.
pub fn report_body(signed: &[u8]) -> SessionBody<'_> {
    SessionBody::Report(<&ByteSlice>::from(signed))
}

/// Judges the report in a gateway's envelope: its age is the one at the gateway plus the envelope's own.
/// It has to be of the session that the gateway says brought it, signed by its origin, and not seen before.
pub fn teammate<'b>(
    policy: &Policy,
    keys: &Keyring,
    windows: &mut Windows,
    bounds: &Bounds,
    envelope: &Teammate<'b>,
    (received, since_gateway): (Instant, Option<Age>),
) -> Result<Accepted<SignedReport<'b>>, Refusal> {
    let bytes: &'b [u8] = envelope.report;
    let age = since_gateway.map(|age| age.plus(envelope.age));
    let decoded: Decoded<SignedReport<'b>> = SignedReport::decode(received, bytes)?;
    decoded
        .fresh(policy, age, bounds.freshness(), bounds.echo_limit())?
        .by_origin(policy, envelope.via, keys)?
        .from_origin(policy, envelope.via, windows)?
        .accept(policy)
}
