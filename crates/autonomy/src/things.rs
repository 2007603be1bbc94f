//! Things around the unit with their extents: the map's, and those that perception showed, kept in mind until their place was seen empty.
//!
//! A track says where the middle of a thing is and of which class; its extent is the largest that corroboration takes for that class. One that is lost from view is kept: one that stood until its place was in view for
//! [`DOUBTED`] without it, and so is one that was close; one that moved farther away for [`MOVES_ON`] at most. World frame, millimetres.

use std::sync::Arc;

use wire::id::TrackId;
use wire::sensor::Class;
use wire::time::{Instant, Span};
use wire::track::Track;

use crate::config::Block;
use crate::extent::Extent;
use crate::geofence::{Motion, Point, between};
use crate::localisation::wrap;

/// Most things that are kept in mind; of more the furthest goes.
const MOST: usize = 32;
/// A track this near to something on the map is that thing, unless it is a person.
const ON_THE_MAP_MM: f64 = 1500.0;
/// Speed from which a track is not that thing, mm/s. A slope through places with deviations of 0.4 m, ten a second, has one of 0.24 m/s after
/// 1.5 s: four of these.
const LEAVES_THE_MAP_MM_S: f64 = 1000.0;
/// Below this a thing stands, mm/s.
const STANDS_MM_S: f64 = 300.0;
/// Time in view without its track after which a standing thing is taken to be gone: that of a track's life.
const DOUBTED: Span = Span::s(1);
/// Time for which a thing that was lost while it moved is kept where it was lost, unless that was close.
const MOVES_ON: Span = Span::s(2);
/// Nearer than this a thing is lost from view though it is there, millimetres: the nearest of the view, and a step.
const CLOSE_MM: f64 = 4000.0;
/// Region in which a thing that is there is shown: distance, and angle off the optical axis (half of the camera's view less 5°).
const IN_VIEW_MM: (f64, f64) = (3000.0, 15_000.0);
const IN_VIEW_RAD: f64 = 0.7;
/// Time for which a thing that moved is reckoned to move on.
const PACE_FOR: Span = Span::s(5);
/// Share of its way by which a thing that moves may be aside of its direction.
const ASIDE: f64 = 0.25;
/// Room beside the body on the way past a thing.
const ROOM_MM: f64 = 600.0;
/// Half of the size of another unit: its claim is a place alone.
const TEAMMATE_MM: f64 = 1000.0;

/// Something with an extent and a height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thing {
    /// Its extent.
    pub extent: Extent,
    /// Height of its top above the ground, millimetres.
    pub top: f64,
}

/// Something that the body must not touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Obstacle {
    /// Its extent.
    pub extent: Extent,
    /// Its velocity, mm/s; zero of something that stands.
    pub velocity: Point,
}

impl Obstacle {
    /// True for something that moves.
    pub fn moves(&self) -> bool {
        self.velocity != (0.0, 0.0)
    }

    /// The region in which it can be after so many seconds, going on, standing still or turning back, and somewhat aside.
    pub fn after(&self, seconds: f64) -> Extent {
        let speed = libm::hypot(self.velocity.0, self.velocity.1);
        if speed <= 0.0 {
            return self.extent;
        }
        let (way, half) = (speed * seconds, self.extent.radius());
        let axis = (self.velocity.0 / speed, self.velocity.1 / speed);
        Extent { at: self.extent.at, axis, half: (half + way, half + ASIDE * way) }
    }
}

/// A thing that perception showed.
#[derive(Clone, Copy, Debug)]
struct Kept {
    track: TrackId,
    class: Class,
    at: Point,
    velocity: Point,
    /// Its fastest velocity of late, and when it had it: what turns or stops for a moment goes on.
    pace: (Point, Instant),
    seen: Instant,
    /// True if it was seen last nearer than the view: it may stand there unseen.
    close: bool,
    /// Time for which its place was in view without it.
    missed: Span,
}

/// All of them.
#[derive(Clone, Debug)]
pub struct Things {
    map: Arc<[Thing]>,
    kept: Vec<Kept>,
    updated: Instant,
}

impl Thing {
    /// A block of the map.
    pub fn of_map(block: &Block) -> Self {
        let at = (f64::from(block.x_mm), f64::from(block.y_mm));
        let half = (f64::from(block.half_mm[0]), f64::from(block.half_mm[1]));
        let extent = Extent::new(at, f64::from(block.heading_mrad) / 1000.0, half);
        Thing { extent, top: f64::from(block.top_mm) }
    }
}

impl Things {
    /// With those of the map.
    pub fn new(map: Arc<[Thing]>, now: Instant) -> Self {
        Things { map, kept: Vec::new(), updated: now }
    }

    /// Those of the map.
    pub fn on_the_map(&self) -> impl Iterator<Item = &Thing> {
        self.map.iter()
    }

    /// Takes the newest tracks into account; `motion` tells the view.
    pub fn update(&mut self, tracks: &[Track], motion: &Motion, now: Instant) {
        let passed = now.since(self.updated);
        self.updated = now;
        let unmapped: Vec<Kept> = tracks.iter().filter(|track| !self.is_on_the_map(track)).map(Kept::of).collect();
        for mut seen in unmapped {
            seen.close = between(seen.at, motion.at) < CLOSE_MM;
            for before in &self.kept {
                if before.track == seen.track || before.is_now(&seen) {
                    seen.goes_on_from(before);
                }
            }
            self.kept.retain(|kept| kept.track != seen.track && !kept.is_now(&seen));
            self.kept.push(seen);
        }
        for kept in self.kept.iter_mut().filter(|kept| !tracks.iter().any(|track| track.id == kept.track)) {
            if in_view(motion, kept.at) {
                kept.missed = kept.missed + passed;
            }
        }
        self.kept.retain(|kept| !kept.is_gone(now));
        if self.kept.len() > MOST {
            self.kept.sort_by(|a, b| between(a.at, motion.at).total_cmp(&between(b.at, motion.at)));
            self.kept.truncate(MOST);
        }
    }

    /// Those that reach up to `height`, and teammates.
    pub fn obstacles(&self, now: Instant, height: f64, teammates: impl Iterator<Item = Point>) -> Vec<Obstacle> {
        let still = (0.0, 0.0);
        let mapped = self.map.iter().map(|thing| (*thing, still));
        let kept = self.kept.iter().map(|kept| (kept.thing(), kept.reckoned(now)));
        let high = mapped.chain(kept).filter(|(thing, _)| thing.top >= height);
        let high = high.map(|(Thing { extent, .. }, velocity)| Obstacle { extent, velocity });
        let claimed = |at| Obstacle { extent: Extent::around(at, TEAMMATE_MM), velocity: still };
        high.chain(teammates.map(claimed)).collect()
    }

    /// True if the map explains a track: people are on no map, and neither is a thing that moves.
    pub fn is_on_the_map(&self, track: &Track) -> bool {
        let seen = Kept::of(track);
        let near = |thing: &Thing| thing.extent.distance(seen.at) <= ON_THE_MAP_MM;
        seen.class != Class::Person && seen.speed() < LEAVES_THE_MAP_MM_S && self.map.iter().any(near)
    }
}

impl Kept {
    fn of(track: &Track) -> Self {
        let velocity = (f64::from(track.vx_mm_s), f64::from(track.vy_mm_s));
        Kept {
            track: track.id,
            class: track.class,
            at: (f64::from(track.x_mm), f64::from(track.y_mm)),
            velocity,
            pace: (velocity, track.updated),
            seen: track.updated,
            close: false,
            missed: Span(0),
        }
    }

    fn speed(&self) -> f64 {
        libm::hypot(self.velocity.0, self.velocity.1)
    }

    /// True if a track that is shown now is this thing under another number.
    fn is_now(&self, seen: &Kept) -> bool {
        between(self.at, seen.at) < half(seen.class)
    }

    /// Takes over the pace of the same thing before, where that was faster and is not long ago.
    fn goes_on_from(&mut self, before: &Kept) {
        let ((east, north), at) = before.pace;
        if libm::hypot(east, north) > self.speed() && self.seen.since(at) < PACE_FOR {
            self.pace = before.pace;
        }
    }

    /// Velocity with which it is reckoned: its pace of late, or none of what stands.
    fn reckoned(&self, now: Instant) -> Point {
        let ((east, north), at) = self.pace;
        let stands = libm::hypot(east, north) < STANDS_MM_S || now.since(at) >= PACE_FOR;
        if stands { (0.0, 0.0) } else { (east, north) }
    }

    fn is_gone(&self, now: Instant) -> bool {
        let moved = libm::hypot(self.pace.0.0, self.pace.0.1) >= STANDS_MM_S;
        self.missed >= DOUBTED || moved && !self.close && now.since(self.seen) >= MOVES_ON
    }

    fn thing(&self) -> Thing {
        Thing { extent: Extent::around(self.at, half(self.class)), top: top(self.class) }
    }
}

/// Distance that a way keeps to a thing that is on no map, from middle to middle: half of both, and the room that the shell and a cut curve take.
pub fn keep_clear(class: Class, body_width: f64) -> f64 {
    half(class) + body_width / 2.0 + ROOM_MM
}

/// Half of the greatest width of the class, for the thing may have any heading.
fn half(class: Class) -> f64 {
    f64::from(class.largest_mm()[0]) / 2.0
}

fn top(class: Class) -> f64 {
    f64::from(class.largest_mm()[1])
}

fn in_view(motion: &Motion, at: Point) -> bool {
    let distance = between(motion.at, at);
    let bearing = wrap(libm::atan2(at.1 - motion.at.1, at.0 - motion.at.0) - motion.yaw);
    (IN_VIEW_MM.0..IN_VIEW_MM.1).contains(&distance) && bearing.abs() < IN_VIEW_RAD
}

#[cfg(test)]
mod tests {
    use wire::id::FrameId;
    use wire::sensor::Modalities;

    use super::*;

    const AT_THE_ORIGIN: Motion = Motion { at: (0.0, 0.0), yaw: 0.0, speed: 0.0 };

    fn track(class: Class, (x_mm, y_mm): (i32, i32), now: Instant) -> Track {
        let none = Modalities::default();
        Track {
            id: TrackId(1),
            class,
            x_mm,
            y_mm,
            vx_mm_s: 0,
            vy_mm_s: 0,
            sigma_mm: 200,
            confidence: 800,
            supported: none,
            vetoed: none,
            updated: now,
            frame: FrameId(1),
            across_px: 20,
        }
    }

    fn count(things: &Things) -> usize {
        things.obstacles(Instant(0), 0.0, core::iter::empty()).len()
    }

    #[test]
    fn thing_beside_the_unit_is_kept_until_seen_gone() {
        let mut things = Things::new(Arc::from([]), Instant(0));
        things.update(&[track(Class::Vehicle, (6000, 2500), Instant(0))], &AT_THE_ORIGIN, Instant(0));
        let beside = Motion { at: (6000.0, 0.0), ..AT_THE_ORIGIN };
        for second in 1..120 {
            things.update(&[], &beside, Instant::default() + Span::s(second));
        }
        assert_eq!(count(&things), 1, "it is beside, not in view");
        things.update(&[], &AT_THE_ORIGIN, Instant::default() + Span::s(121));
        assert_eq!(count(&things), 0, "its place was in view for a second, without it");
    }

    #[test]
    fn track_of_a_mapped_thing_is_that_thing() {
        let block = Block { x_mm: 8000, y_mm: 0, heading_mrad: 0, half_mm: [2100, 900], top_mm: 1500 };
        let mut things = Things::new(Arc::from([Thing::of_map(&block)]), Instant(0));
        things.update(&[track(Class::Decoy, (6200, 500), Instant(0))], &AT_THE_ORIGIN, Instant(0));
        assert_eq!(count(&things), 1);
        things.update(&[track(Class::Person, (6200, 500), Instant(0))], &AT_THE_ORIGIN, Instant(0));
        assert_eq!(count(&things), 2, "a person stands beside it");
        assert_eq!(
            things.obstacles(Instant(0), 1600.0, core::iter::empty()).len(),
            1,
            "at that height the car is flown over"
        );
        let passes = Track { vx_mm_s: 2000, ..track(Class::Vehicle, (6200, 500), Instant(0)) };
        assert!(!things.is_on_the_map(&passes), "another car goes past it");
    }

    #[test]
    fn things_in_mind_are_bounded() {
        let mut things = Things::new(Arc::from([]), Instant(0));
        for n in 0..100 {
            let seen = Track { id: TrackId(n), ..track(Class::Person, (n as i32 * 5000, 0), Instant(0)) };
            things.update(&[seen], &AT_THE_ORIGIN, Instant(0));
        }
        assert_eq!(count(&things), MOST);
        assert!(things.kept.iter().all(|kept| kept.at.0 < 32.0 * 5000.0), "the furthest went");
    }

    #[test]
    fn walker_who_turns_is_reckoned_to_walk() {
        let mut things = Things::new(Arc::from([]), Instant(0));
        let walker = |vx_mm_s, now| Track { vx_mm_s, ..track(Class::Person, (6000, 0), now) };
        let moves = |things: &Things, now| things.obstacles(now, 0.0, core::iter::empty())[0].moves();
        let after = |ms| Instant(0) + Span::ms(ms);
        things.update(&[walker(1400, after(0))], &AT_THE_ORIGIN, after(0));
        things.update(&[walker(0, after(500))], &AT_THE_ORIGIN, after(500));
        assert!(moves(&things, after(500)), "he turns");
        things.update(&[Track { id: TrackId(2), ..walker(0, after(900)) }], &AT_THE_ORIGIN, after(900));
        assert!(moves(&things, after(900)), "under another number too");
        things.update(&[walker(0, after(6000))], &AT_THE_ORIGIN, after(6000));
        assert!(!moves(&things, after(6000)), "he stands");
    }
}
