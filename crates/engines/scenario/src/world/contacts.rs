//! A pass of a satellite over a region, with a plan of its payload and several contacts: places to look at in the order of the plan, and ground stations of which
//! each sees the satellite for a part of the pass.
//!
//! A metre of the map is `scale_m` metres of ground. The orbit and the start in it are the platform's: a drawn contact begins and ends at drawn
//! times, and its station is put where the orbit makes it so.

use config::platform::Body;
use spacecraft::earth::{GeodeticPlace, place_of, seen_from_ground};
use spacecraft::orbit::Orbit;

use super::chance::Chance;
use super::plan::{Plan, distance};
use crate::footprint::At;
use crate::value::{List, Real};
use crate::{MAX_STATIONS, Platform, Station};

/// End of the last contact, seconds: after the pass.
const LAST_S: f64 = 260.0;
/// Number of the draws of stations; families have those below.
const STATIONS: u64 = 1001;
/// Largest distance of a station from the ground track, metres.
const FARTHEST_M: f64 = 2.2e6;
/// Bisections of that: to a metre.
const BISECTIONS: u32 = 22;

/// The region with its catalogued places, and the plan.
pub(super) fn plan(chance: &mut Chance) -> Plan {
    let half = [chance.uniform(36.0, 45.0), chance.uniform(36.0, 45.0)];
    let mut plan = Plan::new([8.0 - half[0], 8.0 - half[1]], 0.0, half);
    let inside = |chance: &mut Chance| half.map(|side| chance.uniform(6.0 - side, side - 6.0));
    let mut last = plan.start.0;
    for _ in 0..chance.integer(6, 9) {
        let tries = [inside(chance), inside(chance)];
        let next = tries.into_iter().max_by(|a, b| distance(*a, last).total_cmp(&distance(*b, last))).unwrap_or(last);
        plan.route.push(next);
        last = next;
    }
    plan.park_in_sight(chance, -3.8);
    let places: Vec<At> = plan.route.clone();
    for place in places {
        let (sin, cos) = libm::sincos(chance.uniform(-3.1, 3.1));
        let off = chance.uniform(5.0, 9.0);
        let heading = chance.uniform(-3.0, 3.0);
        plan.car(chance, [place[0] + off * cos, place[1] + off * sin], heading);
    }
    plan
}

/// The stations of two or three contacts in the pass of a satellite; none for other bodies. The first contact is under way at the start, the last at the
/// end of the pass.
pub(super) fn stations(seed: u64, platform: &Platform) -> List<Station, MAX_STATIONS> {
    let Body::Satellite(numbers) = platform.body() else { return List::default() };
    let pass = numbers.pass();
    let Ok(orbit) = Orbit::new(&pass.elements) else { return List::default() };
    let mut chance = Chance::new(STATIONS, seed, 0);
    let station_at = |contact| station(&mut chance, &orbit, pass.start_s, contact);
    List::from_first(contacts(seed).into_iter().map(station_at))
}

/// Begin and end of the contacts, seconds after the start.
pub(super) fn contacts(seed: u64) -> Vec<(f64, f64)> {
    let chance = &mut Chance::new(STATIONS, seed, 1);
    let (mut begin, mut contacts) = (-chance.uniform(20.0, 60.0), Vec::new());
    let more = chance.integer(1, 2);
    for _ in 0..more {
        let end = begin.max(0.0) + chance.uniform(30.0, 65.0);
        contacts.push((begin, end));
        begin = end + chance.uniform(12.0, 35.0);
    }
    contacts.push((begin, LAST_S));
    contacts
}

/// The station that sees the satellite between two times. It lies beside the ground track at the middle time, at the
/// distance at which the satellite has its least elevation at either time.
fn station(chance: &mut Chance, orbit: &Orbit, start_s: f64, (begin, end): (f64, f64)) -> Station {
    let least = chance.uniform(5.0, 15.0);
    let side = chance.side();
    let time = start_s + f64::midpoint(begin, end);
    let station_at = |distance: f64| {
        let GeodeticPlace { latitude_rad, longitude_rad, .. } = off_track(orbit, time, side * distance);
        Station {
            latitude_deg: Real::nearest(latitude_rad.to_degrees()),
            longitude_deg: Real::nearest(longitude_rad.to_degrees()),
            least_elevation_deg: Real::nearest(least),
        }
    };
    // The pass is symmetric about its middle, so that the elevation at the end fixes the one at the beginning.
    let sees = |distance: f64| station_at(distance).look(orbit, start_s + end).elevation_rad >= least.to_radians();
    let (mut near, mut far) = (0.0, FARTHEST_M);
    for _ in 0..BISECTIONS {
        let middle = f64::midpoint(near, far);
        if sees(middle) { near = middle } else { far = middle }
    }
    station_at(near)
}

/// The place at `distance_m` to the left of the ground track, along the ground.
fn off_track(orbit: &Orbit, time_s: f64, distance_m: f64) -> GeodeticPlace {
    let seen = seen_from_ground(&orbit.state_at(time_s), orbit.epoch().plus_seconds(time_s));
    let unit = |v: [f64; 3]| {
        let length = v.iter().map(|part| part * part).sum::<f64>().sqrt();
        (v.map(|part| part / length), length)
    };
    let ((up, radius), ([a, b, c], _)) = (unit(seen.position_m), unit(seen.velocity_m_s));
    let left = unit([up[1] * c - up[2] * b, up[2] * a - up[0] * c, up[0] * b - up[1] * a]).0;
    let (sin, cos) = libm::sincos(distance_m / spacecraft::earth::RADIUS_M);
    GeodeticPlace { height_m: 0.0, ..place_of([0, 1, 2].map(|axis| radius * (cos * up[axis] + sin * left[axis]))) }
}
