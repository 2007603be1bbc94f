//! The feed to the console: what was accepted, refused, opened and sent, one sealed message each.
//!
//! Refusals can be as many as an adversary likes, so their feed is bounded; the account counts every one,
//! and the oracle by it.

use wire::bus::Sender;
use wire::codec;
use wire::core::{Output, Topic};
use wire::feed::Feed;
use wire::id::PeerId;
use wire::refusal::Reason;
use wire::time::{Instant, Span};

/// Refusals that are fed within one [`REFUSAL_WINDOW`].
const MAX_REFUSALS: u32 = 20;
/// Window of that bound.
const REFUSAL_WINDOW: Span = Span::s(1);

/// The sending end of the feed.
#[derive(Clone, Debug)]
pub struct Feeder {
    sender: Sender,
    window: Instant,
    refusals: u32,
}

impl Feeder {
    /// The feed from `now` on.
    pub fn new(sender: Sender, now: Instant) -> Self {
        Self { sender, window: now, refusals: 0 }
    }

    /// One message.
    pub fn seal(&mut self, now: Instant, message: &Feed<'_>) -> Output {
        Output::Bus { topic: Topic::Feed, bytes: self.sender.seal(now, &codec::encode(message)) }
    }

    /// A refusal, unless this window's share is used up.
    pub fn refused(&mut self, now: Instant, reason: Reason, peer: Option<PeerId>) -> Option<Output> {
        if now.since(self.window) >= REFUSAL_WINDOW {
            (self.window, self.refusals) = (now, 0);
        }
        self.refusals = self.refusals.saturating_add(1);
        (self.refusals <= MAX_REFUSALS).then(|| self.seal(now, &Feed::Refused(reason, peer)))
    }
}
