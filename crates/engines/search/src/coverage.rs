//! Semantic coverage of a trial: situations that earlier trials may not have shown.
//!
//! A *point* of coverage is a situation of the platform at a decision: mode × authority × modalities that last came × decision
//! (accepted in which bucket of age, refused for which reason, changed for which cause, shown how old). Beside these there are
//! *steps*: the approach of a trial to the limit, in tenths of the way, so that a trial that comes nearer than any before is
//! as new as one with a new situation. Judging properties is left to the oracle.

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

use std::collections::BTreeSet;

use evidence::{Evidence, Witnessed};
use ground_truth::{Any, Note};
use oracle::{AT_LIMIT, Approaches};
use sha2::{Digest, Sha256};
use wire::event::Event;
use wire::id::{NodeId, UnitId};
use wire::mode::Mode;

/// Points and steps, by digest.
pub type Coverage = BTreeSet<u64>;

/// Number of steps that the way to a limit is divided into.
const STEPS: u32 = 10;

/// Situation of the platform under test at a decision.
#[derive(Debug)]
struct Situation {
    mode: Mode,
    authority: bool,
    live: String,
}

/// Coverage of a trial with these approaches to the limits.
pub(super) fn measure(evidence: &Evidence, approaches: &Approaches) -> Coverage {
    let mut covered = Coverage::new();
    for (limit, way) in approaches {
        // A trial that came near a limit also passed every farther step.
        let steps = (way / (AT_LIMIT / STEPS)).min(STEPS);
        covered.extend((0..=steps).map(|step| point(&format!("{limit:?} {step}"))));
    }
    let mut now = Situation { mode: Mode::Idle, authority: false, live: String::new() };
    for w in evidence.entries.iter().filter(|w| w.at <= evidence.duration) {
        follow(&mut now, w);
        if let Some(decided) = decided(w, evidence.bounds.freshness_ms) {
            covered.insert(point(&format!("{:?} {} {} {decided}", now.mode, now.authority, now.live)));
        }
    }
    covered
}

fn follow(now: &mut Situation, w: &Witnessed) {
    match w.entry.event {
        Any::Service(Event::Transition { to, .. }) if w.entry.node == NodeId::UNIT_A => now.mode = to,
        Any::Service(Event::Minted { .. }) if w.entry.node == NodeId::UNIT_A => now.authority = true,
        Any::Service(Event::Revoked { .. } | Event::Acted { .. }) if w.entry.node == NodeId::UNIT_A => {
            now.authority = false
        }
        Any::Service(Event::FrameSeen { present, .. }) => now.live = format!("{present:?}"),
        _ => {}
    }
}

/// The decision as text, coarse enough that similar ones are equal: numbers in buckets, no names of records.
fn decided(w: &Witnessed, freshness_ms: u64) -> Option<String> {
    let node = w.entry.node;
    match w.entry.event {
        Any::Service(Event::Accepted { at, age, .. }) => {
            let bucket = age.map(|age| age.0 * 4 / (freshness_ms * 1000).max(1));
            Some(format!("{node} accepted {at:?} {bucket:?}"))
        }
        Any::Service(Event::Refused { at, reason, .. }) => Some(format!("{node} refused {at:?} {reason:?}")),
        Any::Service(Event::Transition { from, to, cause, .. }) => {
            Some(format!("{node} {from:?} {to:?} {}", cause.label()))
        }
        Any::Service(Event::Revoked { cause, .. }) => Some(format!("{node} revoked {}", cause.label())),
        Any::Service(Event::Displayed { unit: UnitId::A, mode, authority, freshness, .. }) => {
            Some(format!("shown {mode:?} {} {freshness:?}", authority.is_some()))
        }
        Any::Service(Event::CommandShown { shown, .. }) => Some(format!("shown {shown:?}")),
        Any::Service(Event::Stored { kind, .. }) => Some(format!("{node} stored {:?}", kind.name())),
        Any::Service(Event::Executed { kind, refused, .. }) => {
            Some(format!("{node} executed {:?} {refused:?}", kind.name()))
        }
        Any::Instrument(Note::GuardSaw { verdict, .. }) => Some(format!("{node} guard {}", verdict.name())),
        Any::Service(Event::Session { peer, open }) => Some(format!("{node} session {peer:?} {open}")),
        Any::Service(Event::SessionLost { peer }) => Some(format!("{node} lost {peer:?}")),
        Any::Service(Event::Inconsistent { unit, finding, .. }) => {
            Some(format!("{node} inconsistent {unit:?} {finding:?}"))
        }
        _ => None,
    }
}

fn point(text: &str) -> u64 {
    let digest: [u8; 32] = Sha256::digest(text.as_bytes()).into();
    digest.iter().take(8).fold(0, |hash, byte| hash << 8 | u64::from(*byte))
}
