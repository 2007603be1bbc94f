//! The mission: which way point is next, and the planned way to it.
//!
//! A leg is planned when it begins and again, at most once a second, when something has come into it. World frame,
//! millimetres. How the way is followed and how fast is left to `navigation`.

use wire::time::{Instant, Span};

use crate::geofence::{Point, distance, to_segment};
use crate::grid::{Grid, Keepout};

/// A way point counts as reached within this distance, millimetres.
pub(crate) const REACHED_MM: f64 = 1000.0;
/// Least time between two plans of one leg.
const REPLAN: Span = Span::s(1);

/// Length by which a way around things that move may be longer than one through their places, millimetres. A longer one
/// is not taken at once.
const DETOUR_MM: f64 = 15_000.0;
/// Time for which the unit waits for them to go before it takes it.
const PATIENCE: Span = Span::s(10);

/// Route, progress and present way.
#[derive(Clone, Debug)]
pub struct Mission {
    route: Vec<Point>,
    looped: bool,
    grid: Grid,
    /// Legs completed, over all laps.
    legs: usize,
    leg: Option<Leg>,
    /// Time since which the way around moving things has been long.
    blocked: Option<Instant>,
}

#[derive(Clone, Debug)]
struct Leg {
    /// Start of the plan, then every point to its end. Empty when there is no way.
    way: Vec<Point>,
    planned: Instant,
}

/// A way to follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlannedWay<'a> {
    /// At least two points: where it was planned from, then every point to the way point.
    pub points: &'a [Point],
    /// The way point after it; absent if the mission ends there.
    pub beyond: Option<Point>,
}

impl Mission {
    /// A mission over `route` on `grid`.
    pub fn new(route: &[(i32, i32)], looped: bool, grid: Grid) -> Self {
        let route = route.iter().map(|(x, y)| (f64::from(*x), f64::from(*y))).collect();
        Mission { route, looped, grid, legs: 0, leg: None, blocked: None }
    }

    /// Plans the present leg again, over this grid.
    pub fn replan(&mut self, grid: Grid) {
        (self.grid, self.leg) = (grid, None);
    }

    /// Share of the route driven, permille; a looped route is done after one lap.
    pub fn progress(&self) -> u16 {
        let all = self.route.len().max(1);
        (self.legs.min(all) * 1000 / all) as u16
    }

    /// Notes that the unit is at `place`, where a guest leads it along the route.
    pub fn pass(&mut self, place: Point) {
        while self.target(0).is_some_and(|target| distance(place, target) <= REACHED_MM) {
            self.legs += 1;
            self.leg = None;
            // The next point of such a route is the same point, reached already: the loop would not end.
            if self.looped && self.route.len() == 1 {
                break;
            }
        }
    }

    /// The way from `place` towards the next way point around `moving` places; `None` where the mission is over or
    /// there is no way now.
    pub fn way(&mut self, place: Point, moving: &[Keepout], now: Instant) -> Option<PlannedWay<'_>> {
        self.pass(place);
        let target = self.target(0)?;
        if self.leg.as_ref().is_none_or(|leg| leg.wants_plan(place, moving, now)) {
            let way = self.plan((place, target), moving, now).unwrap_or_default();
            self.leg = Some(Leg { way, planned: now });
        }
        let beyond = self.target(1);
        let points = self.leg.as_ref().map(|leg| leg.way.as_slice()).filter(|way| way.len() > 1)?;
        Some(PlannedWay { points, beyond })
    }

    /// The way with its start: around `moving` places, or through them where that saves a long detour for a while, or
    /// where there is no way around. A unit that follows it stops before them, and backs up: without a way it would
    /// stand as long as an actor that waits for it.
    fn plan(&mut self, (start, target): (Point, Point), moving: &[Keepout], now: Instant) -> Option<Vec<Point>> {
        let with_start = |points: Vec<Point>| std::iter::once(start).chain(points).collect::<Vec<_>>();
        let around = self.grid.way(start, target, moving).map(with_start);
        let is_long = |limit: f64| around.as_ref().is_none_or(|way| length(way) > limit + DETOUR_MM);
        // No way is shorter than the straight line.
        if !moving.is_empty() && is_long(distance(start, target)) {
            let through = self.grid.way(start, target, &[]).map(with_start)?;
            if is_long(length(&through)) {
                let since = *self.blocked.get_or_insert(now);
                return if now.since(since) < PATIENCE { Some(through) } else { around.or(Some(through)) };
            }
        }
        self.blocked = None;
        around
    }

    /// A way from `place` to a place that is no way point, without its start; `None` where there is none.
    pub fn lead(&self, place: Point, to: Point, moving: &[Keepout]) -> Option<Vec<Point>> {
        self.grid.way(place, to, moving)
    }

    /// The way point `ahead` of the next one.
    fn target(&self, ahead: usize) -> Option<Point> {
        let index = self.legs + ahead;
        match self.route.len() {
            0 => None,
            n if self.looped => self.route.get(index % n).copied(),
            _ => self.route.get(index).copied(),
        }
    }
}

impl Leg {
    fn wants_plan(&self, place: Point, moving: &[Keepout], now: Instant) -> bool {
        let cut = |k: &Keepout| self.way.windows(2).any(|ab| to_segment(k.at, ab[0], ab[1]) < k.radius);
        let off = |ab: &[Point]| to_segment(place, ab[0], ab[1]);
        let strayed = self.way.windows(2).map(off).fold(f64::MAX, f64::min) > 2.0 * REACHED_MM;
        now.since(self.planned) >= REPLAN && (self.way.is_empty() || strayed || moving.iter().any(cut))
    }
}

fn length(way: &[Point]) -> f64 {
    way.windows(2).map(|ab| distance(ab[0], ab[1])).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::extent::Extent;
    use crate::geofence::Geofence;
    use crate::grid::Clearance;

    fn mission(looped: bool) -> Mission {
        let clearance = Clearance { fence: 1500.0, wide: 1500.0, narrow: 750.0 };
        let fence = Geofence::new(&[(0, 0), (20_000, 0), (20_000, 20_000), (0, 20_000)]);
        Mission::new(&[(5000, 5000), (15_000, 5000)], looped, Grid::new(&fence, &[], clearance))
    }

    /// Legs follow one another.
    #[test]
    fn last_leg_ends_the_mission() {
        let mut mission = mission(false);
        let way = mission.way((2000.0, 5000.0), &[], Instant(0)).unwrap();
        assert_eq!((way.points.last(), way.beyond), (Some(&(5000.0, 5000.0)), Some((15_000.0, 5000.0))));
        let way = mission.way((4500.0, 5000.0), &[], Instant(1)).unwrap();
        assert_eq!((way.points.last(), way.beyond), (Some(&(15_000.0, 5000.0)), None));
        assert_eq!(mission.progress(), 500);
        assert_eq!(mission.way((14_500.0, 5000.0), &[], Instant(2)), None);
        assert_eq!(mission.progress(), 1000);
    }

    #[test]
    fn what_comes_into_the_way_is_planned_around() {
        let mut mission = mission(true);
        mission.way((4500.0, 5000.0), &[], Instant(0));
        let walker = Keepout { at: (10_000.0, 5000.0), radius: 2000.0, least: 1500.0 };
        let way = mission.way((4600.0, 5000.0), &[walker], Instant(1_000_000)).unwrap();
        assert!(way.points.windows(2).all(|ab| to_segment(walker.at, ab[0], ab[1]) >= 2000.0), "{way:?}");
    }

    /// The northernmost place of the way past a wall, where there is a way: at once, before the end of the wait and
    /// after it. Something is in the gap at the wall's southern end.
    fn northernmost_past(wall: Extent) -> [Option<f64>; 3] {
        let clearance = Clearance { fence: 500.0, wide: 700.0, narrow: 600.0 };
        let fence = Geofence::new(&[(0, 0), (20_000, 0), (20_000, 20_000), (0, 20_000)]);
        let mut mission = Mission::new(&[(15_000, 1000)], false, Grid::new(&fence, &[wall], clearance));
        let in_the_gap = [Keepout { at: (10_000.0, 500.0), radius: 1500.0, least: 1500.0 }];
        [0, 9, 11].map(|second| {
            let way = mission.way((5000.0, 1000.0), &in_the_gap, Instant(0) + Span::s(second))?;
            Some(way.points.iter().map(|point| point.1).fold(0.0, f64::max))
        })
    }

    #[test]
    fn long_detour_is_taken_after_a_wait() {
        let wall = Extent::new((10_000.0, 8000.0), 0.0, (200.0, 6500.0));
        let [at_once, waiting, after] = northernmost_past(wall).map(Option::unwrap);
        assert!(at_once < 2000.0 && waiting < 2000.0, "through the gap");
        assert!(after > 15_000.0, "around the wall");
    }

    /// A unit that comes to the closed gap stops before it and backs up.
    #[test]
    fn way_without_a_detour_leads_on_through() {
        let wall = Extent::new((10_000.0, 11_000.0), 0.0, (200.0, 9500.0));
        assert!(northernmost_past(wall).iter().all(|north| north.is_some_and(|north| north < 2000.0)));
    }
}
