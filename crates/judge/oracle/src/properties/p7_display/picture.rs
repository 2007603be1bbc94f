//! The picture of a unit that is shown as fresh, from the display's own record.
//!
//! The basis of READY is compared with the unit's own: its mode, the track that it holds authority over and its
//! failing guards have to be the unit's own, its place one that it drove by; of its tracks the display may say less than the
//! unit, never more. Other units' words are not compared: one of them may be an insider, and its word on itself is no evidence.

use std::collections::BTreeMap;

use evidence::Micros;
use ground_truth::Any;
use wire::event::{Event, Freshness};
use wire::id::RecordId;
use wire::mode::Mode;

use super::{Finding, Property, finding};
use crate::facts::place::{FIX_BOUND, FIX_MM};
use crate::facts::timeline::Timeline;
use crate::facts::{Facts, SLACK};

/// Distance of a shown place from the way that the unit took itself to have gone, at most, millimetres: its pose is logged
/// a few times a second, and each fix in between may move it by no more than a fix is ever off.
const NEAR_MM: f64 = FIX_MM * FIX_BOUND;

/// Pictures shown as fresh beyond their limit, or that were not so at the unit within the last telemetry period and *Tf*.
pub(super) fn check(facts: &Facts) -> Vec<Finding> {
    let Facts { evidence, timeline, .. } = facts;
    let limit = (evidence.bounds.freshness_ms + evidence.bounds.telemetry_period_ms) * 1000 + SLACK;
    let mut accepted: BTreeMap<RecordId, Micros> = BTreeMap::new();
    for (accepted_at, record) in &timeline.accepted {
        // A record counts from its first acceptance: to accept it again makes it no fresher.
        accepted.entry(*record).or_insert(*accepted_at);
    }
    let mut found = Vec::new();
    for w in &evidence.entries {
        let Any::Service(Event::Displayed { unit, freshness: Freshness::Fresh, report, .. }) = w.entry.event else {
            continue;
        };
        if let Some(accepted_at) =
            accepted.get(&report).filter(|accepted_at| w.at.saturating_sub(**accepted_at) > limit)
        {
            let message = format!("{report} shown fresh {} ms after it was accepted", (w.at - accepted_at) / 1000);
            found.push(finding(Property::P7, w.at, message));
        }
        if unit == evidence.under.unit {
            let speed = f64::from(evidence.bounds.max_speed_mm_s);
            let wrong = wrong_part(timeline, &w.entry.event, w.at.saturating_sub(limit), w.at, speed);
            found.extend(wrong.map(|difference| finding(Property::P7, w.at, difference)));
        }
    }
    found
}

/// Part of a picture shown as fresh that was not so at any instant of `[from, to]`.
fn wrong_part(timeline: &Timeline, shown: &Any, from: Micros, to: Micros, speed_mm_s: f64) -> Option<String> {
    let Any::Service(Event::Displayed { mode, authority, failing, place, tracks_fresh, .. }) = *shown else {
        return None;
    };
    if !timeline.was_in(mode, from, to) {
        let was = timeline.mode_at(to).name();
        return Some(format!("{} shown fresh while the unit is {was}", mode.name()));
    }
    let held_none_in = |mode: &Mode| *mode != Mode::PrepareToAct && timeline.was_in(*mode, from, to);
    match authority {
        Some(track) if !timeline.held_authority_over(track, from, to) => {
            return Some(format!("authority over track {} shown fresh, and the unit had none over it", track.0));
        }
        None if !Mode::ALL.iter().any(held_none_in) => {
            return Some("no authority shown fresh, and the unit had some".into());
        }
        Some(_) | None => {}
    }
    if !timeline.judged_by(from, to, |judgement| judgement.failing == failing) {
        let names: Vec<&str> = failing.iter().map(|guard| guard.name()).collect();
        return Some(format!("[{}] shown fresh as what fails, and it was not so", names.join(" ")));
    }
    if let Some(place) = place {
        if !timeline.judged_by(from, to, |judgement| judgement.placed) {
            return Some("a place shown fresh that was older at the unit".into());
        }
        let off = distance_from_way(timeline, (place.x_mm, place.y_mm), from, to, speed_mm_s);
        if off.is_none_or(|off| off > NEAR_MM) {
            let off = off.map_or("nowhere".into(), |mm| format!("{mm:.0} mm from where"));
            return Some(format!("a place shown fresh that is {off} the unit took itself to be"));
        }
    }
    let more = tracks_fresh > 0 && !timeline.judged_by(from, to, |judgement| judgement.tracks >= tracks_fresh);
    more.then(|| format!("{tracks_fresh} tracks shown fresh, and the unit had fewer that were"))
}

/// Distance of `place` from the one at which the unit took itself to be in `[from, to]`, millimetres; none if it gave none by then.
/// Driving since its last logged fix does not count.
fn distance_from_way(timeline: &Timeline, place: (i32, i32), from: Micros, to: Micros, speed_mm_s: f64) -> Option<f64> {
    let first = timeline.stated_places.partition_point(|stated| stated.at <= from).saturating_sub(1);
    let end = timeline.stated_places.partition_point(|stated| stated.at <= to);
    let way = timeline.stated_places.get(first..end)?;
    let last = way.last()?;
    let since =
        distance_to_leg(place, last.place, last.place) - speed_mm_s * to.saturating_sub(last.fixed) as f64 / 1e6;
    let along = way.windows(2).map(|leg| distance_to_leg(place, leg[0].place, leg[1].place));
    Some(along.fold(since, f64::min).max(0.0))
}

/// Distance of `place` from the straight way between `a` and `b`, millimetres.
fn distance_to_leg(place: (i32, i32), a: (i32, i32), b: (i32, i32)) -> f64 {
    let minus = |p: (i32, i32), q: (i32, i32)| (f64::from(p.0) - f64::from(q.0), f64::from(p.1) - f64::from(q.1));
    let (way, to) = (minus(b, a), minus(place, a));
    let square = way.0 * way.0 + way.1 * way.1;
    let share = if square > 0.0 { ((to.0 * way.0 + to.1 * way.1) / square).clamp(0.0, 1.0) } else { 0.0 };
    (to.0 - share * way.0).hypot(to.1 - share * way.1)
}
