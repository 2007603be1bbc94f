//! The scene: the parts of a world, as data.
//!
//! A scene is written by a scenario and read by every sim of a run; each unit has its own sim with the same scene and
//! another [`StartPose`]. Coordinates are ENU metres, x east and y north of the scene's centre; headings are radians
//! counter-clockwise from east. [`Scene::check`] is the only gate: a scene that passes it can be built without failing.
//! Leaves physics to `world` and appearance to `sensor`.

use serde::{Deserialize, Serialize};
use wire::sensor::Class;

use crate::limits::{SceneError, check_range, count};
use crate::weather::Weather;
use crate::wind::Wind;
use ground_truth::perturbation::{self, Perturbation};
use ground_truth::print::{self, Print};

/// Most objects a scene may have.
pub const MAX_OBJECTS: usize = 64;
/// Most points in a route, a geofence or an object's path.
pub const MAX_POINTS: usize = 64;
/// Half the side of the square that scene coordinates must lie in, metres.
pub const HALF_EXTENT: f32 = 500.0;

/// A point on the ground: metres east, metres north.
pub type Point = [f32; 2];

/// Start pose of a unit, at standstill.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StartPose {
    /// Metres east.
    pub east: f32,
    /// Metres north.
    pub north: f32,
    /// Radians counter-clockwise from east.
    pub heading: f32,
}

/// Smooth uneven ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ground {
    /// Seed of the relief.
    pub seed: u64,
    /// Greatest height above or below the mean, metres.
    pub amplitude: f32,
    /// Distance between neighbouring hills, metres.
    pub wavelength: f32,
    /// Temperature of ground and air, kelvin.
    pub kelvin: f32,
}

/// A true object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Object {
    /// Class of the object.
    pub class: Class,
    /// Length along its heading, width and height, metres.
    pub size: [f32; 3],
    /// Temperature of its warm parts, kelvin.
    pub kelvin: f32,
    /// Seconds after the start of the run at which its heating begins and ends; without them it has been on for long.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heated: Option<[f32; 2]>,
    /// Colour of the paint.
    pub colour: [u8; 3],
    /// Disguise of the object.
    #[serde(default)]
    pub disguise: Disguise,
    /// Print on its sides.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub print: Option<Print>,
    /// Points of the path: with one the object stands there, with more it drives from point to point.
    pub path: Vec<Point>,
    /// Heading while it stands, radians; along the path it faces where it goes.
    #[serde(default)]
    pub heading: f32,
    /// Speed along the path, m/s.
    #[serde(default)]
    pub speed: f32,
    /// Departure, seconds after the start of the run.
    #[serde(default)]
    pub departs: f32,
    /// True if it goes on from the last point to the first, for ever.
    #[serde(default)]
    pub closed: bool,
    /// True if it stops 3 m before the unit, and turns back when it has stood there for 10 s.
    #[serde(default)]
    pub yields: bool,
}

/// Imitated appearance of an object, by modality. Its shape is its size, and needs no other disguise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Disguise {
    /// Painted like an object of this class.
    pub paint: Option<Class>,
    /// Warm where an object of this class is.
    pub warmth: Option<Class>,
}

/// The whole scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Start pose of this sim's unit.
    pub start: StartPose,
    /// Waypoints of the mission; sim only passes them on.
    pub route: Vec<Point>,
    /// Geofence: a simple polygon, in order, not closed by a repeated point.
    pub geofence: Vec<Point>,
    /// True objects; an object's id is its index.
    pub objects: Vec<Object>,
    /// Relief and temperature of the ground.
    pub ground: Ground,
    /// Light and air.
    #[serde(default)]
    pub weather: Weather,
    /// Motion of the air; it moves bodies that fly.
    #[serde(default)]
    pub wind: Wind,
    /// Perturbation that faults of that kind add to colour images.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub perturbation: Option<Perturbation>,
}

impl Default for Scene {
    /// A loop of about 60 m inside a fence of 80 m × 80 m, with one object of each class.
    fn default() -> Self {
        let object = |class, size, kelvin, colour, place, heading| Object {
            class,
            size,
            kelvin,
            heated: None,
            colour,
            disguise: Disguise::default(),
            print: None,
            path: vec![place],
            heading,
            speed: 0.0,
            departs: 0.0,
            closed: false,
            yields: false,
        };
        let walker = Object {
            path: vec![[18.0, 4.0], [18.0, 20.0], [6.0, 20.0]],
            speed: 1.2,
            closed: true,
            ..object(Class::Person, [0.5, 0.5, 1.75], 306.0, [150, 40, 40], [0.0, 0.0], 0.0)
        };
        Scene {
            start: StartPose { east: -10.0, north: -5.0, heading: 0.0 },
            route: vec![[8.0, -6.0], [10.0, 4.0], [0.0, 8.0], [-10.0, 6.0], [-12.0, -4.0]],
            geofence: vec![[-40.0, -40.0], [40.0, -40.0], [40.0, 40.0], [-40.0, 40.0]],
            objects: vec![
                object(Class::Vehicle, [4.2, 1.8, 1.6], 318.0, [60, 80, 150], [22.0, -6.0], 1.2),
                walker,
                object(Class::Decoy, [4.2, 1.8, 1.6], 289.0, [70, 85, 140], [18.0, -15.0], 0.7),
                object(Class::Obstacle, [1.5, 1.5, 1.2], 288.0, [110, 100, 90], [2.0, 18.0], 0.3),
            ],
            ground: Ground { seed: 1, amplitude: 0.35, wavelength: 22.0, kelvin: 288.0 },
            weather: Weather::CLEAR,
            wind: Wind::default(),
            perturbation: None,
        }
    }
}

impl Scene {
    /// Distance of the outermost of start, way points, fence and objects from the middle, along an axis, metres.
    pub(crate) fn reach(&self) -> f32 {
        let start = [[self.start.east, self.start.north]];
        let paths = self.objects.iter().flat_map(|object| &object.path);
        let all = start.iter().chain(&self.route).chain(&self.geofence).chain(paths);
        all.flatten().fold(0.0, |reach, along| reach.max(along.abs()))
    }

    /// Refuses scenes that could not be built or have no bound.
    pub fn check(&self) -> Result<(), SceneError> {
        point("start", [self.start.east, self.start.north])?;
        check_range("start.heading", self.start.heading, -7.0, 7.0)?;
        count("route", self.route.len(), 0, MAX_POINTS)?;
        self.route.iter().try_for_each(|p| point("route", *p))?;
        count("geofence", self.geofence.len(), 3, MAX_POINTS)?;
        self.geofence.iter().try_for_each(|p| point("geofence", *p))?;
        check_range("ground.amplitude", self.ground.amplitude, 0.0, 1.0)?;
        check_range("ground.wavelength", self.ground.wavelength, 10.0, 200.0)?;
        check_range("ground.kelvin", self.ground.kelvin, 200.0, 350.0)?;
        self.weather.check()?;
        self.wind.check()?;
        let fields = perturbation::ROWS * perturbation::COLUMNS;
        self.perturbation.iter().try_for_each(|p| count("perturbation", p.fields().len(), fields, fields))?;
        count("objects", self.objects.len(), 0, MAX_OBJECTS)?;
        self.objects.iter().try_for_each(Object::check)
    }

    /// Refuses features that only rendered sensors know.
    pub fn unrendered(&self) -> Result<(), SceneError> {
        let printed = self.objects.iter().any(|object| object.print.is_some());
        let what = match (self.weather.is_clear(), printed, self.perturbation.is_some()) {
            (false, _, _) => "weather",
            (true, true, _) => "an object with a print",
            (true, false, true) => "a perturbation of its images",
            (true, false, false) => return Ok(()),
        };
        Err(SceneError::NeedsRendering { what })
    }

    /// Signed distance to the geofence in metres: positive inside.
    pub fn margin(&self, place: Point) -> f32 {
        let n = self.geofence.len();
        let mut nearest = f32::MAX;
        let mut inside = false;
        for i in 0..n {
            let (a, b) = (self.geofence[i], self.geofence[(i + 1) % n]);
            nearest = nearest.min(distance_to_segment(place, a, b));
            let crosses = (a[1] > place[1]) != (b[1] > place[1]);
            if crosses && place[0] < (b[0] - a[0]) * (place[1] - a[1]) / (b[1] - a[1]) + a[0] {
                inside = !inside;
            }
        }
        if inside { nearest } else { -nearest }
    }
}

impl Object {
    fn check(&self) -> Result<(), SceneError> {
        self.size.iter().try_for_each(|s| check_range("object.size", *s, 0.1, 20.0))?;
        let fields = print::ROWS * print::COLUMNS;
        self.print.iter().try_for_each(|p| count("object.print", p.fields().len(), fields, fields))?;
        let heat = self.print.iter().map(|print| print.heat().len()).filter(|heat| *heat > 0);
        heat.into_iter().try_for_each(|heat| count("object.print.heat", heat, fields, fields))?;
        check_range("object.kelvin", self.kelvin, 200.0, 650.0)?;
        let [begins, ends] = self.heated.unwrap_or_default();
        check_range("object.heated", begins, 0.0, 86_400.0)?;
        check_range("object.heated", ends, begins, 86_400.0)?;
        count("object.path", self.path.len(), 1, MAX_POINTS)?;
        self.path.iter().try_for_each(|p| point("object.path", *p))?;
        check_range("object.heading", self.heading, -7.0, 7.0)?;
        check_range("object.speed", self.speed, 0.0, 15.0)?;
        check_range("object.departs", self.departs, 0.0, 86_400.0)
    }

    /// The class that its paint is of.
    pub fn paint(&self) -> Class {
        self.disguise.paint.unwrap_or(self.class)
    }

    /// The class that its warm parts are of.
    pub fn warm_as(&self) -> Class {
        self.disguise.warmth.unwrap_or(self.class)
    }

    /// Share of its warmth above or below the ground that it has `seconds` after the start.
    pub fn heat_share(&self, seconds: f64) -> f32 {
        let share = |[begins, ends]: [f32; 2]| {
            let (travelled, takes) = (seconds - f64::from(begins), f64::from(ends - begins));
            if travelled < takes { (travelled / takes).max(0.0) as f32 } else { 1.0 }
        };
        self.heated.map_or(1.0, share)
    }

    /// True if it ever moves.
    pub fn moves(&self) -> bool {
        self.path.len() > 1 && self.speed > 0.0
    }

    /// Parts of its path between neighbouring points, with the one back to the first where it is closed.
    fn legs(&self) -> usize {
        self.path.len() - usize::from(!self.closed)
    }

    /// Length of its path, metres.
    fn way(&self) -> f64 {
        let next = |i: usize| self.path[(i + 1) % self.path.len()];
        (0..self.legs()).map(|i| length((self.path[i], next(i)))).sum()
    }

    /// Time for which it stands before it departs, and the time of one round; of a path that is not closed there is
    /// none. Seconds.
    pub(crate) fn round(&self) -> Option<[f64; 2]> {
        let goes_round = self.closed && self.moves() && self.way() > 0.0;
        goes_round.then(|| [f64::from(self.departs), self.way() / f64::from(self.speed)])
    }

    /// Place and heading (radians) `seconds` after the start: a closed form, so no error accumulates.
    pub fn place(&self, seconds: f64) -> (Point, f32) {
        if !self.moves() {
            return (self.path[0], self.heading);
        }
        let legs = self.legs();
        let leg = |i: usize| (self.path[i], self.path[(i + 1) % self.path.len()]);
        let total = self.way();
        let travelled = (seconds - f64::from(self.departs)).max(0.0) * f64::from(self.speed);
        let mut left = if self.closed && total > 0.0 { travelled % total } else { travelled.min(total) };
        for i in 0..legs {
            let (a, b) = leg(i);
            let len = length((a, b));
            if left <= len && len > 0.0 || i + 1 == legs {
                let share = if len > 0.0 { (left / len).min(1.0) as f32 } else { 0.0 };
                let position = [a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share];
                return (position, libm::atan2f(b[1] - a[1], b[0] - a[0]));
            }
            left -= len;
        }
        (self.path[0], self.heading)
    }
}

fn length((a, b): (Point, Point)) -> f64 {
    let (dx, dy) = (f64::from(b[0] - a[0]), f64::from(b[1] - a[1]));
    (dx * dx + dy * dy).sqrt()
}

fn distance_to_segment(p: Point, a: Point, b: Point) -> f32 {
    let (ab, ap) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let len2 = ab[0] * ab[0] + ab[1] * ab[1];
    let t = if len2 > 0.0 { ((ap[0] * ab[0] + ap[1] * ab[1]) / len2).clamp(0.0, 1.0) } else { 0.0 };
    let (dx, dy) = (ap[0] - ab[0] * t, ap[1] - ab[1] * t);
    (dx * dx + dy * dy).sqrt()
}

fn point(field: &'static str, p: Point) -> Result<(), SceneError> {
    check_range(field, p[0], -HALF_EXTENT, HALF_EXTENT)?;
    check_range(field, p[1], -HALF_EXTENT, HALF_EXTENT)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_nan_is_refused_by_name() {
        let mut scene = Scene::default();
        assert_eq!(scene.check(), Ok(()));
        scene.objects[0].size[1] = f32::NAN;
        assert!(matches!(scene.check(), Err(SceneError::OutOfRange { field: "object.size", .. })));
    }

    #[test]
    fn fence_margin_is_distance_to_the_nearest_side() {
        let scene = Scene::default();
        assert_eq!(scene.margin([0.0, 0.0]), 40.0);
        assert_eq!(scene.margin([37.0, 10.0]), 3.0);
        assert_eq!(scene.margin([42.0, 0.0]), -2.0);
    }

    #[test]
    fn heating_rises_evenly_between_its_times() {
        let mut object = Scene::default().objects[0].clone();
        assert_eq!(object.heat_share(0.0), 1.0, "without times it is warm all along");
        object.heated = Some([2.0, 4.0]);
        assert_eq!([0.0, 2.0, 3.0, 4.0, 9.0].map(|age_s| object.heat_share(age_s)), [0.0, 0.0, 0.5, 1.0, 1.0]);
        object.heated = Some([2.0, 2.0]);
        assert_eq!([1.9, 2.0].map(|age_s| object.heat_share(age_s)), [0.0, 1.0]);
        let mut scene = Scene::default();
        scene.objects[0].heated = Some([4.0, 2.0]);
        assert!(matches!(scene.check(), Err(SceneError::OutOfRange { field: "object.heated", .. })));
    }

    #[test]
    fn closed_path_repeats_and_open_path_ends() {
        let mut object = Scene::default().objects[1].clone();
        object.path = vec![[0.0, 0.0], [3.0, 0.0], [3.0, 4.0]];
        object.speed = 1.0;
        assert_eq!(object.place(12.0).0, [0.0, 0.0]);
        assert_eq!(object.place(13.0).0, [1.0, 0.0]);
        object.closed = false;
        assert_eq!(object.place(100.0).0, [3.0, 4.0]);
    }
}
