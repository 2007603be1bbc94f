//! Receipts of actions on a byte stream: the relay's entry against the far end's ingress.
//!
//! The two share the name of the direction and the place in it (`wire::stream`). Held bytes must come in so much later;
//! damaged ones must come in damaged, byte for byte; a direction that was ended must be over at the place where it was
//! ended, without this end having hung up first. A relay that says so and does otherwise has no receipt.

use evidence::{Evidence, Micros};
use instrument::{Any, Note, Sight, StreamEffect};
use wire::core::Side;
use wire::id::NodeId;

use crate::window::Window;

/// By how much of a delay the relay's clock may have run ahead of the trace's, as a divisor: clocks of hosts drift by
/// 50 ppm at most, so a thousandth leaves room.
const DRIFT: u64 = 1_000;

/// A relay's entry: time, side, place and direction, action, and duration.
#[derive(Clone, Copy)]
struct Told {
    at: Micros,
    side: Side,
    stream: u64,
    offset: u64,
    length: u32,
    hash: u64,
    delay: Micros,
}

/// An entry of an ingress.
#[derive(Clone, Copy)]
struct Seen {
    at: Micros,
    sight: Sight,
    offset: u64,
    length: u32,
    hash: u64,
}

/// The first entry of `wanted` within `window` that the ingress of its far end confirms.
pub(crate) fn receipt(evidence: &Evidence, wanted: StreamEffect, window: Window) -> Option<Micros> {
    let told = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Instrument(Note::Tampered { deed, side, stream, offset, length, hash, delay })
            if deed == wanted && w.entry.node == NodeId::RELAY_COMMAND && window.has(w.at) =>
        {
            Some(Told { at: w.at, side, stream, offset, length, hash, delay: delay.0 })
        }
        _ => None,
    });
    told.into_iter().find(|told| confirmed(evidence, wanted, *told)).map(|told| told.at)
}

fn confirmed(evidence: &Evidence, deed: StreamEffect, told: Told) -> bool {
    let mut seen = seen(evidence, told);
    match deed {
        StreamEffect::Held => seen
            .find(|s| s.sight == Sight::Arrived && s.offset + u64::from(s.length) > told.offset)
            .is_some_and(|first| first.at + told.delay / DRIFT >= told.at + told.delay),
        StreamEffect::Damaged => seen.any(|s| {
            let same = (s.offset, s.length, s.hash) == (told.offset, told.length, told.hash);
            s.sight == Sight::Arrived && same && s.at >= told.at
        }),
        // What was still held is lost with the connection, so the end may come before the place.
        StreamEffect::HalfClosed | StreamEffect::Reset => {
            let last = seen.find(|s| matches!(s.sight, Sight::Closed | Sight::HungUp));
            let in_place = |s: &Seen| match deed {
                StreamEffect::HalfClosed => s.offset == told.offset,
                StreamEffect::Reset | StreamEffect::Held | StreamEffect::Damaged => s.offset <= told.offset,
            };
            last.is_some_and(|s| {
                s.sight == Sight::Closed && in_place(&s) && s.at >= told.at && s.at < evidence.duration
            })
        }
    }
}

/// Sights of the ingress at the side that `told` leads to, of its direction, in order.
fn seen(evidence: &Evidence, told: Told) -> impl Iterator<Item = Seen> {
    let ingress = match told.side {
        Side::Client => evidence.under.guard(),
        Side::Server => NodeId::BROKER.guard(),
    };
    evidence.entries.iter().filter_map(move |w| match w.entry.event {
        Any::Instrument(Note::StreamSaw { sight, stream, offset, length, hash })
            if stream == told.stream && Some(w.entry.node) == ingress =>
        {
            Some(Seen { at: w.at, sight, offset, length, hash })
        }
        _ => None,
    })
}
