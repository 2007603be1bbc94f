//! Progress along the route, by the plant's truth: way points passed, the way covered, and where the vehicle did not get on.
//!
//! Only time counts in which the unit's mode lets it drive and way points are left: a unit at rest in HOLD_SAFE, or at its goal, is not stuck.
//! The rule for a standstill is that of Nav2's `SimpleProgressChecker`: a vehicle that stays within 0.5 m of a place for 10 s does not get
//! on, whatever small motions it makes. Its reason is read from the set-points of the plant. The second judge has the same rule in
//! `tools/judge/mission.py`.

use evidence::progress::{
    LEG_MM_S, LEG_WAIT, PASSED_MM, Progress, Route, STUCK_AFTER, STUCK_MM, Standstill, Stretch, UNMOVED_AFTER,
};
use evidence::{Evidence, Micros};
use wire::mode::Mode;

use super::guest;
use super::motion::{STANDING, Truth};
use super::place::{Place, length, minus};
use super::timeline::Timeline;

/// A stay: indices of its first sample and of the one after its last, between which the vehicle keeps within
/// [`STUCK_MM`] of its first place.
#[derive(Clone, Copy, Debug)]
struct Stay {
    first: usize,
    last: usize,
}

/// Progress of a run; none for a unit without a route, or without a truth.
pub(crate) fn along_route(evidence: &Evidence, timeline: &Timeline) -> Option<Progress> {
    let route = &evidence.route;
    let samples_in_run = timeline.truth.partition_point(|t| t.at <= evidence.duration);
    let samples = &timeline.truth[..samples_in_run];
    let first = samples.first().filter(|_| !route.points_mm.is_empty())?;
    let mut way = Way::new(route, place_of(first));
    let mut drives = Vec::with_capacity(samples.len());
    let (mut driving, mut time_on_leg) = (0, 0);
    for (index, sample) in samples.iter().enumerate() {
        let spent = if drives.last() == Some(&true) { sample.at - samples[index - 1].at } else { 0 };
        let before = way.passed;
        let drive = way.advance_to(place_of(sample)) && is_driving(timeline.mode_at(sample.at), route.in_degraded);
        driving += spent;
        // A vehicle that goes to and fro, or in circles, moves and gets nowhere: each leg has a limit.
        time_on_leg = if way.passed == before { time_on_leg + spent } else { 0 };
        drives.push(drive);
    }
    let leg_limit = LEG_WAIT as f64 + 1e6 * way.current_leg() / LEG_MM_S;
    let farthest = farthest(samples, &drives);
    let length = |stay: &Stay| samples[stay.last].at - samples[stay.first].at;
    let stays = stays(samples, &drives);
    let lasts = |stay: &Stay| length(stay) >= STUCK_AFTER;
    // The last stay is one to the end only if the vehicle could drive until then.
    let stuck_at_end = drives.last() == Some(&true) && stays.last().is_some_and(lasts);
    let unmoved = driving >= UNMOVED_AFTER && farthest < STUCK_MM;
    let stuck: Vec<Stay> = stays.into_iter().filter(|stay| unmoved || lasts(stay)).collect();
    // `max_by_key` returns the last of equals: in reverse order the first of the longest.
    let longest = stuck.iter().rev().max_by_key(|stay| length(stay)).map(|stay| Stretch {
        from_ms: samples[stay.first].at as f64 / 1000.0,
        s: length(stay) as f64 / 1e6,
        reason: reason_of(evidence, timeline, &samples[stay.first..=stay.last]),
    });
    Some(Progress {
        passed: way.passed as u32,
        total: way.points_to_pass() as u32,
        covered: way.covered(),
        driving_s: driving as f64 / 1e6,
        farthest_m: farthest / 1000.0,
        stuck_s: stuck.iter().map(length).sum::<Micros>() as f64 / 1e6,
        stuck_at_end,
        astray_s: (way.target().is_some() && time_on_leg as f64 > leg_limit).then_some(time_on_leg as f64 / 1e6),
        stuck: longest,
    })
}

fn is_driving(mode: Mode, in_degraded: bool) -> bool {
    match mode {
        Mode::Ready | Mode::PrepareToAct => true,
        Mode::Degraded => in_degraded,
        Mode::Idle | Mode::HoldSafe => false,
    }
}

fn place_of(sample: &Truth) -> Place {
    (f64::from(sample.place.0), f64::from(sample.place.1))
}

/// Farthest from the first place of the time in which it could drive, mm.
fn farthest(samples: &[Truth], drives: &[bool]) -> f64 {
    let mut places = samples.iter().zip(drives).filter(|(_, drives)| **drives).map(|(sample, _)| place_of(sample));
    let Some(origin) = places.next() else { return 0.0 };
    places.map(|place| length(minus(place, origin))).fold(0.0, f64::max)
}

/// Every stay of the time in which it could drive, in order.
fn stays(samples: &[Truth], drives: &[bool]) -> Vec<Stay> {
    let mut stays: Vec<Stay> = Vec::new();
    let mut begun: Option<usize> = None;
    for (last, sample) in samples.iter().enumerate() {
        let stays_on =
            |first: usize| drives[last] && length(minus(place_of(sample), place_of(&samples[first]))) <= STUCK_MM;
        if begun.is_some_and(stays_on) {
            continue;
        }
        stays.extend(begun.map(|first| Stay { first, last }));
        begun = drives[last].then_some(last);
    }
    stays.extend(begun.map(|first| Stay { first, last: samples.len() - 1 }));
    stays
}

/// Progress along the way points.
#[derive(Debug)]
struct Way<'a> {
    route: &'a Route,
    start: Place,
    /// Way points passed, over all laps.
    passed: usize,
    /// Most of the first lap's length that was covered, mm.
    most: f64,
}

impl<'a> Way<'a> {
    fn new(route: &'a Route, start: Place) -> Self {
        Self { route, start, passed: 0, most: 0.0 }
    }

    /// Takes the vehicle to be there now. True if way points are left.
    fn advance_to(&mut self, place: Place) -> bool {
        // No more than a lap from one place: on a looped route within reach of one place there is always a next point.
        for _ in 0..self.route.points_mm.len() {
            if self.target().is_none_or(|target| length(minus(place, target)) > PASSED_MM) {
                break;
            }
            self.passed += 1;
        }
        let target = self.target();
        let of_leg = target.map_or(0.0, |target| self.leg(self.passed) - length(minus(place, target)));
        self.most = self.most.max(self.length(self.passed) + of_leg.max(0.0));
        target.is_some()
    }

    fn point(&self, n: usize) -> Option<Place> {
        self.route.points_mm.get(n).map(|(x, y)| (f64::from(*x), f64::from(*y)))
    }

    fn target(&self) -> Option<Place> {
        let all = self.route.points_mm.len();
        self.point(if self.route.looped { self.passed % all } else { self.passed })
    }

    /// Length of the leg that it is on, mm.
    fn current_leg(&self) -> f64 {
        let from = self.passed.checked_sub(1).map(|before| before % self.route.points_mm.len());
        let from = from.map_or(Some(self.start), |before| self.point(before));
        from.zip(self.target()).map_or(0.0, |(a, b)| length(minus(a, b)))
    }

    /// Length of the leg to way point `n` of the first lap, mm.
    fn leg(&self, n: usize) -> f64 {
        let from = n.checked_sub(1).map_or(Some(self.start), |before| self.point(before));
        from.zip(self.point(n)).map_or(0.0, |(a, b)| length(minus(a, b)))
    }

    /// Length of the first `n` legs of the first lap, mm.
    fn length(&self, n: usize) -> f64 {
        (0..n).map(|n| self.leg(n)).sum()
    }

    /// Way points up to the end of the route, or of the lap.
    fn points_to_pass(&self) -> usize {
        let all = self.route.points_mm.len();
        if self.route.looped { (self.passed / all + 1) * all } else { all }
    }

    fn covered(&self) -> f64 {
        let all = self.route.points_mm.len();
        let length = self.length(all);
        if self.passed >= all || length == 0.0 { 1.0 } else { (self.most / length).clamp(0.0, 1.0) }
    }
}

/// Reason for which it stayed where it was, for most of these samples.
fn reason_of(evidence: &Evidence, timeline: &Timeline, samples: &[Truth]) -> Standstill {
    let most = |test: &dyn Fn(&Truth) -> bool| 2 * samples.iter().filter(|sample| test(sample)).count() > samples.len();
    let unplaced = |sample: &Truth| timeline.judged_by(sample.at, sample.at, |judgement| !judgement.placed);
    if most(&|sample| !sample.leased) {
        Standstill::NoSetPoint
    } else if most(&|sample| sample.set_speed.abs() > STANDING) {
        Standstill::NotFollowed
    } else if let Some(guest) = guest::engaged_guest(evidence) {
        let unlimited = guest.bare || guest::limited_set_points(evidence) == Some(0);
        if unlimited { Standstill::Guest } else { Standstill::GuestOrGuards }
    } else if most(&unplaced) {
        Standstill::NoPlace
    } else {
        Standstill::Planner
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn route(looped: bool) -> Route {
        Route { points_mm: vec![(10_000, 0), (10_000, 10_000)], looped, in_degraded: true }
    }

    #[test]
    fn way_points_count_in_order_only() {
        let route = route(false);
        let mut way = Way::new(&route, (0.0, 0.0));
        assert!(way.advance_to((10_000.0, 9_000.0)), "the second before the first");
        assert_eq!((way.passed, way.points_to_pass()), (0, 2));
        assert!(way.advance_to((8_500.0, 0.0)));
        assert_eq!((way.passed, way.covered()), (1, 0.5));
        assert!(!way.advance_to((10_000.0, 8_500.0)), "none is left");
        assert_eq!((way.passed, way.covered()), (2, 1.0));
    }

    /// A sample each 100 ms of a vehicle that rocks by 0.4 m for 10 s and then goes on at 1 m/s.
    fn rocks_and_goes_on() -> Vec<Truth> {
        let sample = |k: u64| Truth {
            at: k * 100_000,
            stamp: k * 100_000,
            place: (if k <= 100 { 400 * (k % 2) as i32 } else { 100 * (k as i32 - 100) }, 0),
            speed: 0,
            set_speed: 0,
            leased: true,
            fence: 9000,
            safe: true,
            asked_safe: true,
            reserves: None,
        };
        (0..150).map(sample).collect()
    }

    #[test]
    fn small_motions_are_no_progress() {
        let samples = rocks_and_goes_on();
        let all = stays(&samples, &[true; 150]);
        assert_eq!((all[0].first, all[0].last), (0, 106), "until it is 0.6 m away");
        assert!(all[1..].iter().all(|stay| stay.last - stay.first <= 6), "{all:?}");
    }

    #[test]
    fn stay_ends_where_the_mode_forbids_driving() {
        let held: Vec<bool> = (0..150).map(|k| !(40..60).contains(&k)).collect();
        let ends: Vec<(usize, usize)> =
            stays(&rocks_and_goes_on(), &held).iter().map(|stay| (stay.first, stay.last)).collect();
        assert_eq!(ends[..2], [(0, 40), (60, 106)]);
    }

    #[test]
    fn looped_route_counts_the_points_of_every_lap() {
        let route = route(true);
        let mut way = Way::new(&route, (0.0, 0.0));
        for place in [(10_000.0, 0.0), (10_000.0, 10_000.0), (10_000.0, 0.0)] {
            assert!(way.advance_to(place), "it begins anew");
        }
        assert_eq!((way.passed, way.points_to_pass(), way.covered()), (3, 4, 1.0));
    }
}
