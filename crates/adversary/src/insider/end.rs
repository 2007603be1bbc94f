//! One end of a session, spoken properly (`wire::session`): hello, challenge, echo, session nonce, sequence.
//!
//! Records received are decoded and used, not judged: an insider has no asset to protect.

use rand_chacha::ChaCha8Rng;
use rand_core::RngCore;
use wire::codec;
use wire::id::{Boot, Nonce, PeerId, Sequence};
use wire::session::{MAX_SESSION_MESSAGE, SESSION_VERSION, SessionBody, SessionMessage};
use wire::time::{Echo, Instant, Span};

/// State of one end of a session.
#[derive(Clone, Debug)]
pub(super) struct End {
    /// Peer at the other end.
    pub(super) peer: PeerId,
    boot: Boot,
    /// The session nonce that the peer is to repeat.
    ours: Nonce,
    /// The session nonce to repeat; `None` until the peer's hello.
    theirs: Option<Nonce>,
    /// True once the peer has used this end's session nonce.
    heard: bool,
    sequence: Sequence,
    challenge: Nonce,
    challenged: Instant,
    challenge_period: Span,
    echo: Option<Echo>,
    /// The display's challenge that this peer brought, with the time of its first sight.
    pub(super) watched: Option<Echo>,
}

impl End {
    /// An end of a session that opened at `now`.
    pub(super) fn new(peer: PeerId, boot: Boot, challenge_period: Span, now: Instant, rng: &mut ChaCha8Rng) -> Self {
        Self {
            peer,
            boot,
            ours: Nonce(rng.next_u64()),
            theirs: None,
            heard: false,
            sequence: Sequence(0),
            challenge: Nonce(rng.next_u64()),
            challenged: now,
            challenge_period,
            echo: None,
            watched: None,
        }
    }

    /// True until the peer has used this end's session nonce.
    pub(super) fn wants_hello(&self) -> bool {
        !self.heard
    }

    /// True if a record sent now can be accepted at all.
    pub(super) fn ready(&self) -> bool {
        self.theirs.is_some()
    }

    /// Takes a record; its content, or `None` when it is unreadable.
    pub(super) fn hear<'b>(&mut self, now: Instant, bytes: &'b [u8]) -> Option<SessionBody<'b>> {
        let outer: SessionMessage<'b> = codec::decode(bytes, MAX_SESSION_MESSAGE).ok()?;
        if self.echo.is_none_or(|echo| echo.nonce != outer.challenge) {
            self.echo = Some(Echo { nonce: outer.challenge, seen: now.stamp() });
        }
        self.heard |= outer.session == self.ours;
        match outer.body {
            SessionBody::Hello(nonce) => self.theirs = Some(nonce),
            SessionBody::Watch(nonce) if self.watched.is_none_or(|echo| echo.nonce != nonce) => {
                self.watched = Some(Echo { nonce, seen: now.stamp() });
            }
            SessionBody::Watch(_)
            | SessionBody::Report(_)
            | SessionBody::Grant(_)
            | SessionBody::Teammate(_)
            | SessionBody::Crop(_)
            | SessionBody::Revoked(_) => {}
        }
        Some(outer.body)
    }

    /// The Hello of this end.
    pub(super) fn hello(&mut self, now: Instant, rng: &mut ChaCha8Rng) -> Vec<u8> {
        let our_nonce = self.ours;
        self.say(now, SessionBody::Hello(our_nonce), rng)
    }

    /// A record with this content.
    pub(super) fn say(&mut self, now: Instant, body: SessionBody<'_>, rng: &mut ChaCha8Rng) -> Vec<u8> {
        codec::encode(&self.session_message(now, body, rng))
    }

    /// Content of a session message, not yet encoded.
    pub(super) fn session_message<'b>(
        &mut self,
        now: Instant,
        body: SessionBody<'b>,
        rng: &mut ChaCha8Rng,
    ) -> SessionMessage<'b> {
        if now.since(self.challenged) >= self.challenge_period {
            (self.challenge, self.challenged) = (Nonce(rng.next_u64()), now);
        }
        self.sequence = self.sequence.next();
        SessionMessage {
            version: SESSION_VERSION,
            session: self.theirs.unwrap_or(Nonce::NONE),
            boot: self.boot,
            sequence: self.sequence,
            stamp: now.stamp(),
            challenge: self.challenge,
            echo: self.echo,
            body,
        }
    }

    /// Leaves out a given number of numbers.
    pub(super) fn skip(&mut self, numbers: u64) {
        self.sequence = Sequence(self.sequence.0.saturating_add(numbers));
    }
}
