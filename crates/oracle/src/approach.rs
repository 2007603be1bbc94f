//! Approach of a trial to each limit that a property states: the guide of a search, and the result of one without a
//! finding.
//!
//! In millionths of the way, a million being at the limit as the platform's bounds state it, without the slack that the
//! properties allow for clocks and periods. It is no verdict: an event without a way to it (an order executed twice) has no limit
//! here, and a broken property is `properties`' to find.

use std::collections::BTreeMap;

use evidence::{Evidence, Micros};
use instrument::{Any, Note, Sensor};
use serde::{Deserialize, Serialize};
use wire::bounds::Bounds;
use wire::event::{Event, Freshness};
use wire::id::NodeId;
use wire::mode::{Cause, Mode};

use super::arrived::Receipt;
use super::receipt;
use super::{Timeline, contact, link};

/// A limit that has a way to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Limit {
    /// P1: how old the confirmation of an act may be.
    Confirmation,
    /// P1: how long authority may be held.
    Authority,
    /// P2: how long a unit may stay nominal without a sensor.
    Loss,
    /// P3: how long it may go on without its localisation.
    Blindness,
    /// P3: time for which it may go on while no timely record comes to the gateway.
    Uplink,
    /// P3: time for which it may go on while no timely record comes to it.
    Downlink,
    /// P4: the distance that is kept to the fence.
    Fence,
    /// P5: age that an accepted record may have.
    Age,
    /// P7: age, or time of error, that a value shown as fresh may have.
    Display,
    /// P8: how late an order may be executed.
    Order,
    /// P9: how soon DEGRADED may end.
    Recovery,
    /// P11: how far from its class an act may be.
    Object,
}

impl Limit {
    /// As a report tells it, with the property that states it.
    pub fn told(self) -> &'static str {
        match self {
            Limit::Confirmation => "P1, age of an act's confirmation",
            Limit::Authority => "P1, authority held",
            Limit::Loss => "P2, nominal without a sensor",
            Limit::Blindness => "P3, going on without localisation",
            Limit::Uplink => "P3, going on with nothing timely at the gateway",
            Limit::Downlink => "P3, going on with nothing timely at the unit",
            Limit::Fence => "P4, distance kept to the fence",
            Limit::Age => "P5, age of what is accepted",
            Limit::Display => "P7, age of what is shown as fresh",
            Limit::Order => "P8, lateness of an order",
            Limit::Recovery => "P9, DEGRADED ended early",
            Limit::Object => "P11, distance of an act from its class",
        }
    }

    /// Length of it, where it is a time: the rest of the way to it is one too then.
    pub fn ms(self, bounds: &Bounds) -> Option<u64> {
        match self {
            Limit::Confirmation | Limit::Order => Some(bounds.command_limit_ms),
            Limit::Authority => Some(bounds.authority_ms),
            Limit::Loss => Some(bounds.to_degraded_ms),
            Limit::Blindness | Limit::Uplink | Limit::Downlink => Some(bounds.to_hold_safe_ms),
            Limit::Age => Some(bounds.freshness_ms),
            Limit::Display => Some(bounds.freshness_ms + bounds.telemetry_period_ms),
            Limit::Recovery => Some(bounds.hysteresis_ms),
            Limit::Fence | Limit::Object => None,
        }
    }
}

/// Of each limit the furthest that anything came, in millionths of the way.
pub type Approaches = BTreeMap<Limit, u32>;

/// At a limit.
pub const AT_LIMIT: u32 = 1_000_000;

/// That of a trial.
pub fn approaches(evidence: &Evidence) -> Approaches {
    let line = Timeline::of(evidence);
    let receipt = receipt::find(evidence);
    let mut nearest = Approaches::new();
    let mut came = |limit: Limit, way: u32| {
        let furthest = nearest.entry(limit).or_default();
        *furthest = way.max(*furthest);
    };
    let timed = spells(evidence, &line, &receipt).into_iter().chain(orders(evidence, &line));
    timed.for_each(|(limit, us)| came(limit, part(us, limit_us(limit, &evidence.bounds))));
    for (at, event) in evidence.entries.iter().filter(|w| w.at <= evidence.duration).map(|w| (w.at, &w.entry.event)) {
        seen(at, event, evidence, &line).into_iter().for_each(|(limit, way)| came(limit, way));
    }
    // The only one that is come near to from above.
    let least = limit_us(Limit::Recovery, &evidence.bounds);
    recoveries(&line).for_each(|took| came(Limit::Recovery, part(least, took)));
    nearest
}

/// Margins that one event shows by itself.
fn seen(at: Micros, event: &Any, evidence: &Evidence, line: &Timeline) -> Vec<(Limit, u32)> {
    let bounds = &evidence.bounds;
    let timed = |limit: Limit, us: u64| (limit, part(us, limit_us(limit, bounds)));
    match *event {
        Any::Service(Event::Accepted { age: Some(age), .. }) => vec![timed(Limit::Age, age.0)],
        Any::Service(Event::Displayed { unit, freshness: Freshness::Fresh, age, mode, .. })
            if unit == evidence.under.unit =>
        {
            vec![timed(Limit::Display, age.0.max(at - last_in(line, mode, at)))]
        }
        Any::Instrument(Note::Truth { unit, fence_mm, .. }) if unit == evidence.under.unit => {
            // How much of the distance that is kept to the fence is used up.
            let kept = u64::from(bounds.fence_margin_mm);
            let left = u64::try_from(fence_mm).unwrap_or(0).min(kept);
            vec![(Limit::Fence, part(kept - left, kept))]
        }
        Any::Instrument(Note::PlantAct { command, distance_mm, .. }) => {
            let given = line.intended.iter().find(|(_, id, _)| *id == command).map(|(given, ..)| *given);
            let confirmed = given.map(|given| timed(Limit::Confirmation, at.saturating_sub(given)));
            let off = (Limit::Object, part(u64::from(distance_mm), u64::from(bounds.designation_mm)));
            confirmed.into_iter().chain([off]).collect()
        }
        _ => Vec::new(),
    }
}

/// Delays of executed orders, microseconds.
fn orders(evidence: &Evidence, line: &Timeline) -> Vec<(Limit, u64)> {
    let executed = line.executed.iter().filter(|(at, ..)| *at <= evidence.duration);
    let late = executed.filter_map(|(at, id, _)| {
        let (given, ..) = line.intended.iter().find(|(_, command, _)| command == id)?;
        Some((Limit::Order, at.saturating_sub(line.due(*id, *given))))
    });
    late.collect()
}

/// For how long something lasted that may not last, microseconds.
fn spells(evidence: &Evidence, line: &Timeline, receipt: &Receipt) -> Vec<(Limit, u64)> {
    let nominal = |mode: Mode| matches!(mode, Mode::Ready | Mode::PrepareToAct);
    let moving = |mode: Mode| !matches!(mode, Mode::HoldSafe | Mode::Idle);
    let mut spells = Vec::new();
    for fault in receipt.faults.iter().filter(|f| f.is_loss()) {
        let span = (fault.start, fault.end.min(evidence.duration));
        spells.push((Limit::Loss, went_on(line, span, nominal)));
        if fault.sensor == Sensor::Localisation {
            spells.push((Limit::Blindness, went_on(line, span, moving)));
        }
    }
    for (limit, node) in [(Limit::Uplink, NodeId::GATEWAY), (Limit::Downlink, evidence.under.node())] {
        let silences = link::silences(evidence, receipt, node).into_iter();
        let owed = silences.filter(|(last, at)| contact::spans(evidence, *last).is_none_or(|due| *at > due));
        spells.extend(owed.map(|silence| (limit, went_on(line, silence, moving))));
    }
    let ends = line.changes.iter().skip(1).map(|c| c.at).chain([evidence.duration]);
    let held = line.changes.iter().zip(ends).filter(|(c, _)| c.to == Mode::PrepareToAct);
    spells.extend(held.map(|(c, until)| (Limit::Authority, until.saturating_sub(c.at))));
    spells
}

/// Duration of each DEGRADED that ended because all was well, microseconds.
fn recoveries(line: &Timeline) -> impl Iterator<Item = u64> + '_ {
    line.changes.iter().filter(|c| c.cause == Cause::Recovered).map(|change| {
        let since = line.changes.iter().rev().find(|c| c.to == Mode::Degraded && c.at <= change.at);
        change.at - since.map_or(0, |c| c.at)
    })
}

/// Time from the beginning of `span` for which the unit stayed in modes that satisfy `test`, microseconds.
fn went_on(line: &Timeline, (from, to): (Micros, Micros), test: impl Fn(Mode) -> bool) -> u64 {
    if !test(line.mode_at(from)) {
        return 0;
    }
    line.first_change(from, |c| !test(c.to)).map_or(to, |c| c.at.min(to)).saturating_sub(from)
}

/// Time at which the unit was last in `mode`, at `at` or before; at its start where it never was.
fn last_in(line: &Timeline, mode: Mode, at: Micros) -> Micros {
    if line.mode_at(at) == mode {
        return at;
    }
    line.changes.iter().rev().find(|c| c.at <= at && c.from == mode).map_or(0, |c| c.at)
}

fn limit_us(limit: Limit, bounds: &Bounds) -> u64 {
    limit.ms(bounds).unwrap_or(u64::MAX).saturating_mul(1000)
}

fn part(of: u64, whole: u64) -> u32 {
    let millionths = u128::from(of) * u128::from(AT_LIMIT) / u128::from(whole.max(1));
    u32::try_from(millionths).unwrap_or(u32::MAX)
}
