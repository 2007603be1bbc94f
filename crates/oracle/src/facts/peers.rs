//! Reports of an admitted teammate in bad faith, record by record: those that the gateway let in, and the distance
//! from the truth to which those have led.
//!
//! The insider names each report before it sends it; the gateway names each report that it accepts. Arrival itself
//! is `delivery`'s to establish.

use std::collections::BTreeMap;

use evidence::{Evidence, Micros};
use instrument::{Any, Note};
use wire::event::{Event, Interface};
use wire::id::{PeerId, RecordId};

use evidence::claims::Claims;

/// Longest way of a record from the insider to the gateway's verdict.
const WAY: Micros = 1_000_000;

/// Adds up the claims; `reaction` is when the unit under test first restricted itself.
pub fn claims(evidence: &Evidence, reaction: Option<Micros>) -> Claims {
    let mut let_in: BTreeMap<RecordId, Vec<Micros>> = BTreeMap::new();
    for w in &evidence.entries {
        if let Any::Service(Event::Accepted { at: Interface::Uplink, record, peer: PeerId::UNIT_B, .. }) = w.entry.event
        {
            let_in.entry(record).or_default().push(w.at);
        }
    }
    let mut claims = Claims::default();
    for w in &evidence.entries {
        let Any::Instrument(Note::Claimed { record, off_mm }) = w.entry.event else { continue };
        claims.said += 1;
        let times = let_in.get(&record).map_or(&[][..], Vec::as_slice);
        let Some(at) = times.iter().find(|at| **at >= w.at && **at - w.at <= WAY) else { continue };
        claims.accepted += 1;
        if reaction.is_none_or(|reaction| *at < reaction) {
            claims.believed_mm = claims.believed_mm.max(off_mm);
        }
    }
    claims
}
