//! Cookie exchange of a listener: the check of an unknown peer's datagram before any state is kept for it.
//!
//! While few handshakes are open, a sound first ClientHello is admitted without a cookie. When more are open, the peer first has to
//! prove that it receives at its address: the listener answers with a HelloVerifyRequest (RFC 6347 §4.2.1) with a
//! cookie, a keyed hash over address and hello, and keeps no state. A peer that returns the cookie is on a short list
//! for a few seconds, and its next first hello is admitted.
//!
//! The library makes its state first, draws another cookie then, and counts messages from zero, so it cannot continue
//! a handshake that begins with this cookie: our dialler starts again (`dtls::cookie_retry`), a foreign client has to
//! wait until few handshakes are open. Room for handshakes is left to the listener.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::time::Duration;

use ring::hmac;
use ring::rand::SystemRandom;
use tokio::time::Instant;

use super::hello;
use super::observe::Verdict;

/// Handshakes that may be open before unknown peers have to prove that they receive.
pub const CALM: usize = 16;

/// Addresses on the list at most.
pub const PROVED: usize = 256;

/// Lifetime of an entry: the time limit of a handshake.
pub const PROOF: Duration = Duration::from_secs(3);

/// Answer to an unknown peer's datagram.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Admits it.
    Admit,
    /// Sends this challenge back, no longer than the datagram, and keeps no state.
    Challenge(Vec<u8>),
    /// Notes that its sender receives at its address.
    Prove,
    /// Drops it.
    Refuse(Verdict),
}

/// A cookie exchange with its key.
pub struct CookieExchange {
    key: hmac::Key,
    proved: BTreeMap<SocketAddr, Instant>,
}

impl CookieExchange {
    /// A cookie exchange; `None` when the host has no randomness.
    pub fn new() -> Option<Self> {
        let key = hmac::Key::generate(hmac::HMAC_SHA256, &SystemRandom::new()).ok()?;
        Some(Self { key, proved: BTreeMap::new() })
    }

    /// Decides on a datagram of an unknown peer while `open` handshakes are open.
    pub fn judge(&mut self, from: SocketAddr, datagram: &[u8], open: usize, now: Instant) -> Answer {
        let verdict = hello::before_association(datagram);
        let (Verdict::Passed, Some(parts)) = (verdict, hello::parts(datagram)) else {
            return Answer::Refuse(verdict);
        };
        let input = cookie_input(from, parts.random);
        if !parts.cookie.is_empty() {
            if hmac::verify(&self.key, &input, parts.cookie).is_err() {
                return Answer::Refuse(Verdict::Unproven);
            }
            self.prove(from, now);
            return Answer::Prove;
        }
        // One proof admits one handshake: for the next one the peer has to return a cookie again.
        let proved = self.proved.remove(&from).is_some_and(|since| now.duration_since(since) <= PROOF);
        if proved || open < CALM {
            return Answer::Admit;
        }
        let challenge = hello::verify_request(parts.sequence, hmac::sign(&self.key, &input).as_ref());
        // The source address may be forged: an answer longer than the datagram would amplify a flood of its owner.
        if challenge.len() > datagram.len() {
            return Answer::Refuse(Verdict::Unproven);
        }
        Answer::Challenge(challenge)
    }

    fn prove(&mut self, from: SocketAddr, now: Instant) {
        if self.proved.len() >= PROVED {
            self.proved.retain(|_, since| now.duration_since(*since) <= PROOF);
        }
        if self.proved.len() >= PROVED {
            let oldest = self.proved.iter().min_by_key(|(_, since)| **since).map(|(from, _)| *from);
            oldest.and_then(|from| self.proved.remove(&from));
        }
        self.proved.insert(from, now);
    }
}

/// Input of a cookie: the hello's source address, and its random.
fn cookie_input(from: SocketAddr, random: &[u8]) -> Vec<u8> {
    let mut input = from.to_string().into_bytes();
    input.push(0);
    input.extend_from_slice(random);
    input
}

#[cfg(test)]
mod tests {
    use super::*;

    fn peer(port: u16) -> SocketAddr {
        crate::loopback::LoopbackAddr::on_port(port).socket()
    }

    /// A first hello with this random: one suite, one compression, one extension.
    fn first(random: u8) -> Vec<u8> {
        let mut body = vec![254, 253];
        body.extend([random; 32]);
        body.extend([0, 0, 0, 2, 0xc0, 0x2b, 1, 0, 0, 4, 0, 0x17, 0, 0]);
        let mut hello = vec![22, 254, 253, 0, 0, 0, 0, 0, 0, 0, 7, 0, (12 + body.len()) as u8];
        hello.extend([1, 0, 0, body.len() as u8, 0, 0, 0, 0, 0, 0, 0, body.len() as u8]);
        hello.extend(body);
        hello
    }

    /// While few handshakes are open a hello is admitted without a cookie.
    #[tokio::test(start_paused = true)]
    async fn busy_listener_demands_proof_first() {
        let mut exchange = CookieExchange::new().unwrap();
        let hello = first(1);
        assert_eq!(exchange.judge(peer(1), &hello, CALM - 1, Instant::now()), Answer::Admit);
        let Answer::Challenge(challenge) = exchange.judge(peer(1), &hello, CALM, Instant::now()) else {
            panic!("let in")
        };
        assert!(challenge.len() <= hello.len());
        let cookie = hello::requested_cookie(&challenge).unwrap();
        let proof = hello::with_cookie(&hello, cookie).unwrap();
        let other = exchange.judge(peer(2), &proof, CALM, Instant::now());
        assert_eq!(other, Answer::Refuse(Verdict::Unproven), "the cookie is for another address");
        let mut forged = proof.clone();
        forged[13 + 12 + 36] ^= 1;
        assert_eq!(exchange.judge(peer(1), &forged, CALM, Instant::now()), Answer::Refuse(Verdict::Unproven));
        assert_eq!(exchange.judge(peer(1), &proof, CALM, Instant::now()), Answer::Prove);
        assert_eq!(exchange.judge(peer(1), &hello, CALM, Instant::now()), Answer::Admit);
        assert!(matches!(exchange.judge(peer(1), &hello, CALM, Instant::now()), Answer::Challenge(_)), "once");
        assert_eq!(exchange.judge(peer(1), &proof, CALM, Instant::now()), Answer::Prove);
        tokio::time::advance(PROOF + Duration::from_millis(1)).await;
        assert!(matches!(exchange.judge(peer(1), &hello, CALM, Instant::now()), Answer::Challenge(_)), "too late");
    }

    #[tokio::test(start_paused = true)]
    async fn the_list_is_bounded_and_forgets_the_oldest() {
        let mut exchange = CookieExchange::new().unwrap();
        let hello = first(1);
        for port in 1..=PROVED as u16 + 1 {
            let Answer::Challenge(challenge) = exchange.judge(peer(port), &hello, CALM, Instant::now()) else {
                panic!()
            };
            let proof = hello::with_cookie(&hello, hello::requested_cookie(&challenge).unwrap()).unwrap();
            assert_eq!(exchange.judge(peer(port), &proof, CALM, Instant::now()), Answer::Prove);
            tokio::time::advance(Duration::from_millis(1)).await;
        }
        assert_eq!(exchange.proved.len(), PROVED);
        assert!(matches!(exchange.judge(peer(1), &hello, CALM, Instant::now()), Answer::Challenge(_)));
        assert_eq!(exchange.judge(peer(PROVED as u16 + 1), &hello, CALM, Instant::now()), Answer::Admit);
    }

    #[tokio::test(start_paused = true)]
    async fn malformed_hello_is_always_refused_by_name() {
        let mut exchange = CookieExchange::new().unwrap();
        let mut broken = first(1);
        broken[13 + 12 + 35] = 9;
        assert_eq!(exchange.judge(peer(1), &broken, 0, Instant::now()), Answer::Refuse(Verdict::BadHello));
        assert_eq!(exchange.judge(peer(1), b"noise", 0, Instant::now()), Answer::Refuse(Verdict::UnknownPeer));
    }
}
