//! Trials without a socket: a sender of this file, and the receivers of the `mavlink` crate and of this file.
//!
//! The library takes the host's clock for its own, so the sender's timestamps here begin there.

#![expect(clippy::unwrap_used, reason = "a test may end here")]

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use mavlink_relay::attack::{Attack, Link};
use mavlink_relay::class::{Measured, Required, Verdict, judge};
use mavlink_relay::end::{Delivery, EndFault, Receiver, Sender, Start};
use mavlink_relay::expected::rows;
use mavlink_relay::frame::{Frame, Version};
use mavlink_relay::library::Library;
use mavlink_relay::message::{COMMAND_LONG, seed};
use mavlink_relay::signature::{self, Key, TICKS};
use mavlink_relay::trial::{Counts, Trial, run};

const ROUNDS: u32 = 20;

/// A true sender, with a clock of the host.
#[derive(Default)]
struct Own {
    key: Option<Key>,
    timestamp: u64,
    number: u8,
    starts: u64,
}

impl Sender for Own {
    fn start(&mut self, start: &Start) -> Result<(), EndFault> {
        #[expect(clippy::disallowed_methods, reason = "the library has no other clock, and no count depends on it")]
        let since = SystemTime::now().duration_since(UNIX_EPOCH + Duration::from_secs(1_420_070_400)).unwrap();
        // A few ticks on at each start: without a socket between, both starts may fall into one tick of 10 µs.
        let now = since.as_micros() as u64 / 10 + 4 * self.starts;
        let timestamp = now - u64::from(start.behind_s) * TICKS;
        *self = Self { key: start.key, timestamp, number: self.number, starts: self.starts + 1 };
        Ok(())
    }

    fn send(&mut self) -> Result<Vec<u8>, EndFault> {
        self.number = self.number.wrapping_add(1);
        self.timestamp += 1;
        let version = Version::V2 { incompatible: 0, compatible: 0 };
        let (sequence, system, component, checksum, signature) = (self.number, 1, 1, 0, None);
        let payload = vec![self.number | 1; 30];
        let mut frame =
            Frame { version, sequence, system, component, message: COMMAND_LONG, payload, checksum, signature };
        frame.seal(seed(COMMAND_LONG));
        if let Some(key) = &self.key {
            signature::sign(&mut frame, key, seed(COMMAND_LONG), 0, self.timestamp);
        }
        Ok(frame.write())
    }
}

fn trial(attack: Attack, link: Link, accept_unsigned: bool) -> Counts {
    let trial = Trial { attack, link, rounds: ROUNDS, seed: 1, accept_unsigned };
    run(trial, &mut Own::default(), &mut Library::default()).unwrap()
}

fn measured(counts: Counts) -> (Measured, Measured) {
    let all = u64::from(ROUNDS);
    assert_eq!((counts.attacks, counts.honest, counts.undelivered), (all, all, 0));
    let of = |k| Measured::from_counts(k, all).unwrap();
    (of(counts.attacks_accepted), of(counts.honest_accepted))
}

/// The receiver that accepts unsigned messages differs exactly where a rule was broken.
#[test]
fn broken_receiver_changes_the_class() {
    for attack in [Attack::UnsignedCommand, Attack::Downgrade, Attack::KeyChangeUnsigned] {
        assert_eq!(measured(trial(attack, Link::Signed, false)), (Measured::Refused, Measured::Accepted), "{attack:?}");
        assert_eq!(measured(trial(attack, Link::Signed, true)), (Measured::Accepted, Measured::Accepted), "{attack:?}");
    }
}

#[test]
fn verdict_follows_counts_and_required_classes() {
    let half = |measured| judge(0, [(Some(measured), Required::Refused), (None, Required::Unstated)]);
    assert_eq!(half(Measured::Refused), Verdict::Invalid);
    let free = |measured| judge(0, [(Some(measured), Required::Unstated), (Some(measured), Required::Accepted)]);
    assert_eq!((free(Measured::Accepted), free(Measured::Refused)), (Verdict::Unstated, Verdict::Finding));
    let both = |measured| [(Some(measured), Required::Refused), (Some(Measured::Accepted), Required::Accepted)];
    assert_eq!(judge(0, both(Measured::Refused)), Verdict::AsPublished);
    assert_eq!(judge(0, both(Measured::Accepted)), Verdict::Finding);
    assert_eq!(judge(0, both(Measured::Mixed)), Verdict::Finding);
    assert_eq!(judge(1, both(Measured::Refused)), Verdict::Invalid);
}

#[test]
fn every_attack_arrives_on_both_links() {
    for row in rows().unwrap() {
        for link in Link::ALL {
            let counts = trial(row.name, link, false);
            let all = u64::from(ROUNDS);
            assert_eq!((counts.attacks, counts.honest, counts.undelivered), (all, all, 0), "{:?} {link:?}", row.name);
        }
    }
}

/// But for late messages: how long a parser waits for the rest of a damaged one depends on the bytes of timestamps, which the library takes
/// from the host's clock.
#[test]
fn same_seed_gives_the_same_counts() {
    for row in rows().unwrap() {
        let counts = || Counts { late: 0, ..trial(row.name, Link::Signed, false) };
        assert_eq!(counts(), counts(), "{:?}", row.name);
    }
}

/// A receiver whose socket loses every third datagram.
#[derive(Default)]
struct Lossy(Library, u32);

impl Receiver for Lossy {
    fn start(&mut self, start: &Start) -> Result<(), EndFault> {
        self.0.start(start)
    }

    fn deliver(&mut self, datagram: &[u8]) -> Result<Delivery, EndFault> {
        self.1 += 1;
        if self.1.is_multiple_of(3) { Ok(Delivery::default()) } else { self.0.deliver(datagram) }
    }
}

#[test]
fn lost_message_makes_the_cell_invalid() {
    let trial = Trial { attack: Attack::ReplayOlder, link: Link::Signed, rounds: 9, seed: 1, accept_unsigned: false };
    let counts = run(trial, &mut Own::default(), &mut Lossy::default()).unwrap();
    assert!(counts.undelivered > 0 && counts.attacks + counts.honest < 18, "{counts:?}");
    let of = |k, n| Measured::from_counts(k, n);
    let classes = [(of(0, counts.attacks), Required::Refused), (of(counts.honest, counts.honest), Required::Accepted)];
    assert_eq!(judge(counts.undelivered, classes), Verdict::Invalid);
}

/// A sender whose datagrams are no frames.
struct Noise;

impl Sender for Noise {
    fn start(&mut self, _: &Start) -> Result<(), EndFault> {
        Ok(())
    }

    fn send(&mut self) -> Result<Vec<u8>, EndFault> {
        Ok(vec![0x55; 20])
    }
}

#[test]
fn sender_without_frames_is_named() {
    let trial = Trial { attack: Attack::Spoof, link: Link::Signed, rounds: 1, seed: 1, accept_unsigned: false };
    let fault = run(trial, &mut Noise, &mut Library::default()).unwrap_err();
    assert_eq!(fault.to_string(), "the sender's datagram: byte 0: expected 0xfe or 0xfd, got 0x55");
}
