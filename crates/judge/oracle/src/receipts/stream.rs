//! Receipts of actions on a byte stream: the relay's entry against the far end's ingress.
//!
//! The two share the name of the direction and the place in it (`wire::stream`). Held bytes must come in later by their delay;
//! damaged ones must come in damaged, byte for byte; a direction that was ended must be over at the place where it was
//! ended, without this end having hung up first. A relay whose entry does not fit the sightings has no receipt.

use evidence::{Evidence, Micros};
use ground_truth::{Any, Note, Sight, StreamEffect};
use wire::core::Side;
use wire::id::NodeId;

use super::window::Window;
use crate::facts::stream::{StreamSighting, sightings};

/// Part of a delay by which the relay's clock may have run ahead of the trace's, as a divisor: clocks of hosts drift by
/// 50 ppm at most, so a thousandth leaves room.
const DRIFT: u64 = 1_000;

/// A relay's entry: time, side, direction and place in it, and delay.
#[derive(Clone, Copy)]
struct StreamClaim {
    at: Micros,
    side: Side,
    stream: u64,
    offset: u64,
    length: u32,
    hash: u64,
    delay: Micros,
}

/// The first entry of `wanted` within `window` that the ingress of its far end confirms.
pub(crate) fn receipt(evidence: &Evidence, wanted: StreamEffect, window: Window) -> Option<Micros> {
    let claims = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Instrument(Note::Tampered { deed, side, stream, offset, length, hash, delay })
            if deed == wanted && w.entry.node == NodeId::RELAY_COMMAND && window.contains(w.at) =>
        {
            Some(StreamClaim { at: w.at, side, stream, offset, length, hash, delay: delay.0 })
        }
        _ => None,
    });
    claims.into_iter().find(|claim| confirmed(evidence, wanted, *claim)).map(|claim| claim.at)
}

fn confirmed(evidence: &Evidence, deed: StreamEffect, claim: StreamClaim) -> bool {
    let mut seen = seen_at_far_end(evidence, claim);
    match deed {
        StreamEffect::Held => seen
            .find(|s| s.sight == Sight::Arrived && s.offset + u64::from(s.length) > claim.offset)
            .is_some_and(|first| first.at + claim.delay / DRIFT >= claim.at + claim.delay),
        StreamEffect::Damaged => seen.any(|s| {
            let same = (s.offset, s.length, s.hash) == (claim.offset, claim.length, claim.hash);
            s.sight == Sight::Arrived && same && s.at >= claim.at
        }),
        // Bytes still held are lost with the connection, so the end may come before the place.
        StreamEffect::HalfClosed | StreamEffect::Reset => {
            let last = seen.find(|s| matches!(s.sight, Sight::Closed | Sight::HungUp));
            let in_place = |s: &StreamSighting| match deed {
                StreamEffect::HalfClosed => s.offset == claim.offset,
                StreamEffect::Reset | StreamEffect::Held | StreamEffect::Damaged => s.offset <= claim.offset,
            };
            last.is_some_and(|s| {
                s.sight == Sight::Closed && in_place(&s) && s.at >= claim.at && s.at < evidence.duration
            })
        }
    }
}

/// Sightings of the ingress at the side that the claim leads to, in its direction, in order.
fn seen_at_far_end(evidence: &Evidence, claim: StreamClaim) -> impl Iterator<Item = StreamSighting> {
    let ingress = match claim.side {
        Side::Client => evidence.under.guard(),
        Side::Server => NodeId::BROKER.guard(),
    };
    sightings(evidence).filter(move |s| s.stream == claim.stream && Some(s.ingress) == ingress)
}
