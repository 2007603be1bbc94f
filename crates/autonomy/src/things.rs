//! Things around the unit with their extents: from the map, and from perception, which are kept until their
//! place was seen empty.
//!
//! A track gives the middle and the class of a thing; its extent is the largest that corroboration takes for that
//! class. LiDAR alone gives the near things on all sides, with places, widths and velocities. The time for which a
//! thing out of view is kept is left to `kept`. World frame, millimetres.

mod kept;

use std::sync::Arc;

use wire::sensor::Class;
use wire::time::Instant;
use wire::track::{NEARBY, Track};

use crate::config::MapBox;
use crate::extent::Extent;
use crate::geofence::{Motion, Point, distance};
use crate::picture::Picture;
use crate::things::kept::{Kept, half};

/// Most things that are kept in mind, as many as one picture shows; of more the furthest goes.
const MOST: usize = NEARBY + 16;
/// A track this near to something on the map is that thing, unless it is a person.
const ON_THE_MAP_MM: f64 = 1500.0;
/// A place that LiDAR shows this near to something on the map is of that: four deviations of a followed place. No
/// farther, for a person may stand beside a wall.
const SIDE_OF_THE_MAP_MM: f64 = 250.0;
/// Speed from which a track is not that thing, mm/s. A slope through places with deviations of 0.4 m, ten a second, has
/// one of 0.24 m/s after 1.5 s: four of these.
const LEAVES_THE_MAP_MM_S: f64 = 1000.0;
/// Share of its way by which a thing that moves may be aside of its direction: it turns by 45°.
const ASIDE: f64 = 0.7;
/// Speed with which a person who stands is reckoned to walk off, mm/s: in the first second of a walk of 1.4 m/s.
const WALKS_OFF_MM_S: f64 = 1000.0;
/// Room beside the body on the way past a thing.
const ROOM_MM: f64 = 600.0;
/// Half of the size of another unit: its claim is a place alone.
const TEAMMATE_MM: f64 = 1000.0;

/// Something with an extent and a height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thing {
    /// Extent on the ground.
    pub extent: Extent,
    /// Height of its top above the ground, millimetres.
    pub top: f64,
}

/// Something that the body must not touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Obstacle {
    /// Extent on the ground.
    pub extent: Extent,
    /// Velocity, mm/s; zero of something that stands.
    pub velocity: Point,
    /// True if it may walk off from standing: a person, or a thing of such a size by LiDAR.
    pub may_walk: bool,
}

impl Obstacle {
    /// True for something that moves.
    pub fn moves(&self) -> bool {
        self.velocity != (0.0, 0.0)
    }

    /// The region in which it can be after a given number of seconds: going on, standing still or turning back, and
    /// somewhat aside; walking off to any side.
    pub fn extent_after(&self, seconds: f64) -> Extent {
        let speed = libm::hypot(self.velocity.0, self.velocity.1);
        if speed <= 0.0 {
            return if self.may_walk { self.extent.grown(WALKS_OFF_MM_S * seconds) } else { self.extent };
        }
        let (way, half) = (speed * seconds, self.extent.radius());
        let axis = (self.velocity.0 / speed, self.velocity.1 / speed);
        Extent { at: self.extent.at, axis, half: (half + way, half + ASIDE * way) }
    }
}

/// Things of the map and things that perception showed.
#[derive(Clone, Debug)]
pub struct Things {
    map: Arc<[Thing]>,
    kept: Vec<Kept>,
    updated: Instant,
}

impl Thing {
    /// A block of the map.
    pub fn of_map(block: &MapBox) -> Self {
        let place = (f64::from(block.x_mm), f64::from(block.y_mm));
        let half = (f64::from(block.half_mm[0]), f64::from(block.half_mm[1]));
        let extent = Extent::new(place, f64::from(block.heading_mrad) / 1000.0, half);
        Thing { extent, top: f64::from(block.top_mm) }
    }
}

impl Things {
    /// Knowledge of `map` alone, before the first picture.
    pub fn new(map: Arc<[Thing]>, now: Instant) -> Self {
        Things { map, kept: Vec::new(), updated: now }
    }

    /// Things of the map.
    pub fn on_the_map(&self) -> impl Iterator<Item = &Thing> {
        self.map.iter()
    }

    /// Takes the newest picture into account; `motion` tells the view.
    pub fn update(&mut self, picture: &Picture, motion: &Motion, now: Instant) {
        let passed = now.since(self.updated);
        self.updated = now;
        // One that only coasts shows nothing.
        let shown = picture.tracks().iter().filter(|track| track.updated >= picture.stamp());
        let tracks = shown.filter(|track| !self.is_on_the_map(track)).map(Kept::of_track);
        let tracks: Vec<Kept> = tracks.map(|seen| seen.seen_from(motion)).collect();
        let nearby = picture.nearby().unwrap_or_default().iter().map(|nearby| Kept::of_nearby(nearby, picture.stamp()));
        let nearby: Vec<Kept> = nearby.filter(|seen| !self.is_of_the_map(seen)).collect();
        let ranges = picture.nearby().is_some();
        for kept in &mut self.kept {
            kept.miss(passed, motion, ranges);
        }
        tracks.into_iter().for_each(|seen| self.take(seen));
        let mut shown = Vec::new();
        for seen in nearby {
            let explain = self
                .kept
                .iter_mut()
                .filter(|remembered| remembered.explains(&seen) && !shown.contains(&remembered.number));
            match explain.min_by(|a, b| distance(a.at, seen.at).total_cmp(&distance(b.at, seen.at))) {
                Some(kept) => {
                    kept.is_shown(&seen);
                    shown.extend(kept.is_person().then_some(kept.number));
                }
                None => self.take(seen),
            }
        }
        self.kept.retain(|remembered| !remembered.is_gone(now));
        if self.kept.len() > MOST {
            self.kept.sort_by(|a, b| distance(a.at, motion.at).total_cmp(&distance(b.at, motion.at)));
            self.kept.truncate(MOST);
        }
    }

    /// Takes a thing in place of those that it is.
    fn take(&mut self, mut seen: Kept) {
        let shown = seen;
        self.kept.iter().filter(|remembered| remembered.is_now(&shown)).for_each(|before| seen.goes_on_from(before));
        self.kept.retain(|remembered| !remembered.is_now(&shown));
        self.kept.push(seen);
    }

    /// True if LiDAR shows a side of something on the map there.
    fn is_of_the_map(&self, seen: &Kept) -> bool {
        self.map.iter().any(|thing| thing.extent.distance(seen.at) <= SIDE_OF_THE_MAP_MM)
    }

    /// Things of the map that reach up to the first height, of the others up to the second, and teammates.
    pub fn obstacles(
        &self,
        now: Instant,
        [mapped, remembered]: [f64; 2],
        teammates: impl Iterator<Item = Point>,
    ) -> Vec<Obstacle> {
        let at_rest = (0.0, 0.0);
        let on_the_map = self.on_the_map().filter(|thing| thing.top >= mapped).map(|thing| (*thing, at_rest, false));
        let shown =
            self.kept.iter().map(|remembered| (remembered.thing(), remembered.reckoned(now), remembered.may_walk()));
        let high = on_the_map.chain(shown.filter(|(thing, ..)| thing.top >= remembered));
        let high = high.map(|(Thing { extent, .. }, velocity, may_walk)| Obstacle { extent, velocity, may_walk });
        let claimed =
            |place| Obstacle { extent: Extent::around_disc(place, TEAMMATE_MM), velocity: at_rest, may_walk: false };
        high.chain(teammates.map(claimed)).collect()
    }

    /// True if the map explains a track: people are on no map, and neither is a thing that moves.
    pub fn is_on_the_map(&self, track: &Track) -> bool {
        let seen = Kept::of_track(track);
        let near = |thing: &Thing| thing.extent.distance(seen.at) <= ON_THE_MAP_MM;
        !seen.is_person() && seen.speed() < LEAVES_THE_MAP_MM_S && self.map.iter().any(near)
    }
}

/// Distance that a way keeps to a thing that is on no map, from middle to middle: half of both, and the room that the
/// shell and a cut curve take.
pub fn keep_clear(class: Class, body_width: f64) -> f64 {
    half(class) + body_width / 2.0 + ROOM_MM
}

#[cfg(test)]
mod tests {
    use wire::codec::List;
    use wire::id::{FrameId, TrackId};
    use wire::policy::Waived;
    use wire::sensor::{Modalities, ProductMode};
    use wire::time::Span;
    use wire::track::{Nearby, Tracks};

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

    /// A picture with these.
    fn shows(tracks: &[Track], nearby: Option<&[Nearby]>, stamp: Instant) -> Picture {
        let nearby = nearby.map(|nearby| nearby.iter().copied().collect());
        let (tracks, crops) = (tracks.iter().copied().collect(), List::default());
        let (frame, mode, mut picture) = (FrameId(1), ProductMode::Live, Picture::default());
        picture.take(Tracks { frame, stamp, mode, products: [None; 4], tracks, crops, nearby }, Waived::default());
        picture
    }

    fn count(things: &Things) -> usize {
        things.obstacles(Instant(0), [0.0; 2], core::iter::empty()).len()
    }

    #[test]
    fn thing_beside_the_unit_is_kept_until_seen_gone() {
        let mut things = Things::new(Arc::from([]), Instant(0));
        things.update(
            &shows(&[track(Class::Vehicle, (6000, 2500), Instant(0))], None, Instant(0)),
            &AT_THE_ORIGIN,
            Instant(0),
        );
        let motion = Motion { at: (6000.0, 0.0), ..AT_THE_ORIGIN };
        for second in 1..120 {
            things.update(
                &shows(&[], None, Instant::default() + Span::s(second)),
                &motion,
                Instant::default() + Span::s(second),
            );
        }
        assert_eq!(count(&things), 1, "it is beside, not in view");
        things.update(
            &shows(&[], None, Instant::default() + Span::s(121)),
            &AT_THE_ORIGIN,
            Instant::default() + Span::s(121),
        );
        assert_eq!(count(&things), 0, "its place was in view for a second, without it");
    }

    #[test]
    fn track_of_a_mapped_thing_is_that_thing() {
        let block = MapBox { x_mm: 8000, y_mm: 0, heading_mrad: 0, half_mm: [2100, 900], top_mm: 1500 };
        let mut things = Things::new(Arc::from([Thing::of_map(&block)]), Instant(0));
        things.update(
            &shows(&[track(Class::Decoy, (6200, 500), Instant(0))], None, Instant(0)),
            &AT_THE_ORIGIN,
            Instant(0),
        );
        assert_eq!(count(&things), 1);
        things.update(
            &shows(&[track(Class::Person, (6200, 500), Instant(0))], None, Instant(0)),
            &AT_THE_ORIGIN,
            Instant(0),
        );
        assert_eq!(count(&things), 2, "a person stands beside it");
        assert_eq!(
            things.obstacles(Instant(0), [1600.0; 2], core::iter::empty()).len(),
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
            things.update(&shows(&[seen], None, Instant(0)), &AT_THE_ORIGIN, Instant(0));
        }
        assert_eq!(count(&things), MOST);
        assert!(things.kept.iter().all(|remembered| remembered.at.0 < MOST as f64 * 5000.0), "the furthest went");
    }

    #[test]
    fn walker_who_turns_is_reckoned_to_walk() {
        let mut things = Things::new(Arc::from([]), Instant(0));
        let walker = |vx_mm_s, now| Track { vx_mm_s, ..track(Class::Person, (6000, 0), now) };
        let moves = |things: &Things, now| things.obstacles(now, [0.0; 2], core::iter::empty())[0].moves();
        let after = |ms| Instant(0) + Span::ms(ms);
        things.update(&shows(&[walker(1400, after(0))], None, after(0)), &AT_THE_ORIGIN, after(0));
        things.update(&shows(&[walker(0, after(500))], None, after(500)), &AT_THE_ORIGIN, after(500));
        assert!(moves(&things, after(500)), "he turns");
        things.update(
            &shows(&[Track { id: TrackId(2), ..walker(0, after(900)) }], None, after(900)),
            &AT_THE_ORIGIN,
            after(900),
        );
        assert!(moves(&things, after(900)), "under another number too");
        things.update(&shows(&[walker(0, after(6000))], None, after(6000)), &AT_THE_ORIGIN, after(6000));
        assert!(!moves(&things, after(6000)), "he stands");
    }

    fn nearby(number: u32, (x_mm, y_mm): (i32, i32), vx_mm_s: i32) -> Nearby {
        Nearby { number, x_mm, y_mm, vx_mm_s, vy_mm_s: 0, width_mm: 500 }
    }

    /// Without a product of the camera, and as long as LiDAR shows it.
    #[test]
    fn what_lidar_shows_behind_is_kept_clear_of() {
        let block = MapBox { x_mm: 8000, y_mm: 0, heading_mrad: 0, half_mm: [2100, 900], top_mm: 1500 };
        let mut things = Things::new(Arc::from([Thing::of_map(&block)]), Instant(0));
        let [rear, side_of_the_car] = [nearby(1, (-3000, 0), 1400), nearby(2, (6100, -1000), 0)];
        things.update(&shows(&[], Some(&[rear, side_of_the_car]), Instant(0)), &AT_THE_ORIGIN, Instant(0));
        assert_eq!(count(&things), 2, "the car of the map once");
        let walks = things.obstacles(Instant(0), [0.0; 2], core::iter::empty())[1];
        assert_eq!((walks.extent.at, walks.velocity), ((-3000.0, 0.0), (1400.0, 0.0)));
        let excess = things.obstacles(Instant(0), [1000.0; 2], core::iter::empty()).len();
        assert_eq!(excess, 1, "in the air what has no class is not known to be as high");
        things.update(&shows(&[], Some(&[]), Instant(0) + Span::s(1)), &AT_THE_ORIGIN, Instant(0) + Span::s(1));
        assert_eq!(count(&things), 1);
    }

    /// A person shown by LiDAR alone keeps the class, and stays one thing.
    #[test]
    fn person_who_leaves_the_view_is_followed_by_lidar() {
        let mut things = Things::new(Arc::from([]), Instant(0));
        let person = Track { vx_mm_s: -1400, ..track(Class::Person, (3000, 2500), Instant(0)) };
        things.update(&shows(&[person], Some(&[nearby(7, (3000, 2500), 0)]), Instant(0)), &AT_THE_ORIGIN, Instant(0));
        for tick in 1..40 {
            let now = Instant(0) + Span::ms(100 * tick);
            let seen = nearby(7, (3000 - 140 * tick as i32, 2500), -1400);
            things.update(&shows(&[], Some(&[seen]), now), &AT_THE_ORIGIN, now);
            let all = things.obstacles(now, [0.0; 2], core::iter::empty());
            assert_eq!(all.len(), 1, "{tick}: {all:?}");
            assert_eq!(all[0].extent.at.0, f64::from(seen.x_mm));
            assert_eq!(all[0].extent.half.0, half(Class::Person), "wide returns make no wide person");
        }
    }

    /// The place of a track that jumped from one thing to another.
    #[test]
    fn thing_that_lidar_never_shows_is_forgotten() {
        let kept_after = |shown: bool, distance: i32| {
            let mut things = Things::new(Arc::from([]), Instant(0));
            let place = (-distance, 0);
            things.update(
                &shows(&[track(Class::Obstacle, place, Instant(0))], Some(&[]), Instant(0)),
                &AT_THE_ORIGIN,
                Instant(0),
            );
            for tick in 1..30 {
                let now = Instant(0) + Span::ms(100 * tick);
                let seen = nearby(3, place, 0);
                let seen = if shown && tick < 10 { &[seen][..] } else { &[] };
                things.update(&shows(&[], Some(seen), now), &AT_THE_ORIGIN, now);
            }
            count(&things)
        };
        assert_eq!(
            (kept_after(false, 7000), kept_after(true, 7000)),
            (0, 1),
            "what it has shown may be too low for it from here"
        );
        assert_eq!(kept_after(false, 3000), 1, "so may what is near");
    }
}
