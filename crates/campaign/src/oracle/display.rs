//! P7, from the display's own record: nothing is shown fresh beyond its limit, and what is shown fresh of the unit under test
//! was so there at some instant within the last telemetry period and *Tf*.
//!
//! What READY stands on is compared with what the unit went by: its mode, authority and failing guards have to be the unit's
//! own; of its place and its tracks the display may say less than the unit, never more. Commands are `planes`' to judge, the
//! age of what the gateway accepted is `stale`'s. Other units' words are not compared: one of them may be an insider, whose
//! word on itself says nothing.

use std::collections::BTreeMap;

use wire::event::{Event, Freshness};
use wire::id::{RecordId, UnitId};
use wire::mode::Mode;

use super::properties::SLACK;
use super::timeline::Timeline;
use super::{Evidence, Finding, Micros, Property, finding};

/// Judges P7.
pub(super) fn check(evidence: &Evidence, line: &Timeline) -> Vec<Finding> {
    let limit = (evidence.bounds.freshness_ms + evidence.bounds.telemetry_period_ms) * 1000 + SLACK;
    let mut accepted: BTreeMap<RecordId, Micros> = BTreeMap::new();
    for (at, record) in &line.accepted {
        accepted.entry(*record).or_insert(*at);
    }
    let mut found = Vec::new();
    for w in &evidence.entries {
        let Event::Displayed { unit, freshness: Freshness::Fresh, report, .. } = w.entry.event else { continue };
        if let Some(at) = accepted.get(&report).filter(|at| w.at.saturating_sub(**at) > limit) {
            let what = format!("{report} shown fresh {} ms after it was accepted", (w.at - at) / 1000);
            found.push(finding(Property::P7, w.at, what));
        }
        if unit == UnitId::A {
            let wrong = wrong(line, &w.entry.event, w.at.saturating_sub(limit), w.at);
            found.extend(wrong.map(|what| finding(Property::P7, w.at, what)));
        }
    }
    found
}

/// What of a picture that is shown as fresh was not so at any instant of `[from, to]`.
fn wrong(line: &Timeline, shown: &Event, from: Micros, to: Micros) -> Option<String> {
    let Event::Displayed { mode, authority, failing, placed, tracks_fresh, .. } = *shown else { return None };
    if !line.was_in(mode, from, to) {
        let was = line.mode_at(to).name();
        return Some(format!("{} shown fresh while the unit is {was}", mode.name()));
    }
    let held = |mode: &Mode| (*mode == Mode::PrepareToAct) == authority && line.was_in(*mode, from, to);
    if !Mode::ALL.iter().any(held) {
        return Some(format!("authority held is shown fresh as {authority}, and it was not so"));
    }
    if !line.went_by(from, to, |judged| judged.failing == failing) {
        let names: Vec<&str> = failing.iter().map(|guard| guard.name()).collect();
        return Some(format!("[{}] shown fresh as what fails, and it was not so", names.join(" ")));
    }
    if placed && !line.went_by(from, to, |judged| judged.placed) {
        return Some("a place shown fresh that was older at the unit".into());
    }
    let more = tracks_fresh > 0 && !line.went_by(from, to, |judged| judged.tracks >= tracks_fresh);
    more.then(|| format!("{tracks_fresh} tracks shown fresh, and the unit had fewer that were"))
}
