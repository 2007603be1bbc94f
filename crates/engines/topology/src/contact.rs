//! Conversion of ground stations and an orbit to a contact plan for both ends of the unit's link, and to the medium of
//! its relays.

use adversary::plan::{Medium, Stretch};
use config::contact::{Contact, Contacts};
use config::platform::Body;
use scenario::{Scenario, Setup, Station};
use spacecraft::orbit::Orbit;
use wire::time::Span;

/// Time beyond the end of a trial for which its plan is made: what is under way then still arrives.
const BEYOND_S: f64 = 60.0;

/// Most stretches into which a trial is cut to state the time of travel. Within one of a second the distance changes by 7.6 km, 25 µs.
const STRETCHES: f64 = 200.0;

/// Speed of light, m/s.
const LIGHT_M_S: f64 = 299_792_458.0;

/// Contacts of the unit's link, and the medium that its relays are in.
#[derive(Clone, Debug, Default)]
pub(super) struct Contacted {
    pub(super) contacts: Contacts,
    pub(super) medium: Medium,
}

/// The plan of a trial; one that always carries where the scenario has no stations.
pub(super) fn plan(scenario: &Scenario, setup: &Setup) -> Contacted {
    let Body::Satellite(numbers) = setup.platform.body() else { return Contacted::default() };
    let pass = numbers.pass();
    let Ok(orbit) = Orbit::new(&pass.elements) else { return Contacted::default() };
    let stations = &scenario.conditions.station;
    let until_s = scenario.duration_s.get() + BEYOND_S;
    let seen = |station: &Station| station.sees(&orbit, pass.start_s, pass.start_s + until_s);
    let mut windows: Vec<(u64, u64)> = stations
        .iter()
        .flat_map(seen)
        .map(|window| (ms(window.rise - pass.start_s), ms(window.set - pass.start_s)))
        .filter(|(rise, set)| rise < set)
        .collect();
    windows.sort_unstable();
    let merged = merged(windows);
    let travel_us = |at_ms: u64| {
        let time = pass.start_s + at_ms as f64 / 1000.0;
        let ranges = stations.iter().map(|station| station.look(&orbit, time).range_m);
        let nearest = ranges.fold(f64::INFINITY, f64::min);
        (nearest / LIGHT_M_S * 1e6) as u64
    };
    // Whole seconds: a trial of up to 140 s has steps of one.
    let step_ms = (until_s / STRETCHES).ceil() as u64 * 1000;
    let medium = merged.iter().flat_map(|window| stretches(*window, step_ms, &travel_us)).collect();
    let contact = |(from, until): (u64, u64)| Contact { from: Span::ms(from), until: Span::ms(until) };
    let contacts = Contacts::new(merged.into_iter().map(contact).collect());
    Contacted { contacts: contacts.expect("invariant: four stations, merged, within an hour"), medium: Medium(medium) }
}

fn ms(seconds: f64) -> u64 {
    (seconds.max(0.0) * 1000.0) as u64
}

/// Windows in order, those that meet as one.
fn merged(windows: Vec<(u64, u64)>) -> Vec<(u64, u64)> {
    let mut merged: Vec<(u64, u64)> = Vec::new();
    for (from, until) in windows {
        match merged.last_mut() {
            Some(last) if from <= last.1 => last.1 = last.1.max(until),
            Some(_) | None => merged.push((from, until)),
        }
    }
    merged
}

/// A window, cut at whole steps, each part with the time of travel at its middle.
fn stretches((from, until): (u64, u64), step_ms: u64, travel_us: &impl Fn(u64) -> u64) -> Vec<Stretch> {
    let starts = (from / step_ms..=until / step_ms).map(|step| (step * step_ms).max(from));
    let part = |from_ms: u64| {
        let until_ms = ((from_ms / step_ms + 1) * step_ms).min(until);
        Stretch { from_ms, until_ms, travel_us: travel_us(u64::midpoint(from_ms, until_ms)) }
    };
    starts.map(part).filter(|part| part.from_ms < part.until_ms).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_that_meet_are_one() {
        assert_eq!(merged(vec![(0, 20), (10, 15), (20, 30), (31, 40)]), [(0, 30), (31, 40)]);
    }

    #[test]
    fn stretches_fill_their_window() {
        let parts = stretches((1_500, 4_000), 1_000, &|time| time);
        let ends: Vec<(u64, u64, u64)> = parts.iter().map(|p| (p.from_ms, p.until_ms, p.travel_us)).collect();
        assert_eq!(ends, [(1_500, 2_000, 1_750), (2_000, 3_000, 2_500), (3_000, 4_000, 3_500)]);
    }
}
