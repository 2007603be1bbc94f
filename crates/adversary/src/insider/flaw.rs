//! Records that are authenticated and broken, one flaw each.

use rand_chacha::ChaCha8Rng;
use wire::codec;
use wire::id::{NodeId, Nonce};
use wire::session::{MAX_SESSION_MESSAGE, SESSION_VERSION, SessionBody, SessionMessage};
use wire::sign::{Key, Purpose};
use wire::time::Instant;

use super::end::End;
use crate::plan::Flaw;
use crate::schedule::{noise, uniform_below};

/// Numbers that a sequence leaves out where it jumps: more than any platform lets it.
const JUMP: u64 = 10_000_000;

/// A record of `end` with this flaw; `report` is an encoded report of the sender, not yet signed.
pub(super) fn record(
    flaw: Flaw,
    now: Instant,
    end: &mut End,
    key: &Key,
    report: &[u8],
    rng: &mut ChaCha8Rng,
) -> Vec<u8> {
    match flaw {
        Flaw::Length => {
            let mut bytes = whole(now, end, key, report, rng);
            bytes.resize(MAX_SESSION_MESSAGE + 1, 0);
            bytes
        }
        Flaw::Schema => b"\x83\x01\x02\x03".to_vec(),
        Flaw::NonCanonical => {
            let mut bytes = whole(now, end, key, report, rng);
            bytes.push(0);
            bytes
        }
        Flaw::Range => whole(now, end, key, &origin_outside_the_set(report), rng),
        Flaw::Count => whole(now, end, key, &endless_tracks(report), rng),
        Flaw::Noise => {
            let length = 1 + uniform_below(rng, MAX_SESSION_MESSAGE as u64) as usize;
            noise(rng, length)
        }
        Flaw::Session => altered(now, end, key, report, rng, |outer| outer.session = Nonce(!outer.session.0)),
        Flaw::Version => altered(now, end, key, report, rng, |outer| outer.version = SESSION_VERSION + 1),
        Flaw::Jump => {
            end.skip(JUMP);
            whole(now, end, key, report, rng)
        }
        Flaw::Origin => whole(now, end, key, &said_to_be_of_no_vehicle(report), rng),
    }
}

/// The next record in which one thing of the session layer is made otherwise.
fn altered(
    now: Instant,
    end: &mut End,
    key: &Key,
    report: &[u8],
    rng: &mut ChaCha8Rng,
    make: impl FnOnce(&mut SessionMessage<'_>),
) -> Vec<u8> {
    let signed = key.sign(Purpose::Report, report);
    let mut outer = end.session_message(now, SessionBody::Report(signed.as_slice().into()), rng);
    make(&mut outer);
    codec::encode(&outer)
}

/// A sound record around a signed `report`.
fn whole(now: Instant, end: &mut End, key: &Key, report: &[u8], rng: &mut ChaCha8Rng) -> Vec<u8> {
    let signed = key.sign(Purpose::Report, report);
    end.say(now, SessionBody::Report(signed.as_slice().into()), rng)
}

/// The first field of a report, behind the array's head, is its origin: here one that no node has.
fn origin_outside_the_set(report: &[u8]) -> Vec<u8> {
    let mut bytes = report[..1].to_vec();
    bytes.extend_from_slice(&[0x18, 0x63]);
    bytes.extend_from_slice(&report[2..]);
    bytes
}

/// A message whose origin is of the closed set but no vehicle's.
fn said_to_be_of_no_vehicle(report: &[u8]) -> Vec<u8> {
    let mut bytes = report[..1].to_vec();
    bytes.extend_from_slice(&codec::encode(&NodeId::OPERATOR));
    bytes.extend_from_slice(&report[2..]);
    bytes
}

/// The last field of a report is its list of tracks, empty here: replaced by one of 2⁶⁴ − 1 items.
fn endless_tracks(report: &[u8]) -> Vec<u8> {
    let mut bytes = report[..report.len() - 1].to_vec();
    bytes.push(0x9b);
    bytes.extend_from_slice(&[0xff; 8]);
    bytes
}
