//! Receipts of a hostile broker's actions on publications of the command plane.
//!
//! A receipt is the broker's entry against the publication that the ingress of the receiving client saw come out of its
//! stream, by the hash of the payload. For one that was not passed on, its sender must have sent it, and that ingress must
//! have seen others but not this one.

use evidence::{Evidence, Micros, Witnessed};
use ground_truth::{Action, Any, Note, Sight};
use wire::core::Side;
use wire::event::Event;
use wire::feed::CommandStage;
use wire::id::NodeId;

use super::window::Window;
use crate::facts::SLACK;
use crate::facts::stream::sightings;

/// Part of a delay by which the broker's clock may have run ahead of the trace's, as a divisor.
const DRIFT: u64 = 1_000;
/// Longest time from a sender's own entry to the broker's.
const ON_THE_WAY: Micros = 1_000_000;

/// The first entry of `wanted` within `window` that the client's ingress confirms.
pub(crate) fn receipt(evidence: &Evidence, wanted: Action, window: Window) -> Option<Micros> {
    let claims = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Instrument(Note::Attack { action, side, hash, delay, .. })
            if action == wanted && w.entry.node == NodeId::INSIDER_BROKER && window.contains(w.at) =>
        {
            Some((w.at, side, hash, delay.0))
        }
        _ => None,
    });
    claims
        .into_iter()
        .find(|(claimed_at, side, hash, delay)| {
            let seen: Vec<Micros> = delivered(evidence, *side, Some(*hash)).collect();
            match wanted {
                Action::Drop => {
                    // A stream on which nothing came out may be cut: that is no proof of one dropped publication.
                    let passed_others = delivered(evidence, *side, None).next().is_some();
                    passed_others && seen.is_empty() && publisher_sent(evidence, *side, *claimed_at)
                }
                Action::Delay => seen.iter().any(|seen_at| seen_at + delay / DRIFT >= claimed_at + delay),
                Action::Duplicate | Action::Replay => {
                    seen.len() > 1 && seen.iter().any(|seen_at| seen_at >= claimed_at)
                }
                _ => seen.iter().any(|seen_at| seen_at >= claimed_at),
            }
        })
        .map(|(claimed_at, ..)| claimed_at)
}

/// Times at which the ingress of the client on `side` saw this payload, or any, come out of its stream.
fn delivered(evidence: &Evidence, side: Side, wanted: Option<u64>) -> impl Iterator<Item = Micros> {
    let client = match side {
        Side::Client => evidence.under.guard(),
        Side::Server => NodeId::GATEWAY.guard(),
    };
    let at_client = sightings(evidence).filter(move |s| Some(s.ingress) == client && s.sight == Sight::Delivered);
    at_client.filter(move |s| wanted.is_none_or(|wanted| wanted == s.hash)).map(|s| s.at)
}

/// True if the publisher towards `side` says that it had a message to publish just before. Its entry may come after
/// the broker's, by the time that an entry lags behind its event.
fn publisher_sent(evidence: &Evidence, side: Side, claimed_at: Micros) -> bool {
    let before = |w: &&Witnessed| w.at <= claimed_at + SLACK && claimed_at <= w.at + ON_THE_WAY;
    evidence.entries.iter().filter(before).any(|w| match (side, w.entry.event) {
        (Side::Client, Any::Service(Event::Staged { stage: CommandStage::Sent, .. })) => {
            w.entry.node == NodeId::GATEWAY
        }
        (Side::Server, Any::Service(Event::Executed { .. } | Event::Stored { .. })) => {
            w.entry.node == evidence.under.node()
        }
        _ => false,
    })
}
