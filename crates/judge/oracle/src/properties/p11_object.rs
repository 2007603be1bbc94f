//! P11: no authority and no act on an object that was not designated, from the true object at the plant and the operator's order.

use ground_truth::{Any, Note};
use wire::command::CommandKind;
use wire::event::Event;
use wire::sensor::Class;

use super::limit::{Limit, LimitRow, millionths};
use super::{Finding, Property, finding};
use crate::facts::Facts;

pub(super) const LIMITS: [LimitRow; 1] = [LimitRow {
    limit: Limit::Object,
    name: "distance of an act from its class",
    length_ms: None,
    approach: |facts, _| farthest_act(facts),
}];

pub(super) fn check(facts: &Facts) -> Vec<Finding> {
    let mut found = acts_on_wrong_object(facts);
    found.extend(authority_over_wrong_track(facts));
    found
}

/// Acts on an object of another class, or too far from one of the designated class.
fn acts_on_wrong_object(facts: &Facts) -> Vec<Finding> {
    let within_mm = facts.evidence.bounds.designation_mm;
    let wrong = facts.evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Instrument(Note::PlantAct { class, distance_mm, .. })
            if class != Some(Class::Vehicle) || distance_mm > within_mm =>
        {
            let message = format!("act on {class:?} at {distance_mm} mm, vehicle within {within_mm} mm expected");
            Some(finding(Property::P11, w.at, message))
        }
        _ => None,
    });
    wrong.collect()
}

/// Authority on another track than the one that was ordered.
fn authority_over_wrong_track(facts: &Facts) -> Vec<Finding> {
    let Facts { evidence, timeline, .. } = facts;
    let mut found = Vec::new();
    for w in &evidence.entries {
        let Any::Service(Event::Minted { track, command, .. }) = w.entry.event else { continue };
        let ordered = timeline.executed.iter().any(|(_, id, kind)| *id == command && *kind == CommandKind::Arm(track));
        if w.entry.node == evidence.under.node() && !ordered {
            let message = format!("authority on track {}, which {command} is not about", track.0);
            found.push(finding(Property::P11, w.at, message));
        }
    }
    found
}

fn farthest_act(facts: &Facts) -> Option<u32> {
    let within_mm = u64::from(facts.evidence.bounds.designation_mm);
    let acts = facts.evidence.entries.iter().filter(|w| w.at <= facts.evidence.duration);
    let approaches = acts.filter_map(|w| match w.entry.event {
        Any::Instrument(Note::PlantAct { distance_mm, .. }) => Some(millionths(u64::from(distance_mm), within_mm)),
        _ => None,
    });
    approaches.max()
}
