//! The feed to the console: records accepted and refused, sessions opened, orders sent, one sealed message each.
//!
//! Refusals can be as many as an adversary likes, so their feed is bounded: a number a second, each with the count for
//! its reason and from its peer by then. Refusals after the last one fed are reported with the next window's share, so
//! the display's counts are exact a moment later, whatever the flood; the account counts every one too, and the oracle
//! uses it.

use std::collections::BTreeMap;

use wire::bus::Sender;
use wire::codec;
use wire::core::{Output, Topic};
use wire::feed::Feed;
use wire::id::PeerId;
use wire::refusal::Reason;
use wire::time::{Instant, Span};

/// Refusals that are fed within one [`REFUSAL_WINDOW`].
const MAX_REFUSALS: u32 = 20;
/// Share of [`MAX_REFUSALS`] that is fed as refusals happen. The rest is for refusals that were only counted: a flood
/// of one kind must not keep another from being reported.
const MAX_AT_ONCE: u32 = 12;
/// Window of that bound.
const REFUSAL_WINDOW: Span = Span::s(1);

/// The sending end of the feed.
#[derive(Clone, Debug)]
pub struct Feeder {
    sender: Sender,
    window: Instant,
    refusals: u32,
    /// Counts by reason and peer: there are as many as there are reasons and identities, at most.
    counted: BTreeMap<(Reason, Option<PeerId>), Counted>,
}

/// Number of refusals of one reason and peer.
#[derive(Clone, Copy, Debug)]
struct Counted {
    all: u64,
    /// Value of `all` at the last feed.
    fed: u64,
    at: Instant,
}

impl Feeder {
    /// The feed from `now` on.
    pub fn new(sender: Sender, now: Instant) -> Self {
        Self { sender, window: now, refusals: 0, counted: BTreeMap::new() }
    }

    /// Seals one message of the feed.
    pub fn seal(&mut self, now: Instant, message: &Feed<'_>) -> Output {
        Output::Bus { topic: Topic::Feed, bytes: self.sender.seal(now, &codec::encode(message)) }
    }

    /// Counts a refusal, and feeds it unless this window's share is used up.
    pub fn refused(&mut self, now: Instant, reason: Reason, peer: Option<PeerId>) -> Option<Output> {
        self.count(now, reason, peer);
        self.share(now, MAX_AT_ONCE).then(|| self.refuse(now, reason, peer))
    }

    /// Counts a refusal that is fed later.
    pub fn count(&mut self, now: Instant, reason: Reason, peer: Option<PeerId>) {
        let counted = self.counted.entry((reason, peer)).or_insert(Counted { all: 0, fed: 0, at: now });
        counted.all = counted.all.saturating_add(1);
    }

    /// Refusals counted and not fed, those first that have waited longest, within the window's share.
    pub fn rest(&mut self, now: Instant) -> Vec<Output> {
        let mut waiting: Vec<_> = self.counted.iter().filter(|(_, counted)| counted.fed < counted.all).collect();
        waiting.sort_by_key(|(_, counted)| counted.at);
        let waiting: Vec<(Reason, Option<PeerId>)> = waiting.into_iter().map(|(kind, _)| *kind).collect();
        let mut outputs = Vec::new();
        for (reason, peer) in waiting {
            if !self.share(now, MAX_REFUSALS) {
                break;
            }
            outputs.push(self.refuse(now, reason, peer));
        }
        outputs
    }

    /// Time at which the refusals not fed can be.
    pub fn deadline(&self) -> Option<Instant> {
        let waiting = self.counted.values().any(|counted| counted.fed < counted.all);
        waiting.then(|| self.window + REFUSAL_WINDOW)
    }

    /// Takes one of the window's share, if fewer than `limit` are taken.
    fn share(&mut self, now: Instant, limit: u32) -> bool {
        if now.since(self.window) >= REFUSAL_WINDOW {
            (self.window, self.refusals) = (now, 0);
        }
        let left = self.refusals < limit;
        self.refusals += u32::from(left);
        left
    }

    fn refuse(&mut self, now: Instant, reason: Reason, peer: Option<PeerId>) -> Output {
        let all = self.counted.get_mut(&(reason, peer)).map_or(0, |counted| {
            (counted.fed, counted.at) = (counted.all, now);
            counted.all
        });
        self.seal(now, &Feed::Refused(reason, peer, all))
    }
}
