//! Things near the unit by LiDAR alone: where something stands above the ground, how wide it is, and whether it moves.
//!
//! The camera looks ahead and sees no feet; LiDAR looks all around. A thing by LiDAR alone is of no class and no ground
//! for an act, but a body keeps clear of it. The places are followed as sightings are ([`crate::tracker`]);
//! consequences are autonomy's to decide.

use wire::codec::List;
use wire::id::{FrameId, TrackId};
use wire::sensor::{Class, Cluster, Modalities, Modality};
use wire::time::{Instant, Span};
use wire::track::{NEARBY, Nearby, Track};

use crate::corroborate::Sighting;
use crate::pose::Placement;
use crate::tracker::Tracker;

/// Clusters further away are left out, metres: ten times the way in which a unit of 3 m/s stops.
const NEAR_M: f64 = 12.0;
/// Most clusters of a frame that are followed, the nearest. Fewer than the things that are reported: a thing no longer
/// shown keeps its place for a second.
const NEAREST: usize = 20;
/// Deviation of a cluster's place on each axis, metres: twice that of its returns, for its middle moves as the unit
/// passes.
const SIGMA_M: f64 = 0.15;
/// Score of a cluster as a sighting, permille. Only whether it stands counts here.
const SCORE: u16 = 1000;
/// A track takes its width from a cluster within this distance, millimetres.
const SAME_MM: f64 = 1000.0;
/// Least displacement of the middle that counts as motion, millimetres. Added to it is the displacement that the unit's
/// own motion can cause, because LiDAR then sees another side: the way of the unit, at most half of the width.
const MOVES_MM: f64 = 300.0;
/// Time after which the place of a thing that stands is taken again.
const STOOD_FOR: Span = Span::s(1);
/// Speed below which a thing counts as standing, mm/s.
const STANDS_MM_S: f64 = 300.0;

/// Things that LiDAR shows nearby.
#[derive(Clone, Debug, Default)]
pub struct Followed {
    tracker: Tracker<NEARBY>,
    shapes: Vec<Shape>,
    looked: bool,
    /// Place of the unit at the newest frame that had one.
    own: (f64, f64),
}

/// The width of a thing and where it stood, which its track does not tell.
#[derive(Clone, Copy, Debug)]
struct Shape {
    track: TrackId,
    width_mm: u16,
    /// Place of the thing when it last stood, that time, and the unit's place then.
    stood: (f64, f64),
    since: Instant,
    from: (f64, f64),
}

impl Followed {
    /// Takes the clusters of one frame, absent where LiDAR gave no product. Without `ego` no cluster can be placed.
    pub fn update(
        &mut self,
        (frame, stamp): (FrameId, Instant),
        ego: Option<&Placement>,
        clusters: Option<&[Cluster]>,
    ) {
        self.looked = clusters.is_some() && ego.is_some();
        self.own = ego.map_or(self.own, |ego| world([0.0, 0.0], ego));
        let mut near: Vec<&Cluster> = clusters.unwrap_or_default().iter().filter(|cluster| is_near(cluster)).collect();
        near.sort_by(|a, b| range(a).total_cmp(&range(b)));
        near.truncate(NEAREST);
        let sightings: Vec<Sighting> = near.iter().map(|cluster| sighting(cluster)).collect();
        self.tracker.update(frame, stamp, ego, &sightings);
        let tracks = self.tracker.tracks();
        self.shapes.retain(|shape| tracks.iter().any(|track| track.id == shape.track));
        let placed: Vec<((f64, f64), u16)> =
            ego.map_or(Vec::new(), |ego| near.iter().map(|cluster| (placed(cluster, ego), cluster.width_mm)).collect());
        for track in tracks.iter() {
            self.note(stamp, track, &placed);
        }
    }

    /// Things that are followed, oldest first; `None` where the newest frame had no product of LiDAR.
    pub fn things(&self) -> Option<List<Nearby, NEARBY>> {
        let tracks = self.tracker.tracks();
        let shape = |track: &Track| self.shapes.iter().find(|shape| shape.track == track.id);
        self.looked
            .then(|| tracks.iter().filter_map(|track| shape(track).map(|shape| shape.thing(track, self.own))).collect())
    }

    fn note(&mut self, now: Instant, track: &Track, placed: &[((f64, f64), u16)]) {
        let (position, own_place) = (place(track), self.own);
        let nearest = placed.iter().min_by(|a, b| distance(a.0, position).total_cmp(&distance(b.0, position)));
        let width = nearest.filter(|(place, _)| distance(*place, position) < SAME_MM).map(|(_, width_mm)| *width_mm);
        let index = self.shapes.iter().position(|shape| shape.track == track.id).unwrap_or_else(|| {
            self.shapes.push(Shape { track: track.id, width_mm: 0, stood: position, since: now, from: own_place });
            self.shapes.len() - 1
        });
        let shape = &mut self.shapes[index];
        shape.width_mm = width.unwrap_or(shape.width_mm);
        let displaced = shape.is_displaced(position, own_place);
        if displaced && speed(track) < STANDS_MM_S || !displaced && now.since(shape.since) >= STOOD_FOR {
            (shape.stood, shape.since, shape.from) = (position, now, own_place);
        }
    }
}

impl Shape {
    fn is_displaced(&self, place: (f64, f64), own_place: (f64, f64)) -> bool {
        distance(self.stood, place) > distance(self.from, own_place).min(f64::from(self.width_mm) / 2.0) + MOVES_MM
    }

    fn thing(&self, track: &Track, own_place: (f64, f64)) -> Nearby {
        let moves = self.is_displaced(place(track), own_place);
        let [vx_mm_s, vy_mm_s] = if moves { [track.vx_mm_s, track.vy_mm_s] } else { [0, 0] };
        Nearby { number: track.id.0, x_mm: track.x_mm, y_mm: track.y_mm, vx_mm_s, vy_mm_s, width_mm: self.width_mm }
    }
}

fn is_near(cluster: &Cluster) -> bool {
    range(cluster) < NEAR_M * 1000.0
}

/// Distance of a cluster, millimetres.
fn range(cluster: &Cluster) -> f64 {
    libm::hypot(f64::from(cluster.x_mm), f64::from(cluster.y_mm))
}

fn sighting(cluster: &Cluster) -> Sighting {
    Sighting {
        class: Class::Obstacle,
        score: SCORE,
        place: [f64::from(cluster.x_mm) / 1000.0, f64::from(cluster.y_mm) / 1000.0],
        sigma: SIGMA_M,
        supported: Modalities::default().with_modality(Modality::Lidar),
        vetoed: Modalities::default(),
        absent: Modalities::default(),
        complete: true,
        bounds: None,
    }
}

fn placed(cluster: &Cluster, ego: &Placement) -> (f64, f64) {
    world([f64::from(cluster.x_mm) / 1000.0, f64::from(cluster.y_mm) / 1000.0], ego)
}

/// A place in the body frame, metres, in the world frame, millimetres.
fn world(place: [f64; 2], ego: &Placement) -> (f64, f64) {
    let [east, north] = ego.to_world(place);
    (east * 1000.0, north * 1000.0)
}

fn place(track: &Track) -> (f64, f64) {
    (f64::from(track.x_mm), f64::from(track.y_mm))
}

fn speed(track: &Track) -> f64 {
    libm::hypot(f64::from(track.vx_mm_s), f64::from(track.vy_mm_s))
}

fn distance(a: (f64, f64), b: (f64, f64)) -> f64 {
    libm::hypot(a.0 - b.0, a.1 - b.1)
}

#[cfg(test)]
mod tests {
    use wire::time::Span;

    use super::*;

    /// The things that are followed after `frames` of a cluster at `at(seconds)`, metres in the world frame, from a
    /// unit at `own(seconds)` on the x axis.
    fn followed(
        frames: u64,
        place_of: impl Fn(f64) -> [f64; 2],
        own_x: impl Fn(f64) -> f64,
        width_mm: u16,
    ) -> Vec<Nearby> {
        let mut followed = Followed::default();
        for n in 1..=frames {
            let seconds = n as f64 * 0.1;
            let ego = Placement::ORIGIN.moved(own_x(seconds));
            let [x, y] = place_of(seconds);
            let [x_mm, y_mm] = [x - own_x(seconds), y].map(|metres| (metres * 1000.0) as i32);
            let cluster = Cluster { x_mm, y_mm, width_mm, height_mm: 1500 };
            followed.update((FrameId(n), Instant(0) + Span::ms(100 * n)), Some(&ego), Some(&[cluster]));
        }
        followed.things().unwrap().to_vec()
    }

    #[test]
    fn walker_behind_the_unit_is_followed() {
        let seen = followed(12, |s| [-4.0, -3.0 + 1.4 * s], |_| 0.0, 450);
        let [walker] = seen[..] else { panic!("{seen:?}") };
        assert!((walker.vy_mm_s - 1400).abs() < 200 && walker.vx_mm_s.abs() < 100, "{walker:?}");
        assert!((walker.y_mm + 1320).abs() < 150, "{walker:?}");
        assert_eq!(followed(12, |s| [-14.0, -3.0 + 1.4 * s], |_| 0.0, 450), [], "far away");
    }

    /// The middle of its returns moves as the unit passes.
    #[test]
    fn car_that_is_passed_stands() {
        let slides = |s: f64| [4.0 + 1.1 * s, 2.5];
        let seen = followed(20, slides, |s| 2.0 * s, 4500);
        assert_eq!(seen[0].vx_mm_s, 0, "{seen:?}");
        let sets_out = followed(8, slides, |_| 0.0, 4500);
        assert!(sets_out[0].vx_mm_s > 700, "of a unit that stands: {sets_out:?}");
    }

    /// Things that were followed before it keep no place from it.
    #[test]
    fn nearest_thing_is_followed_among_many() {
        let cluster = |x_mm, y_mm| Cluster { x_mm, y_mm, width_mm: 400, height_mm: 1500 };
        let mut other_clusters: Vec<Cluster> =
            (0..40).map(|n| cluster(8000 - 3000 * (n % 2), 2000 * n - 40_000)).collect();
        other_clusters.extend((0..24).map(|n| cluster(-4000 - 300 * n, 2000 * (n % 3) - 2000)));
        let mut followed = Followed::default();
        let mut show = |from: u64, clusters: &[Cluster]| {
            for n in from..from + 10 {
                followed.update((FrameId(n), Instant(0) + Span::ms(100 * n)), Some(&Placement::ORIGIN), Some(clusters));
            }
            followed.things().unwrap()
        };
        assert!(show(1, &other_clusters).len() >= 16);
        other_clusters.push(cluster(-1500, 0));
        let near = |thing: &Nearby| (thing.x_mm, thing.y_mm) == (-1500, 0);
        assert!(show(11, &other_clusters).iter().any(near));
    }

    #[test]
    fn frame_without_lidar_tells_no_things_nearby() {
        let mut without_tracks = Followed::default();
        without_tracks.update((FrameId(1), Instant(1)), Some(&Placement::ORIGIN), None);
        assert_eq!(without_tracks.things(), None);
        without_tracks.update((FrameId(2), Instant(2)), Some(&Placement::ORIGIN), Some(&[]));
        assert_eq!(without_tracks.things().unwrap().len(), 0);
    }
}
