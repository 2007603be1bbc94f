//! P7: the display. No value is shown as fresh beyond its limit. A value of the unit under test that is shown as fresh
//! held there at some instant within the last telemetry period and *Tf*. Commands and lost sessions are shown as they
//! are.

mod age;
mod commands;
mod picture;
mod sessions;

use ground_truth::Any;
use wire::event::{Event, Freshness};

use super::limit::{Limit, LimitRow, longest};
use super::{BareGuest, Finding, Property, finding, not_judged};
use crate::facts::Facts;

pub(super) const BARE_GUEST: BareGuest = BareGuest {
    check: not_judged,
    not_judged: Some(("P7", "the display shows the platform's state, not the guest's")),
};

pub(super) const LIMITS: [LimitRow; 1] = [LimitRow {
    limit: Limit::Display,
    name: "age of what is shown as fresh",
    length_ms: Some(|bounds| bounds.freshness_ms + bounds.telemetry_period_ms),
    approach: |facts, length_us| longest(fresh_ages(facts), length_us),
}];

pub(super) fn check(facts: &Facts) -> Vec<Finding> {
    let mut found = picture::check(facts);
    found.extend(commands::check(facts));
    found.extend(sessions::check(facts));
    found.extend(age::check(facts));
    found
}

/// Age of each picture shown as fresh, or the time since the unit was in the mode that it shows, microseconds.
fn fresh_ages(facts: &Facts) -> impl Iterator<Item = u64> {
    let Facts { evidence, timeline, .. } = facts;
    evidence.entries.iter().filter(|w| w.at <= evidence.duration).filter_map(|w| match w.entry.event {
        Any::Service(Event::Displayed { unit, freshness: Freshness::Fresh, age, mode, .. })
            if unit == evidence.under.unit =>
        {
            Some(age.0.max(w.at - timeline.last_in(mode, w.at)))
        }
        _ => None,
    })
}
