//! Passes: how a ground station sees a satellite, and when it rises and sets.
//!
//! Refraction (0.1° at 5° elevation) and the travel of light (10 ms at most) are left out.

use super::{Tangent, seen_from_ground};
use crate::date::Date;
use crate::orbit::{Orbit, OrbitState, SPAN_S};
use crate::vector::{dot, norm};

/// Seconds between the times at which a pass is looked for. One that is shorter may be overlooked.
const STEP_S: f64 = 10.0;

/// Most passes that are listed.
pub const MOST_PASSES: usize = 1000;

/// Bisections of a step: 10 s end below a microsecond.
const BISECTIONS: u32 = 24;

/// A satellite as a station sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Elevation above the station's horizon, radians.
    pub elevation_rad: f64,
    /// Azimuth from north by east, radians in [-π, π].
    pub azimuth_rad: f64,
    /// Distance, metres.
    pub range_m: f64,
    /// Change of the distance, m/s.
    pub range_rate_m_s: f64,
}

/// One pass: from when to when the satellite is high enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Start, seconds since the orbit's epoch.
    pub rise: f64,
    /// End, seconds since the orbit's epoch.
    pub set: f64,
    /// Highest elevation between them, radians.
    pub highest_elevation: f64,
}

/// Elevation, azimuth and range of a satellite, from the station.
pub fn look(station: &Tangent, state: &OrbitState, date: Date) -> Look {
    let seen = seen_from_ground(state, date);
    let [east, north, up] = station.to_local(seen.position_m);
    let range_m = norm([east, north, up]);
    let direction = station.turned(seen.velocity_m_s);
    let range_rate_m_s = if range_m > 0.0 { dot([east, north, up], direction) / range_m } else { 0.0 };
    Look {
        elevation_rad: libm::atan2(up, (east * east + north * north).sqrt()),
        azimuth_rad: libm::atan2(east, north),
        range_m,
        range_rate_m_s,
    }
}

/// The passes in which the satellite is at least as high as `least_elevation`, radians, between two times, seconds
/// since the orbit's epoch, at most [`MOST_PASSES`]. Times beyond the orbit's [`SPAN_S`] are left out; a pass that is
/// under way at an end is cut there.
pub fn passes(station: &Tangent, orbit: &Orbit, from: f64, to: f64, least_elevation: f64) -> Vec<Window> {
    let mut found = Vec::new();
    // Also false for NaN.
    if from.partial_cmp(&to) != Some(std::cmp::Ordering::Less) {
        return found;
    }
    let (from, to) = (from.max(-SPAN_S), to.min(SPAN_S));
    let height = |time: f64| look(station, &orbit.state_at(time), orbit.epoch().plus_seconds(time)).elevation_rad;
    let up = |time: f64| height(time) >= least_elevation;
    let (mut time, mut rise) = (from, up(from).then_some(from));
    while time < to && found.len() < MOST_PASSES {
        let next = (time + STEP_S).min(to);
        match (rise, up(next)) {
            (None, true) => rise = Some(change(time, next, |time| !up(time))),
            (Some(since), false) => {
                found.push(window(since, change(time, next, up), height));
                rise = None;
            }
            (None, false) | (Some(_), true) => {}
        }
        time = next;
    }
    if let Some(since) = rise.filter(|_| found.len() < MOST_PASSES) {
        found.push(window(since, to, height));
    }
    found
}

/// Time between `from` and `to` at which `holds` ceases to be true.
fn change(mut from: f64, mut to: f64, holds: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (from + to);
        if holds(middle) { from = middle } else { to = middle }
    }
    0.5 * (from + to)
}

/// A pass with its highest elevation: the best of the steps, refined by ternary search over the two steps around it.
fn window(rise: f64, set: f64, height: impl Fn(f64) -> f64) -> Window {
    let (mut best, mut time) = (rise, rise);
    while time < set {
        if height(time) > height(best) {
            best = time;
        }
        time += STEP_S;
    }
    let (mut low, mut high) = ((best - STEP_S).max(rise), (best + STEP_S).min(set));
    for _ in 0..40 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if height(a) < height(b) { low = a } else { high = b }
    }
    Window { rise, set, highest_elevation: height(0.5 * (low + high)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::earth::GeodeticPlace;
    use crate::orbit::tests::elements;

    fn day() -> (Tangent, Orbit, Vec<Window>) {
        let station = Tangent::new(GeodeticPlace::of_degrees(52.5, 13.4, 40.0));
        let orbit = Orbit::new(&elements()).unwrap();
        let found = passes(&station, &orbit, 0.0, 86_400.0, 5.0_f64.to_radians());
        (station, orbit, found)
    }

    #[test]
    fn a_pass_starts_and_ends_at_the_least_elevation() {
        let (station, orbit, found) = day();
        assert!((4..9).contains(&found.len()), "{found:?}");
        let height =
            |t: f64| look(&station, &orbit.state_at(t), orbit.epoch().plus_seconds(t)).elevation_rad.to_degrees();
        for Window { rise, set, highest_elevation } in found {
            assert!((height(rise) - 5.0).abs() < 1e-5 && (height(set) - 5.0).abs() < 1e-5);
            let highest = (0..1000).map(|i| height(rise + (set - rise) * f64::from(i) / 999.0)).fold(0.0, f64::max);
            assert!((highest_elevation.to_degrees() - highest).abs() < 0.05, "{highest}");
        }
    }

    #[test]
    fn a_pass_that_is_cut_ends_at_the_cut() {
        let (station, orbit, found) = day();
        let Window { rise, set, .. } = found[0];
        let cut = passes(&station, &orbit, rise + 60.0, set - 60.0, 5.0_f64.to_radians());
        assert_eq!((cut[0].rise, cut[0].set), (rise + 60.0, set - 60.0));
    }

    #[test]
    fn range_rate_is_the_change_of_range() {
        let (station, orbit, found) = day();
        let look_at_time = |t: f64| look(&station, &orbit.state_at(t), orbit.epoch().plus_seconds(t));
        let time = found[0].rise + 100.0;
        let change = (look_at_time(time + 0.05).range_m - look_at_time(time - 0.05).range_m) / 0.1;
        assert!((change - look_at_time(time).range_rate_m_s).abs() < 1e-3);
    }

    #[test]
    fn no_time_has_no_pass() {
        let (station, orbit, _) = day();
        assert!(passes(&station, &orbit, 100.0, 0.0, 0.0).is_empty());
        assert!(passes(&station, &orbit, f64::NAN, 10.0, 0.0).is_empty());
        assert!(passes(&station, &orbit, 0.0, f64::NAN, 0.0).is_empty());
        assert!(passes(&station, &orbit, 1e9, 2e9, 0.0).is_empty());
    }
}
