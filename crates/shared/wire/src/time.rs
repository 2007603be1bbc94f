//! Time on one host, and stamps from another.
//!
//! Every host has its own monotonic clock with an arbitrary zero and a small drift. [`Instant`] is this host's time;
//! [`PeerStamp`] is a number some other host wrote. The two do not subtract: the only bridge is [`AgeBound`], which
//! needs a challenge that this host issued and the other echoed.

use core::fmt;
use core::ops::{Add, AddAssign, Sub};

use arrayvec::ArrayVec;
use minicbor::{Decode, Encode};

use crate::id::Nonce;

/// A span of time in microseconds.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Encode,
    Decode,
    serde::Serialize,
    serde::Deserialize,
)]
#[cbor(transparent)]
pub struct Span(#[n(0)] pub u64);

impl Span {
    /// No time.
    pub const ZERO: Span = Span(0);

    /// A given number of milliseconds.
    pub const fn ms(n: u64) -> Span {
        Span(n * 1000)
    }

    /// A given number of seconds.
    pub const fn s(n: u64) -> Span {
        Span(n * 1_000_000)
    }

    /// Milliseconds, for people.
    pub fn as_ms(self) -> f64 {
        self.0 as f64 / 1000.0
    }

    /// The longer of two.
    pub fn max(self, other: Span) -> Span {
        Span(self.0.max(other.0))
    }
}

impl Add for Span {
    type Output = Span;
    fn add(self, other: Span) -> Span {
        Span(self.0.saturating_add(other.0))
    }
}

impl fmt::Display for Span {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.3} ms", self.as_ms())
    }
}

/// A point on this host's monotonic clock, in microseconds from its arbitrary zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode, serde::Serialize)]
#[cbor(transparent)]
pub struct Instant(#[n(0)] pub u64);

impl Instant {
    /// Time since `earlier`; zero if `earlier` is later.
    pub fn since(self, earlier: Instant) -> Span {
        Span(self.0.saturating_sub(earlier.0))
    }

    /// The instant as a number for another host to read.
    pub fn stamp(self) -> PeerStamp {
        PeerStamp(self.0)
    }
}

impl Add<Span> for Instant {
    type Output = Instant;
    fn add(self, span: Span) -> Instant {
        Instant(self.0.saturating_add(span.0))
    }
}

impl AddAssign<Span> for Instant {
    fn add_assign(&mut self, span: Span) {
        *self = *self + span;
    }
}

impl Sub<Span> for Instant {
    type Output = Instant;
    fn sub(self, span: Span) -> Instant {
        Instant(self.0.saturating_sub(span.0))
    }
}

/// A stamp that some other host wrote, in its microseconds from its zero. Untrusted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Encode, Decode)]
#[cbor(transparent)]
pub struct PeerStamp(#[n(0)] pub u64);

impl PeerStamp {
    /// Signed difference to another stamp *of the same host*, in microseconds.
    pub fn minus(self, other: PeerStamp) -> i64 {
        (self.0 as i64).wrapping_sub(other.0 as i64)
    }
}

/// An upper bound of a record's age. Only [`AgeBound::age`] and [`Age::on_one_host`] make one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Age(Span);

impl Age {
    /// Age of something stamped on this very host.
    pub fn on_one_host(stamped: Instant, now: Instant) -> Age {
        Age(now.since(stamped))
    }

    /// Age of a record that was already `before` old at the start of this one.
    #[must_use]
    pub fn plus(self, before: Span) -> Age {
        Age(self.0 + before)
    }

    /// Upper bound of the age.
    pub fn upper(self) -> Span {
        self.0
    }
}

/// The echo of a challenge: the nonce, and the echoing host's clock when it first saw it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Encode, Decode)]
pub struct Echo {
    /// The nonce that was issued.
    #[n(0)]
    pub nonce: Nonce,
    /// The echoing host's clock on first sight.
    #[n(1)]
    pub seen: PeerStamp,
}

/// Number of proven pairs kept: as many as serve at once, at one challenge a second and three seconds' limit.
const PAIRS: usize = 4;

/// Relative clock error that two hosts may have; above any crystal in use (RFC 5905 takes 15 ppm as typical).
pub const MAX_DRIFT_PPM: u64 = 200;

/// Bounds the age of another host's records by challenge and echo.
///
/// A nonce issued here at `s` and first seen there at `τ` proves that `τ`, read on that host's clock, is not earlier
/// than `s`, read on this host's. A record stamped `σ` there and received here at `r` is then at most `r − s − (σ − τ)`
/// old: delay on either path can only make the bound larger. The bound is widened by [`MAX_DRIFT_PPM`] of the distance.
/// Every proven pair bounds every age, so the smallest of the bounds that still serve is judged: a challenge that was
/// seen late, because the record that first carried it was lost, makes no message look older than it is.
#[derive(Clone, Debug)]
pub struct AgeBound {
    issued: Option<(Nonce, Instant)>,
    previous: Option<(Nonce, Instant)>,
    /// The newest proven pairs (s, τ), oldest first.
    proven: ArrayVec<(Instant, PeerStamp), PAIRS>,
    limit: Span,
}

impl AgeBound {
    /// With `limit`, the longest time an echo may serve, counted from the issue of its nonce.
    pub fn new(limit: Span) -> Self {
        Self { issued: None, previous: None, proven: ArrayVec::new(), limit }
    }

    /// Notes that `nonce` went out at `now`. The one before stays answerable; older ones do not.
    pub fn issue(&mut self, nonce: Nonce, now: Instant) {
        self.previous = self.issued;
        self.issued = Some((nonce, now));
    }

    /// The nonce to repeat in outgoing records.
    pub fn current(&self) -> Option<Nonce> {
        self.issued.map(|(n, _)| n)
    }

    /// Time at which the current nonce was issued.
    pub fn issued_at(&self) -> Option<Instant> {
        self.issued.map(|(_, time)| time)
    }

    /// Time at which this nonce went out, if this host issued it and an echo is still accepted.
    pub fn sent(&self, nonce: Nonce) -> Option<Instant> {
        [self.issued, self.previous].into_iter().flatten().find(|(n, _)| *n == nonce).map(|(_, time)| time)
    }

    /// Takes an echo into account. False when this host did not issue the nonce, or accepts no echo of it any more.
    pub fn prove(&mut self, echo: Echo) -> bool {
        let Some(s) = self.sent(echo.nonce) else { return false };
        if self.proven.last().is_none_or(|(newest, _)| s > *newest) {
            if self.proven.is_full() {
                self.proven.remove(0);
            }
            self.proven.push((s, echo.seen));
        }
        true
    }

    /// The largest age that a record stamped `sigma` and received at `received` can have; `None` without a valid
    /// echo within the limit, when everything has to count as stale.
    pub fn age(&self, sigma: PeerStamp, received: Instant) -> Option<Age> {
        let serving = self.proven.iter().filter(|(s, _)| received.since(*s) <= self.limit);
        let bounds = serving.map(|(s, tau)| {
            let ahead = sigma.minus(*tau);
            let drift = (ahead.unsigned_abs().saturating_mul(MAX_DRIFT_PPM)).div_ceil(1_000_000) as i64;
            let age = (received.since(*s).0 as i64).saturating_sub(ahead).saturating_add(drift);
            // A stamp beyond anything that could have been written by now is a lie, not youth.
            if age < -drift { None } else { Some(age.max(0) as u64) }
        });
        // A stamp that one pair proves false is false by all: the minimum must not pass over that pair.
        bounds.reduce(|one, other| Some(one?.min(other?))).flatten().map(|age| Age(Span(age)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn proven(s: u64, tau: u64) -> AgeBound {
        let mut bound = AgeBound::new(Span::s(3));
        bound.issue(Nonce(7), Instant(s));
        assert!(bound.prove(Echo { nonce: Nonce(7), seen: PeerStamp(tau) }));
        bound
    }

    /// The bound holds for any delays.
    #[test]
    fn age_bound_never_undercuts_true_age() {
        // Peer clock = receiver's + 1_000_000; challenge takes 5 ms, record written 40 ms after, arrives 30 ms later.
        let bound = proven(10_000, 1_015_000);
        let age = bound.age(PeerStamp(1_055_000), Instant(85_000)).unwrap().upper();
        assert!(age >= Span::ms(30), "{age}");
        assert!(age <= Span::ms(30) + Span::ms(5) + Span(10), "{age}");
    }

    #[test]
    fn a_delayed_challenge_only_ages_records() {
        let prompt = proven(10_000, 1_015_000).age(PeerStamp(1_055_000), Instant(85_000)).unwrap();
        let delayed = proven(10_000, 1_045_000).age(PeerStamp(1_055_000), Instant(85_000)).unwrap();
        assert!(delayed > prompt);
    }

    #[test]
    fn late_challenge_ages_nothing_while_earlier_serves() {
        let mut bound = proven(0, 1000);
        bound.issue(Nonce(8), Instant(1_000_000));
        assert!(bound.prove(Echo { nonce: Nonce(8), seen: PeerStamp(1_300_000) }));
        let young = |time: u64| bound.age(PeerStamp(time), Instant(time)).unwrap().upper();
        assert!(young(2_000_000) < Span::ms(2), "{}", young(2_000_000));
        assert!(young(3_100_000) >= Span::ms(300), "the earlier one serves no more");
    }

    /// A foreign nonce is no proof; without an echo a record is stale.
    #[test]
    fn foreign_nonce_or_missing_echo_is_stale() {
        let mut bound = AgeBound::new(Span::s(3));
        bound.issue(Nonce(7), Instant(0));
        assert!(!bound.prove(Echo { nonce: Nonce(8), seen: PeerStamp(0) }));
        assert_eq!(bound.age(PeerStamp(0), Instant(1)), None);
    }

    #[test]
    fn an_echo_beyond_its_limit_means_stale() {
        let bound = proven(0, 0);
        assert!(bound.age(PeerStamp(2_900_000), Instant(3_000_000)).is_some());
        assert_eq!(bound.age(PeerStamp(2_900_000), Instant(3_000_001)), None);
    }

    #[test]
    fn a_stamp_from_the_future_is_not_young() {
        let bound = proven(0, 0);
        assert_eq!(bound.age(PeerStamp(2_000_000), Instant(1_000_000)), None);
    }
}
