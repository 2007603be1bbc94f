//! One suite of properties over two implementations of the secure telemetry link: the twin's model (`twin::net`) and the real stack
//! (guard and DTLS library, over memory in paused time). Differences are in `docs/developer/link-model.md`.
//!
//! Every datagram passes the test's hands; only the two ends hold a key.

mod model;
mod stack;

use link::dtls::{MAX_RECORD, REPLAY_WINDOW};
use link::guard::SEAL;
use link::guard::hello::opens_association;
use link::guard::record::{HEADER, Split, split};
use wire::core::Side;
use wire::policy::Requirement;

/// An association between two ends with the test in the path.
trait Association {
    /// Opens an association.
    fn open(guard: Requirement) -> Self;
    /// Closes the association and opens another between the same ends.
    fn reopen(&mut self);
    /// The datagrams that `from` sent in the newest handshake.
    fn flights(&mut self, from: Side) -> Vec<Vec<u8>>;
    /// The datagram that `from` makes of a record; `None` when it does not take it.
    fn send(&mut self, from: Side, record: &[u8]) -> Option<Vec<u8>>;
    /// Delivers a datagram to an end; returns the records that it accepts.
    fn put(&mut self, side: Side, datagram: &[u8]) -> Vec<Vec<u8>>;
    /// Records that the guard of an end saw, and how many of them it refused.
    fn guard(&self, side: Side) -> (u64, u64);
    /// A minute passes.
    fn wait(&mut self);

    /// Passes a record from `from` to the other side untouched; returns the other side's records.
    fn pass(&mut self, from: Side, record: &[u8]) -> Vec<Vec<u8>> {
        match self.send(from, record) {
            Some(datagram) => self.put(from.opposite(), &datagram),
            None => Vec::new(),
        }
    }

    /// True if it carries records both ways.
    fn is_established(&mut self) -> bool {
        [Side::Client, Side::Server].into_iter().all(|side| self.pass(side, b"up?") == [b"up?"])
    }

    /// `n` records from the client, not put in anywhere yet: record i holds i.
    fn sealed(&mut self, n: u8) -> Vec<Vec<u8>> {
        (0..n).map(|i| self.send(Side::Client, &[i]).expect("it stands")).collect()
    }
}

/// Record without a key: record type, then epoch 0, a sequence number and two bytes.
fn plaintext(content: u8, body: [u8; 2]) -> [u8; 15] {
    [content, 254, 253, 0, 0, 0, 0, 0, 0, 0, 99, 0, 2, body[0], body[1]]
}

const ALERT: (u8, [u8; 2]) = (21, [2, 40]);
const CLOSE: (u8, [u8; 2]) = (21, [1, 0]);
const DATA: (u8, [u8; 2]) = (23, [1, 0]);
const UNKNOWN: (u8, [u8; 2]) = (99, [1, 0]);
const CHANGE: (u8, [u8; 2]) = (20, [7, 7]);

fn a_record_arrives_once_and_whole<A: Association>() {
    let mut link = A::open(Requirement::Required);
    for length in [1, 100, MAX_RECORD] {
        let record: Vec<u8> = (0..length).map(|n| n as u8).collect();
        for side in [Side::Client, Side::Server] {
            assert_eq!(link.pass(side, &record), std::slice::from_ref(&record), "{length} bytes");
        }
    }
}

fn oversized_record_is_refused_without_cost<A: Association>() {
    let mut link = A::open(Requirement::Required);
    assert_eq!(link.send(Side::Client, &[7; MAX_RECORD + 1]), None);
    assert!(link.is_established());
}

fn a_record_does_not_travel_in_the_clear<A: Association>() {
    let mut link = A::open(Requirement::Required);
    let datagram = link.send(Side::Client, &[0x5a; 64]).expect("it stands");
    assert!(!datagram.windows(8).any(|w| w == [0x5a; 8]));
}

/// Content type, epoch and length of each record that each side sends. Signatures and certificates differ by a few bytes.
fn handshake_is_six_datagrams_of_these_records<A: Association>() {
    const CLIENT: [&[(u8, u16, usize)]; 3] =
        [&[(22, 0, 149)], &[(22, 0, 169)], &[(22, 0, 485), (22, 0, 91), (22, 0, 100), (20, 0, 14), (22, 1, 61)]];
    const SERVER: [&[(u8, u16, usize)]; 3] = [
        &[(22, 0, 48)],
        &[(22, 0, 92), (22, 0, 486), (22, 0, 169), (22, 0, 46), (22, 0, 25)],
        &[(20, 0, 14), (22, 1, 61)],
    ];
    let mut link = A::open(Requirement::Required);
    link.reopen();
    for (side, expected) in [(Side::Client, CLIENT), (Side::Server, SERVER)] {
        let flights = link.flights(side);
        assert_eq!(flights.len(), expected.len(), "{side:?}");
        for (flight, expected) in flights.iter().zip(expected) {
            let records: Vec<_> = split(flight)
                .map(|piece| match piece {
                    Split::Record(raw) => (raw.content, raw.epoch, raw.bytes.len()),
                    Split::Remainder(bytes) => panic!("{} bytes left", bytes.len()),
                })
                .collect();
            let similar =
                |(a, b): (&(u8, u16, usize), &(u8, u16, usize))| (a.0, a.1) == (b.0, b.1) && a.2.abs_diff(b.2) <= 16;
            let same = records.len() == expected.len() && records.iter().zip(expected).all(similar);
            assert!(same, "{side:?}: {records:?} for {expected:?}");
        }
    }
    assert!(opens_association(&link.flights(Side::Client)[0]));
}

fn late_repeated_flight_triggers_the_last_flight<A: Association>() {
    let mut link = A::open(Requirement::Required);
    let (hello, last) = (link.flights(Side::Client)[0].clone(), link.flights(Side::Server)[2].clone());
    let (seen, refused) = link.guard(Side::Server);
    assert_eq!(link.put(Side::Server, &hello), Vec::<Vec<u8>>::new());
    assert_eq!(link.guard(Side::Server), (seen + 1, refused + 1));
    let buffers = link.flights(Side::Server);
    assert_eq!(buffers.len(), 4, "once more");
    assert_eq!(buffers[3].len(), last.len());
    assert!(link.is_established());
}

fn repeated_record_stops_at_the_replay_window<A: Association>() {
    let mut link = A::open(Requirement::Required);
    let sealed = link.sealed(100);
    for datagram in &sealed {
        assert_eq!(link.put(Side::Server, datagram).len(), 1);
    }
    let (seen, refused) = link.guard(Side::Server);
    for datagram in &sealed {
        assert_eq!(link.put(Side::Server, datagram), Vec::<Vec<u8>>::new());
    }
    assert_eq!(link.guard(Side::Server), (seen + 100, refused), "the guard holds no key and cannot know");
    assert!(link.is_established());
}

fn reordered_records_are_delivered_as_they_arrive<A: Association>() {
    let mut link = A::open(Requirement::Required);
    let sealed = link.sealed(4);
    let out: Vec<Vec<u8>> = [2, 0, 3, 1].iter().flat_map(|i: &usize| link.put(Side::Server, &sealed[*i])).collect();
    assert_eq!(out, [[2], [0], [3], [1]]);
}

fn late_records_outside_the_window_are_discarded<A: Association>() {
    let mut link = A::open(Requirement::Required);
    let sealed = link.sealed(101);
    assert_eq!(link.put(Side::Server, &sealed[100]), [[100]]);
    let late: Vec<Vec<u8>> = sealed[..100].iter().flat_map(|d| link.put(Side::Server, d)).collect();
    let first = (101 - REPLAY_WINDOW) as u8;
    assert_eq!(late, (first..100).map(|n| vec![n]).collect::<Vec<_>>());
}

fn withheld_record_is_delivered_at_any_age<A: Association>() {
    let mut link = A::open(Requirement::Required);
    let withheld = link.send(Side::Client, b"old").expect("it stands");
    link.wait();
    assert_eq!(link.put(Side::Server, &withheld), [b"old"], "anti-replay, not anti-delay");
}

fn a_lost_record_is_silence<A: Association>() {
    let mut link = A::open(Requirement::Required);
    link.sealed(90);
    assert!(link.is_established());
}

fn no_datagram_bit_can_be_changed<A: Association>() {
    let mut link = A::open(Requirement::Required);
    for bit in 0..(HEADER + 24) * 8 {
        let mut datagram = link.send(Side::Client, b"record").expect("it stands");
        if let Some(byte) = datagram.get_mut(bit / 8) {
            *byte ^= 1 << (bit % 8);
            let out = link.put(Side::Server, &datagram);
            assert!(out.is_empty(), "bit {bit}: {out:?}");
        }
    }
    assert!(link.is_established());
}

fn a_datagram_that_is_cut_short_gives_nothing<A: Association>() {
    let mut link = A::open(Requirement::Required);
    let length = link.send(Side::Client, b"record").expect("it stands").len();
    for cut in 0..length {
        let datagram = link.send(Side::Client, b"record").expect("it stands");
        assert!(link.put(Side::Server, &datagram[..cut]).is_empty(), "{cut} bytes");
    }
    assert!(link.is_established());
}

fn trailing_bytes_are_refused_and_their_record_delivered<A: Association>() {
    let mut link = A::open(Requirement::Required);
    let mut datagram = link.send(Side::Client, b"record").expect("it stands");
    datagram.extend([1, 2, 3]);
    let (seen, refused) = link.guard(Side::Server);
    assert_eq!(link.put(Side::Server, &datagram), [b"record"]);
    assert_eq!(link.guard(Side::Server), (seen + 2, refused + 1));
}

fn two_records_in_one_datagram_both_come_out<A: Association>() {
    let mut link = A::open(Requirement::Required);
    let both = link.sealed(2).concat();
    assert_eq!(link.put(Side::Server, &both), [[0], [1]]);
}

fn reflected_record_is_discarded<A: Association>() {
    let mut link = A::open(Requirement::Required);
    let datagram = link.send(Side::Client, b"echo").expect("it stands");
    assert!(link.put(Side::Client, &datagram).is_empty());
    assert!(link.is_established());
}

fn unsealable_record_is_refused_without_ending<A: Association>() {
    for (content, length) in [(23, 0), (23, 8), (23, 9), (23, SEAL - 1), (21, 2), (22, 20), (20, 1), (20, 64)] {
        let mut link = A::open(Requirement::Required);
        for side in [Side::Client, Side::Server] {
            let mut forged = vec![content, 254, 253, 0, 1, 0, 0, 0, 0, 0, 9, 0, length as u8];
            forged.extend(vec![1; length]);
            let (seen, refused) = link.guard(side);
            assert!(link.put(side, &forged).is_empty());
            assert_eq!(link.guard(side), (seen + 1, refused + 1), "type {content}, {length} bytes");
        }
        assert!(link.is_established(), "type {content}, {length} bytes");
    }
}

fn datagram_adds_header_nonce_and_tag<A: Association>() {
    let mut link = A::open(Requirement::Required);
    for length in [1, 50, MAX_RECORD] {
        let datagram = link.send(Side::Server, &vec![3; length]).expect("it stands");
        assert_eq!(datagram.len(), HEADER + length + SEAL);
    }
}

fn a_record_without_the_key_is_discarded<A: Association>() {
    let mut link = A::open(Requirement::Required);
    for sequence in [1, 50, 200] {
        let mut forged = vec![23, 254, 253, 0, 1, 0, 0, 0, 0, 0, sequence, 0, 40];
        forged.extend([0x42; 40]);
        assert!(link.put(Side::Server, &forged).is_empty());
    }
    assert!(link.is_established());
}

fn records_of_an_earlier_association_are_discarded<A: Association>() {
    let mut link = A::open(Requirement::Required);
    let old = link.sealed(3);
    link.reopen();
    assert!(old.iter().all(|datagram| link.put(Side::Server, datagram).is_empty()));
    assert!(link.is_established());
}

fn guard_refuses_plaintext_without_ending<A: Association>() {
    for (content, body) in [ALERT, CLOSE, DATA, UNKNOWN, CHANGE] {
        let mut link = A::open(Requirement::Required);
        for side in [Side::Client, Side::Server] {
            let (seen, refused) = link.guard(side);
            assert!(link.put(side, &plaintext(content, body)).is_empty());
            assert_eq!(link.guard(side), (seen + 1, refused + 1), "type {content}");
        }
        assert!(link.is_established(), "type {content}");
    }
}

fn unguarded_plaintext_ends_the_association<A: Association>() {
    for (content, body) in [ALERT, CLOSE, DATA] {
        for side in [Side::Client, Side::Server] {
            let mut link = A::open(Requirement::Waived);
            assert!(link.is_established());
            assert!(link.put(side, &plaintext(content, body)).is_empty());
            assert!(!link.is_established(), "type {content} at {side:?}");
        }
    }
}

/// Runs every property over both implementations.
macro_rules! over_both {
    ($($property:ident)+) => {
        mod the_model {
            $( #[test] fn $property() { super::$property::<super::model::Model>(); } )+
        }
        mod the_stack {
            $( #[test] fn $property() { super::$property::<super::stack::Stack>(); } )+
        }
    };
}

over_both! {
    handshake_is_six_datagrams_of_these_records
    late_repeated_flight_triggers_the_last_flight
    a_record_arrives_once_and_whole
    oversized_record_is_refused_without_cost
    a_record_does_not_travel_in_the_clear
    repeated_record_stops_at_the_replay_window
    reordered_records_are_delivered_as_they_arrive
    late_records_outside_the_window_are_discarded
    withheld_record_is_delivered_at_any_age
    a_lost_record_is_silence
    no_datagram_bit_can_be_changed
    a_datagram_that_is_cut_short_gives_nothing
    trailing_bytes_are_refused_and_their_record_delivered
    two_records_in_one_datagram_both_come_out
    reflected_record_is_discarded
    unsealable_record_is_refused_without_ending
    datagram_adds_header_nonce_and_tag
    a_record_without_the_key_is_discarded
    records_of_an_earlier_association_are_discarded
    guard_refuses_plaintext_without_ending
    unguarded_plaintext_ends_the_association
}
