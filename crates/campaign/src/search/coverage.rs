//! What a trial showed that others may not have: its semantic coverage.
//!
//! A *point* of coverage is a situation of the platform at a decision: mode × authority × modalities that last came × what was
//! decided (accepted in which bucket of age, refused for which reason, changed for which cause, shown how old). Beside these
//! there are *steps*: how near a trial came to the limit of a property, in tenths of the way, so that a trial that comes nearer
//! than any before is as new as one that sees something new. Whether anything is broken is the oracle's to say.

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

use std::collections::BTreeSet;

use sha2::{Digest, Sha256};
use wire::event::{Event, Freshness};
use wire::id::{NodeId, UnitId};
use wire::mode::Mode;

use crate::oracle::{Evidence, Witnessed};

/// Points and steps, by a digest of what they are.
pub type Coverage = BTreeSet<u64>;

/// In how many steps the way to a limit is divided.
const STEPS: u64 = 10;

/// What the platform under test is in when something is decided.
#[derive(Debug)]
struct Situation {
    mode: Mode,
    authority: bool,
    live: String,
}

/// Everything that a trial covered.
pub(super) fn of(evidence: &Evidence) -> Coverage {
    let mut covered = Coverage::new();
    let mut now = Situation { mode: Mode::Idle, authority: false, live: String::new() };
    for w in evidence.entries.iter().filter(|w| w.at <= evidence.duration) {
        follow(&mut now, w);
        if let Some(decided) = decided(w, evidence.bounds.freshness_ms) {
            covered.insert(point(&format!("{:?} {} {} {decided}", now.mode, now.authority, now.live)));
        }
        if let Some((property, way)) = nearness(w, evidence) {
            // Who came near came by what is less near.
            covered.extend((0..=way.min(STEPS)).map(|step| point(&format!("{property} {step}"))));
        }
    }
    covered
}

fn follow(now: &mut Situation, w: &Witnessed) {
    match w.entry.event {
        Event::Transition { to, .. } if w.entry.node == NodeId::UNIT_A => now.mode = to,
        Event::Minted { .. } if w.entry.node == NodeId::UNIT_A => now.authority = true,
        Event::Revoked { .. } | Event::Acted { .. } if w.entry.node == NodeId::UNIT_A => now.authority = false,
        Event::FrameSeen { present, .. } => now.live = format!("{present:?}"),
        _ => {}
    }
}

/// What was decided, in few words: numbers in buckets, no names of records.
fn decided(w: &Witnessed, freshness_ms: u64) -> Option<String> {
    let node = w.entry.node;
    match w.entry.event {
        Event::Accepted { at, age, .. } => {
            let bucket = age.map(|age| age.0 * 4 / (freshness_ms * 1000).max(1));
            Some(format!("{node} accepted {at:?} {bucket:?}"))
        }
        Event::Refused { at, reason, .. } => Some(format!("{node} refused {at:?} {reason:?}")),
        Event::Transition { from, to, cause, .. } => Some(format!("{node} {from:?} {to:?} {}", cause.label())),
        Event::Revoked { cause, .. } => Some(format!("{node} revoked {}", cause.label())),
        Event::Displayed { unit: UnitId::A, mode, authority, freshness, .. } => {
            Some(format!("shown {mode:?} {authority} {freshness:?}"))
        }
        Event::CommandShown { shown, .. } => Some(format!("shown {shown:?}")),
        Event::Executed { kind, refused, .. } => Some(format!("{node} executed {:?} {refused:?}", kind.name())),
        Event::GuardSaw { verdict, .. } => Some(format!("{node} guard {}", verdict.name())),
        Event::Session { peer, open } => Some(format!("{node} session {peer:?} {open}")),
        Event::SessionLost { peer } => Some(format!("{node} lost {peer:?}")),
        Event::Inconsistent { unit, finding, .. } => Some(format!("{node} inconsistent {unit:?} {finding:?}")),
        _ => None,
    }
}

/// How far on the way to a property's limit an event is, in steps.
fn nearness(w: &Witnessed, evidence: &Evidence) -> Option<(&'static str, u64)> {
    let bounds = &evidence.bounds;
    match w.entry.event {
        // P5: the age of what is accepted, of Tf.
        Event::Accepted { age: Some(age), .. } => Some(("P5", age.0 * STEPS / (bounds.freshness_ms * 1000).max(1))),
        // P7: the age of what is shown as fresh, of Tf and a period.
        Event::Displayed { unit: UnitId::A, freshness: Freshness::Fresh, age, .. } => {
            Some(("P7", age.0 * STEPS / ((bounds.freshness_ms + bounds.telemetry_period_ms) * 1000).max(1)))
        }
        // P4: how much of the distance that is kept to the fence is used up.
        Event::Truth { unit: UnitId::A, fence_mm, .. } => {
            let kept = i64::from(bounds.fence_margin_mm.max(1));
            let left = i64::from(fence_mm).clamp(0, kept);
            Some(("P4", (kept - left).unsigned_abs() * STEPS / kept.unsigned_abs()))
        }
        // P11: the distance of an act from an object of its class.
        Event::PlantAct { distance_mm, .. } => {
            Some(("P11", u64::from(distance_mm) * STEPS / u64::from(bounds.designation_mm.max(1))))
        }
        _ => None,
    }
}

fn point(text: &str) -> u64 {
    let digest: [u8; 32] = Sha256::digest(text.as_bytes()).into();
    digest.iter().take(8).fold(0, |hash, byte| hash << 8 | u64::from(*byte))
}
