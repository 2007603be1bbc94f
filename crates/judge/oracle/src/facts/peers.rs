//! Reports of an admitted teammate in bad faith, record by record: the accepted ones, and their distance from the truth.
//!
//! The insider names each report before it sends it; the gateway names each report that it accepts. Arrival itself
//! is a matter of receipts.

use std::collections::BTreeMap;

use evidence::{Evidence, Micros};
use ground_truth::{Any, Note};
use wire::event::{Event, Interface};
use wire::id::{PeerId, RecordId};

use evidence::claims::Claims;

/// Longest time from the insider's entry on a record to the gateway's verdict.
const ACCEPTED_WITHIN: Micros = 1_000_000;

/// Adds up the claims; `reaction` is when the unit under test first restricted itself.
pub fn claims(evidence: &Evidence, reaction: Option<Micros>) -> Claims {
    let mut acceptances: BTreeMap<RecordId, Vec<Micros>> = BTreeMap::new();
    for w in &evidence.entries {
        if let Any::Service(Event::Accepted { at: Interface::Uplink, record, peer: PeerId::UNIT_B, .. }) = w.entry.event
        {
            acceptances.entry(record).or_default().push(w.at);
        }
    }
    let mut claims = Claims::default();
    for w in &evidence.entries {
        let Any::Instrument(Note::Claimed { record, off_mm }) = w.entry.event else { continue };
        claims.said += 1;
        let times = acceptances.get(&record).map_or(&[][..], Vec::as_slice);
        let Some(accepted_at) =
            times.iter().find(|accepted_at| **accepted_at >= w.at && **accepted_at - w.at <= ACCEPTED_WITHIN)
        else {
            continue;
        };
        claims.accepted += 1;
        if reaction.is_none_or(|reaction| *accepted_at < reaction) {
            claims.believed_mm = claims.believed_mm.max(off_mm);
        }
    }
    claims
}
