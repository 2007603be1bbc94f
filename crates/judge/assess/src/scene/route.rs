//! The route: way points that follow the recorded places, moved into the world of a scenario, and the fence around them.
//!
//! The places are reduced by Ramer, Douglas and Peucker's rule: the farthest place from the straight line between two retained ones is retained too, until none is
//! farther than a tolerance. The tolerance grows until the way points are few enough.

use super::error::SceneError;
use super::part::Part;
use crate::Terms;
use crate::map::Map;

/// Most way points of a scenario, and most corners of its fence.
pub(super) const MAX_POINTS: usize = 64;
/// Distances between the recorded route and the straight legs that are tried, metres. The last is the distance within which a way point counts as passed.
const TOLERANCES_M: [f64; 4] = [0.25, 0.5, 1.0, 2.0];
/// Least distance between two places that count as two, metres: a vehicle at rest is one place.
const APART_M: f64 = 0.2;
/// Least distance from the start that makes a route, metres.
pub(super) const REACH_M: f64 = 2.0;
/// Longest and widest world, metres.
pub(super) const WIDEST_M: f64 = 1000.0;
/// Least distance of a made fence from the route, metres.
const FENCE_M: f64 = 10.0;

/// A route in the world of a scenario.
pub(super) struct Route {
    /// Start, metres east and north, and heading, radians.
    pub(super) start: ([f64; 2], f64),
    pub(super) points: Vec<[f64; 2]>,
    /// Corners of the fence, and whether they are the map's.
    pub(super) fence: (Vec<[f64; 2]>, bool),
    /// Distance that was subtracted from the recording's places, metres.
    pub(super) shift_m: [f64; 2],
    /// Distance within which the legs follow the recorded route, metres.
    pub(super) tolerance_m: f64,
    /// Length of the legs, metres.
    pub(super) way_m: f64,
    /// Distance of a made fence from the route, metres.
    pub(super) margin_m: f64,
}

impl Route {
    /// Route of a part.
    ///
    /// # Errors
    /// When it is too short, too long or too winding, or leaves the map's fence.
    pub(super) fn of_part(part: &Part, map: &Map, terms: &Terms) -> Result<Self, SceneError> {
        let places = distinct(part.spots.iter().map(|spot| spot.at_m));
        let from_start = |place: &[f64; 2]| places.first().map_or(0.0, |start| distance(*place, *start));
        let within_m = places.iter().map(from_start).fold(0.0, f64::max);
        if within_m < REACH_M {
            return Err(SceneError::Still { within_m });
        }
        let margin_m = margin_m(terms);
        let (corners, is_maps) = fence(map, &places, margin_m)?;
        let shift_m = shift(&corners)?;
        let (retained, tolerance_m) = simplified(&places)?;
        // A scenario's way points lie within its fence.
        if let Some(place) = retained.iter().find(|place| !is_inside(&corners, **place)) {
            return Err(SceneError::Outside { place_m: *place });
        }
        let moved = |place: &[f64; 2]| [0, 1].map(|axis| rounded(place[axis] - shift_m[axis]));
        let points: Vec<[f64; 2]> = retained[1..].iter().map(moved).collect();
        let way_m = retained.windows(2).map(|two| distance(two[0], two[1])).sum();
        let yaw = part.spots.first().map_or(0.0, |spot| spot.yaw);
        let start = (moved(&retained[0]), rounded(autonomy::localisation::wrap(yaw)));
        let fence = (corners.iter().map(moved).collect(), is_maps);
        Ok(Self { start, points, fence, shift_m, tolerance_m, way_m, margin_m })
    }
}

/// Centimetres are finer than any fix. `+ 0.0` makes a negative zero positive.
fn rounded(number: f64) -> f64 {
    libm::round(number * 100.0) / 100.0 + 0.0
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}

/// The places that are apart from the one retained before.
fn distinct(places: impl Iterator<Item = [f64; 2]>) -> Vec<[f64; 2]> {
    let mut retained: Vec<[f64; 2]> = Vec::new();
    for place in places {
        if retained.last().is_none_or(|last| distance(*last, place) >= APART_M) {
            retained.push(place);
        }
    }
    retained
}

/// The start and at most [`MAX_POINTS`] way points, by the finest tolerance that gives so few.
fn simplified(places: &[[f64; 2]]) -> Result<(Vec<[f64; 2]>, f64), SceneError> {
    let mut points = 0;
    for tolerance_m in TOLERANCES_M {
        let retained = reduced(places, tolerance_m);
        points = retained.len() - 1;
        if points <= MAX_POINTS {
            return Ok((retained, tolerance_m));
        }
    }
    Err(SceneError::Winding { points, tolerance_m: TOLERANCES_M[TOLERANCES_M.len() - 1] })
}

/// The places that straight legs need to stay within a tolerance of all. Stretches wait in a list, so that a hostile route costs no stack.
fn reduced(places: &[[f64; 2]], tolerance_m: f64) -> Vec<[f64; 2]> {
    let last = places.len() - 1;
    let mut is_kept = vec![false; places.len()];
    (is_kept[0], is_kept[last]) = (true, true);
    let mut waiting = vec![(0, last)];
    let mut retained = 2;
    while let Some((from, to)) = waiting.pop() {
        let off = |i: usize| distance_to_leg(places[i], places[from], places[to]);
        let farthest = (from + 1..to).max_by(|a, b| off(*a).total_cmp(&off(*b)));
        if let Some(farthest) = farthest.filter(|place| off(*place) > tolerance_m) {
            is_kept[farthest] = true;
            retained += 1;
            waiting.extend([(from, farthest), (farthest, to)]);
        }
        // Far more than any scenario has: the rest of a scribble is not looked at.
        if retained > 4 * MAX_POINTS {
            break;
        }
    }
    places.iter().zip(is_kept).filter(|(_, is_kept)| *is_kept).map(|(place, _)| *place).collect()
}

/// Distance of a place from a leg, metres; from its start where the leg has no length, as on a round trip.
fn distance_to_leg(place: [f64; 2], from: [f64; 2], to: [f64; 2]) -> f64 {
    let leg = [to[0] - from[0], to[1] - from[1]];
    let length_2 = leg[0] * leg[0] + leg[1] * leg[1];
    if length_2 == 0.0 {
        return distance(place, from);
    }
    let along = ((place[0] - from[0]) * leg[0] + (place[1] - from[1]) * leg[1]) / length_2;
    let along = along.clamp(0.0, 1.0);
    distance(place, [from[0] + along * leg[0], from[1] + along * leg[1]])
}

/// Distance from the route to a made fence: twice the distance at which the guard trips at full speed, and [`FENCE_M`] at least.
fn margin_m(terms: &Terms) -> f64 {
    let speed = f64::from(terms.bounds.max_speed_mm_s) / 1000.0;
    let braking = f64::from(terms.bounds.braking_mm_s2.max(1)) / 1000.0;
    let reaction = speed * f64::from(terms.limits.reaction_ms) / 1000.0;
    let margin = f64::from(terms.bounds.fence_margin_mm) / 1000.0;
    libm::ceil((2.0 * (margin + reaction + speed * speed / (2.0 * braking))).max(FENCE_M))
}

/// The map's fence, or a rectangle around the places; on the recording's axes. Also whether it is the map's.
fn fence(map: &Map, places: &[[f64; 2]], margin_m: f64) -> Result<(Vec<[f64; 2]>, bool), SceneError> {
    let Some(stated) = &map.fence else {
        let ([west, south], [east, north]) = extent(places);
        let (west, south, east, north) = (west - margin_m, south - margin_m, east + margin_m, north + margin_m);
        return Ok((vec![[west, south], [east, south], [east, north], [west, north]], false));
    };
    match stated.corners.as_ref() {
        corners if corners.len() > MAX_POINTS => Err(SceneError::Corners { corners: corners.len() }),
        corners => Ok((corners.clone(), true)),
    }
}

/// True if a place lies inside a polygon, by the number of edges that a ray to the east crosses.
fn is_inside(corners: &[[f64; 2]], [x, y]: [f64; 2]) -> bool {
    let edges = corners.iter().zip(corners.iter().cycle().skip(1));
    let crossed =
        edges.filter(|([x0, y0], [x1, y1])| (*y0 > y) != (*y1 > y) && x < (x1 - x0) * (y - y0) / (y1 - y0) + x0);
    crossed.count() % 2 == 1
}

/// Lowest and highest coordinates.
fn extent(places: &[[f64; 2]]) -> ([f64; 2], [f64; 2]) {
    let limit = |pick: fn(f64, f64) -> f64| {
        [0, 1].map(|axis| places.iter().map(|place| place[axis]).reduce(pick).unwrap_or(0.0))
    };
    (limit(f64::min), limit(f64::max))
}

/// The middle of the fence in whole metres, which becomes the zero of the world.
fn shift(corners: &[[f64; 2]]) -> Result<[f64; 2], SceneError> {
    let (low, high) = extent(corners);
    let extent_m = (high[0] - low[0]).max(high[1] - low[1]);
    // A metre less, as the middle is rounded.
    if extent_m > WIDEST_M - 1.0 {
        return Err(SceneError::Wide { extent_m });
    }
    Ok([0, 1].map(|axis| libm::round((low[axis] + high[axis]) / 2.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn straight_drive_has_two_places() {
        let line: Vec<[f64; 2]> = (0..1000).map(|i| [f64::from(i), 0.1 * f64::from(i % 2)]).collect();
        assert_eq!(reduced(&line, 0.25), [line[0], line[999]]);
        let corner: Vec<[f64; 2]> = (0..=20).map(|i| [f64::from(i.min(10)), f64::from((i - 10).max(0))]).collect();
        assert_eq!(reduced(&corner, 0.25), [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]]);
    }

    #[test]
    fn round_trip_keeps_its_far_end() {
        let outbound = (0..=50).map(|i| [f64::from(i), 0.0]);
        let places: Vec<[f64; 2]> = outbound.clone().chain(outbound.rev()).collect();
        assert_eq!(reduced(&places, 0.5), [[0.0, 0.0], [50.0, 0.0], [0.0, 0.0]]);
    }

    #[test]
    fn scribble_is_too_winding() {
        let scribble: Vec<[f64; 2]> = (0..100_000).map(|i| [f64::from(i % 100), f64::from(i * 7919 % 101)]).collect();
        assert!(matches!(simplified(&scribble), Err(SceneError::Winding { points, .. }) if points > MAX_POINTS));
    }
}
