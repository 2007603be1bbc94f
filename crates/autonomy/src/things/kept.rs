//! One thing that perception showed, and for how long it is kept in mind.

use wire::id::TrackId;
use wire::sensor::Class;
use wire::time::{Instant, Span};
use wire::track::{Nearby, Track};

use super::Thing;
use crate::extent::Extent;
use crate::geofence::{Motion, Point, distance};
use crate::localisation::wrap;

/// Below this a thing stands, mm/s.
const STANDS_MM_S: f64 = 300.0;
/// Time in view without its track after which a standing thing is taken to be gone: that of a track's life.
const DOUBTED: Span = Span::s(1);
/// Time for which a thing that was lost while it moved is kept where it was lost, unless that was close.
const MOVES_ON: Span = Span::s(2);
/// Nearer than this a thing is lost from view though it is there, millimetres: the nearest of the view, and a step.
const CLOSE_MM: f64 = 4000.0;
/// Region in which a thing that is there is shown: distance, and angle off the optical axis (half of the camera's view
/// less 5°).
const IN_VIEW_MM: (f64, f64) = (3000.0, 15_000.0);
const IN_VIEW_RAD: f64 = 0.7;
/// Distance within which LiDAR shows a person: that of things nearby, less a step.
const IN_REACH_MM: f64 = 10_000.0;
/// Distance from which it shows low things, too: its lowest beam is 0.2 m above the ground there.
const LOW_FROM_MM: f64 = 5000.0;
/// Time for which a thing that moves is reckoned to move on.
const PACE_FOR: Span = Span::s(5);
/// Room around the returns of LiDAR, for they are of the near side.
const BEYOND_MM: f64 = 200.0;
/// Distance from the side of a thing within which a place that LiDAR shows is of it.
const BESIDE_MM: f64 = 500.0;

/// Number under which perception shows a thing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Number {
    /// A track, of a class.
    Track(TrackId, Class),
    /// Something that LiDAR alone shows.
    Nearby(u32),
}

/// A thing that perception showed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kept {
    pub(super) number: Number,
    pub(super) at: Point,
    velocity: Point,
    half: f64,
    /// The fastest recent velocity and its time: a thing that turns or stops for a moment goes on.
    pace: (Point, Instant),
    seen: Instant,
    /// True if it was seen last nearer than the view: it may stand there unseen.
    close: bool,
    /// True if LiDAR alone has shown it, too.
    confirmed: bool,
    /// Time for which its place was in view without it.
    missed: Span,
}

impl Kept {
    pub(super) fn of_track(track: &Track) -> Self {
        let place = (f64::from(track.x_mm), f64::from(track.y_mm));
        let velocity = (f64::from(track.vx_mm_s), f64::from(track.vy_mm_s));
        Kept::new(Number::Track(track.id, track.class), place, velocity, half(track.class), track.updated)
    }

    /// Things in a picture with this stamp.
    pub(super) fn of_nearby(nearby: &Nearby, stamp: Instant) -> Self {
        let place = (f64::from(nearby.x_mm), f64::from(nearby.y_mm));
        let velocity = (f64::from(nearby.vx_mm_s), f64::from(nearby.vy_mm_s));
        Kept::new(Number::Nearby(nearby.number), place, velocity, f64::from(nearby.width_mm) / 2.0 + BEYOND_MM, stamp)
    }

    fn new(number: Number, at: Point, velocity: Point, half: f64, seen: Instant) -> Self {
        let pace = (velocity, seen);
        Kept { number, at, velocity, half, pace, seen, close: false, confirmed: false, missed: Span(0) }
    }

    pub(super) fn speed(&self) -> f64 {
        libm::hypot(self.velocity.0, self.velocity.1)
    }

    /// True if it moved when it was seen.
    pub(super) fn moves(&self) -> bool {
        self.speed() >= STANDS_MM_S
    }

    /// True if it may walk off from standing.
    pub(super) fn may_walk(&self) -> bool {
        let size = f64::from(Class::Person.largest_mm()[0]) / 2.0;
        self.is_person() || self.half <= size + BEYOND_MM
    }

    pub(super) fn is_person(&self) -> bool {
        matches!(self.number, Number::Track(_, Class::Person))
    }

    /// True if `seen` is this thing, under its number or another one.
    pub(super) fn is_now(&self, seen: &Kept) -> bool {
        self.number == seen.number || distance(self.at, seen.at) < seen.half
    }

    /// Takes the pace of `before`, an earlier sight of this thing, where that was faster and is not long ago.
    pub(super) fn goes_on_from(&mut self, before: &Kept) {
        self.confirmed |= before.confirmed;
        let ((east, north), time) = before.pace;
        if libm::hypot(east, north) > self.speed() && self.seen.since(time) < PACE_FOR {
            self.pace = before.pace;
        }
    }

    /// Notes whether it is seen from `motion` nearer than the view.
    pub(super) fn seen_from(mut self, motion: &Motion) -> Self {
        self.close = matches!(self.number, Number::Track(..)) && distance(self.at, motion.at) < CLOSE_MM;
        self
    }

    /// True if `nearby`, of LiDAR, is this thing, which a track showed: beside a thing that stands something else may
    /// move.
    pub(super) fn explains(&self, nearby: &Kept) -> bool {
        let is_same_kind = self.is_person() || !nearby.moves() || self.moves();
        matches!(self.number, Number::Track(..)) && is_same_kind && distance(self.at, nearby.at) < self.half + BESIDE_MM
    }

    /// LiDAR shows it: it is there, as large as the side that it shows, and where no track shows it now as fast. A
    /// person has the size of a person.
    pub(super) fn is_shown(&mut self, nearby: &Kept) {
        let before = *self;
        let size = if self.is_person() { half(Class::Person) } else { nearby.half };
        (self.at, self.half, self.confirmed, self.missed) = (nearby.at, size, true, Span(0));
        if self.seen < nearby.seen {
            (self.velocity, self.pace, self.seen) = (nearby.velocity, nearby.pace, nearby.seen);
            self.goes_on_from(&before);
        }
    }

    /// Notes that it was not shown for so long. LiDAR looks around and does not see low things that are near, which it
    /// has shown before; `ranges` is true while it looks.
    pub(super) fn miss(&mut self, passed: Span, motion: &Motion, ranges: bool) {
        let distance = distance(self.at, motion.at);
        let by_lidar = match self.number {
            Number::Nearby(_) => true,
            Number::Track(_, Class::Person) => distance < IN_REACH_MM,
            Number::Track(..) => !self.confirmed && (LOW_FROM_MM..IN_REACH_MM).contains(&distance),
        };
        let looked_at = ranges && by_lidar || matches!(self.number, Number::Track(..)) && in_view(motion, self.at);
        if looked_at {
            self.missed = self.missed + passed;
        }
    }

    /// Velocity with which it is reckoned: its pace of late, or none of a thing that stands.
    pub(super) fn reckoned(&self, now: Instant) -> Point {
        let ((east, north), time) = self.pace;
        let is_still = libm::hypot(east, north) < STANDS_MM_S || now.since(time) >= PACE_FOR;
        if is_still { (0.0, 0.0) } else { (east, north) }
    }

    pub(super) fn is_gone(&self, now: Instant) -> bool {
        let moved = libm::hypot(self.pace.0.0, self.pace.0.1) >= STANDS_MM_S;
        self.missed >= DOUBTED || moved && !self.close && now.since(self.seen) >= MOVES_ON
    }

    /// Extent and top. LiDAR alone measures no top: a body in the air keeps clear only of things with a class.
    pub(super) fn thing(&self) -> Thing {
        let top = match self.number {
            Number::Track(_, class) => f64::from(class.largest_mm()[1]),
            Number::Nearby(_) => 0.0,
        };
        Thing { extent: Extent::around_disc(self.at, self.half), top }
    }
}

/// Half of the greatest width of the class, for the thing may have any heading.
pub(super) fn half(class: Class) -> f64 {
    f64::from(class.largest_mm()[0]) / 2.0
}

fn in_view(motion: &Motion, place: Point) -> bool {
    let distance = distance(motion.at, place);
    let bearing = wrap(libm::atan2(place.1 - motion.at.1, place.0 - motion.at.0) - motion.yaw);
    (IN_VIEW_MM.0..IN_VIEW_MM.1).contains(&distance) && bearing.abs() < IN_VIEW_RAD
}
