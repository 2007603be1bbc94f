//! The plan of a world while it is drawn: start, way points, fence and things, and the resulting scene.
//!
//! Metres, east and north; headings in radians, anticlockwise from east.

use super::MOST_STILL;
use super::chance::Chance;
use crate::footprint::{At, Footprint};
use crate::scene::{Ground, Object, Pose, Scene, Weather};
use crate::value::{List, Located, Name, Real};
use wire::sensor::Class;

/// The plan.
#[derive(Default)]
pub(super) struct Plan {
    pub(super) start: (At, f64),
    pub(super) route: Vec<At>,
    fence: Vec<At>,
    /// Greatest height of the ground above or below its mean.
    pub(super) amplitude: f64,
    still: Vec<(Footprint, Object)>,
    /// Points of the path, half of the width, and the object.
    moving: Vec<(Vec<At>, f64, Object)>,
}

/// Room that a still thing leaves around start and way points.
const ROOM: f64 = 2.0;
/// Least gap between still things that are placed by chance.
const GAP: f64 = 0.15;

/// Most paths that are drawn for one person.
const PATHS: usize = 8;
/// Distance between the places of a path that are tested, metres.
const PATH_STEP: f64 = 0.1;

impl Plan {
    /// A plan with its start, and a fence around the middle: half of its sides is `fence`, east and north.
    pub(super) fn new(start: At, heading: f64, fence: At) -> Self {
        let [east, north] = fence;
        let fence = vec![[-east, -north], [east, -north], [east, north], [-east, north]];
        Self { start: (start, heading), fence, amplitude: 0.1, ..Self::default() }
    }

    /// Parks the vehicle in sight of the start: 12 to 14 m ahead of it and `aside`, positive to the left.
    pub(super) fn park_in_sight(&mut self, chance: &mut Chance, aside: f64) {
        let ([east, north], heading) = self.start;
        let ahead = chance.uniform(12.0, 14.0);
        let (sin, cos) = libm::sincos(heading);
        let place = [east + ahead * cos - aside * sin, north + ahead * sin + aside * cos];
        self.car(chance, place, heading);
    }

    /// A parked car, unless it meets a thing, the start or a way point; true if it stands.
    pub(super) fn car(&mut self, chance: &mut Chance, place: At, heading: f64) -> bool {
        let size = [chance.uniform(3.9, 4.6), chance.uniform(1.7, 1.9), chance.uniform(1.4, 1.7)];
        self.parked(chance, size, place, heading)
    }

    /// Adds a parked vehicle of this size.
    pub(super) fn parked(&mut self, chance: &mut Chance, size: [f64; 3], place: At, heading: f64) -> bool {
        let warmth = chance.uniform(288.0, 318.0);
        let colour = [60 + chance.integer(0, 120), 80, 150].map(|part| part as u8);
        self.stand((Class::Vehicle, size, warmth, colour), place, heading, Some(GAP))
    }

    /// A block of this size, unless it meets a thing, the start or a way point; true if it stands.
    pub(super) fn block(&mut self, size: [f64; 3], place: At, heading: f64) -> bool {
        self.stand((Class::Obstacle, size, 288.0, [110, 100, 90]), place, heading, Some(GAP))
    }

    /// Adds a part of a wall, which may touch others.
    pub(super) fn wall(&mut self, size: [f64; 3], place: At, heading: f64) -> bool {
        self.stand((Class::Obstacle, size, 288.0, [110, 100, 90]), place, heading, None)
    }

    fn stand(&mut self, (class, size, warmth, colour): Kind, at: At, heading: f64, gap: Option<f64>) -> bool {
        let footprint = Footprint { at, heading, size: [size[0], size[1]] };
        let near = |place: &At| footprint.distance(*place) < ROOM;
        let met = gap.is_some_and(|gap| self.still.iter().any(|(other, _)| footprint.meets(other, gap)));
        if self.still.len() >= MOST_STILL || met || near(&self.start.0) || self.route.iter().any(near) {
            return false;
        }
        let object = object((class, size, warmth, colour), &[at], heading);
        self.still.push((footprint, object));
        true
    }

    /// Adds a person who walks the points of a path for ever. Of the [`PATHS`] drawn the first counts that leads
    /// anywhere and meets no still thing; without one no person is added.
    pub(super) fn person<const POINTS: usize>(
        &mut self,
        chance: &mut Chance,
        mut path: impl FnMut(&mut Chance) -> [At; POINTS],
    ) {
        let kind = (Class::Person, [0.5, 0.5, 1.75], 306.0, [150, 40, 40]);
        // Normal walking is 1.34 ± 0.26 m/s (Helbing and Molnár 1995).
        let speed = chance.uniform(0.8, 1.8);
        let path =
            (0..PATHS).map(|_| path(chance)).find(|path| leads_away(path) && self.is_free(path, kind.1[1] / 2.0));
        if let Some(path) = path {
            self.add_mover(chance, kind, &path, speed);
        }
    }

    /// A thing on wheels of this size that goes these points for ever.
    pub(super) fn cart(&mut self, chance: &mut Chance, size: [f64; 3], path: &[At], speed: f64) {
        let class = if size[0] > 2.5 { Class::Vehicle } else { Class::Obstacle };
        self.add_mover(chance, (class, size, 312.0, [180, 140, 40]), path, speed);
    }

    /// True if a thing of `half` of a width meets no still thing on its rounds of these points.
    fn is_free(&self, path: &[At], half: f64) -> bool {
        let legs = path.iter().zip(path.iter().cycle().skip(1));
        let places = legs.flat_map(|(from, to)| {
            let steps = libm::ceil(distance(*from, *to) / PATH_STEP).max(1.0);
            (0..steps as u32).map(move |step| {
                let share = f64::from(step) / steps;
                [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]))
            })
        });
        let places: Vec<At> = places.collect();
        self.still.iter().all(|(thing, _)| {
            let distance = thing.distances();
            places.iter().all(|place| distance(*place) > half)
        })
    }

    fn add_mover(&mut self, chance: &mut Chance, kind: Kind, path: &[At], speed: f64) {
        let half = kind.1[1] / 2.0;
        let mut moving = object(kind, path, 0.0);
        moving.speed_m_s = Real::nearest(hundredths(speed));
        moving.departs_s = Real::nearest(hundredths(chance.uniform(0.0, 30.0)));
        moving.closed = true;
        self.moving.push((path.to_vec(), half, moving));
    }

    /// The plan with things that move and yield to the unit, or do not.
    pub(super) fn yielding(mut self, yields: bool) -> Self {
        self.moving.iter_mut().for_each(|(_, _, moving)| moving.yields = yields);
        self
    }

    /// The whole as a scene, its ground with this seed. A mover with a still thing in its path is left out.
    pub(super) fn scene(self, seed: u32) -> Scene {
        let ((start, heading), mut number) = (self.start, 0);
        // A cart's path is not tested when it is added, and still things may be added later.
        let free = self.moving.iter().filter(|(path, half, _)| self.is_free(path, *half));
        let moving: Vec<Object> = free.map(|(_, _, object)| object.clone()).collect();
        let objects = self.still.into_iter().map(|(_, object)| object).chain(moving);
        let named = objects.map(|mut object| {
            number += 1;
            let text = match object.class {
                Class::Vehicle => "vehicle",
                Class::Person => "person",
                Class::Decoy => "decoy",
                Class::Obstacle => "obstacle",
            };
            object.name = name(&format!("{text}-{number}"));
            object
        });
        // 4 × amplitude / wavelength bounds the slope of the relief: 0.1.
        let wavelength = (self.amplitude * 40.0).max(22.0);
        Scene {
            start: Located::nowhere(Pose { at_m: point(start), heading_rad: Real::nearest(hundredths(heading)) }),
            route: Located::nowhere(List::from_first(self.route.into_iter().map(point).map(Located::nowhere))),
            geofence: Located::nowhere(List::from_first(self.fence.into_iter().map(point))),
            ground: Ground {
                seed,
                amplitude_m: Real::nearest(hundredths(self.amplitude)),
                wavelength_m: Real::nearest(hundredths(wavelength)),
                ..Ground::default()
            },
            weather: Weather::default(),
            perturbation: None,
            object: List::from_first(named),
        }
    }
}

/// Shortest and longest route to aim at, metres, and most of its way points.
const ROUTE_M: [f64; 2] = [260.0, 600.0];
const MOST_POINTS: usize = 40;

/// Rounds by the same places until the route is long enough.
pub(super) fn rounds(chance: &mut Chance, places: &[At]) -> Vec<At> {
    let length: f64 = places.iter().zip(places.iter().cycle().skip(1)).map(|(a, b)| distance(*a, *b)).sum();
    let wanted = chance.uniform(ROUTE_M[0], ROUTE_M[1]) / length.max(1.0);
    let least = libm::ceil(ROUTE_M[0] / length.max(1.0));
    let rounds = wanted.round().max(least).min((MOST_POINTS / places.len().max(1)) as f64);
    places.iter().copied().cycle().take(places.len() * rounds as usize).collect()
}

/// Places from `next`, each far from the one before and the first from the start, until the route is long enough.
pub(super) fn wander(chance: &mut Chance, start: At, mut next: impl FnMut(&mut Chance) -> At) -> Vec<At> {
    let length = chance.uniform(ROUTE_M[0], ROUTE_M[1]);
    let mut route: Vec<At> = Vec::new();
    let mut travelled = 0.0;
    while travelled < length && route.len() < MOST_POINTS {
        let tries = [next(chance), next(chance), next(chance)];
        let last = route.last().copied().unwrap_or(start);
        let furthest =
            tries.into_iter().max_by(|a, b| distance(*a, last).total_cmp(&distance(*b, last))).unwrap_or(start);
        travelled += distance(furthest, last);
        route.push(furthest);
    }
    route
}

/// True if a path is more than a place: a person who walked nowhere could stand on a way point for ever.
fn leads_away(path: &[At]) -> bool {
    path.iter().any(|place| distance(*place, path[0]) > 1.0)
}

pub(super) fn distance(a: At, b: At) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}

/// Class, size, temperature and paint.
type Kind = (Class, [f64; 3], f64, [u8; 3]);

fn object((class, size, warmth, colour): Kind, path: &[At], heading: f64) -> Object {
    Object {
        name: name("object"),
        class,
        path_m: Located::nowhere(List::from_first(path.iter().copied().map(point))),
        heading_rad: Real::nearest(hundredths(heading)),
        size_m: size.map(|edge| Real::nearest(hundredths(edge))),
        temperature_k: Real::nearest(warmth.round()),
        heated_s: None,
        colour,
        painted_as: None,
        warm_as: None,
        print: None,
        speed_m_s: Real::nearest(0.0),
        departs_s: Real::nearest(0.0),
        closed: false,
        yields: false,
    }
}

fn name(text: &str) -> Located<Name> {
    Located::nowhere(Name::new(text).expect("invariant: a class and a number fit the alphabet"))
}

fn point(place: At) -> [Real<-500_000, 500_000>; 2] {
    place.map(|along| Real::nearest(hundredths(along)))
}

/// A number as the file has it, to centimetres and hundredths of a radian.
fn hundredths(value: f64) -> f64 {
    (value * 100.0).round() / 100.0
}
