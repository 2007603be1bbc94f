//! Corroboration of the detector and the other stages in one frame, before any tracking.
//!
//! An unvetoed sighting is right within 2 m (the bound of property P11) of an object of its class.

use perception::corroborate::{CorroborationLimits, corroborate};
use perception::stages::{StageClaims, Stages};
use serde::Serialize;
use sim::scene::StartPose;
use wire::id::ObjectId;
use wire::sensor::{Class, Modalities};

use crate::draw::distance;
use crate::example::{Example, counts};

/// A sighting is right within this distance of an object of its class, metres.
const NEAR_M: f32 = 2.0;

/// Sightings that stand, and objects that there were.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Sightings {
    /// Objects that show enough of themselves.
    pub objects: u32,
    /// Objects with a sighting of their class near them.
    pub found: u32,
    /// Unvetoed sightings.
    pub given: u32,
    /// Detections near an object of their class.
    pub right: u32,
    /// Sum of the squared distances of those from their object, square metres.
    pub squares_m2: f64,
}

impl Sightings {
    /// Adds the detections of one frame.
    pub fn add(&mut self, stages: &Stages, limits: &CorroborationLimits, example: &Example) {
        let seen = standing(stages, limits, example);
        for label in example.frame.labels.iter().filter(|l| counts(l)) {
            let position = example.scene.objects[usize::from(label.object.0)].path[0];
            self.objects += 1;
            self.found += u32::from(
                seen.iter().any(|(class, place)| *class == label.class && distance(position, *place) <= NEAR_M),
            );
        }
        for (class, place) in &seen {
            let objects = example.scene.objects.iter().filter(|o| o.class == *class);
            let nearest = objects.map(|o| distance(o.path[0], *place)).min_by(f32::total_cmp);
            self.given += 1;
            if let Some(metres) = nearest.filter(|metres| *metres <= NEAR_M) {
                self.right += 1;
                self.squares_m2 += f64::from(metres * metres);
            }
        }
    }

    /// Both together.
    #[must_use]
    pub fn merged(self, other: &Sightings) -> Self {
        Sightings {
            objects: self.objects + other.objects,
            found: self.found + other.found,
            given: self.given + other.given,
            right: self.right + other.right,
            squares_m2: self.squares_m2 + other.squares_m2,
        }
    }

    /// Share of objects found.
    pub fn recall(&self) -> f64 {
        f64::from(self.found) / f64::from(self.objects.max(1))
    }

    /// Share of sightings that were right.
    pub fn precision(&self) -> f64 {
        f64::from(self.right) / f64::from(self.given.max(1))
    }

    /// Root of the mean square distance of right sightings from their objects, metres.
    pub fn error_m(&self) -> f64 {
        (self.squares_m2 / f64::from(self.right.max(1))).sqrt()
    }
}

/// True if an object stands as one of `class`: an unvetoed sighting of that class is near it.
pub fn stands_near(
    stages: &Stages,
    limits: &CorroborationLimits,
    example: &Example,
    object: ObjectId,
    class: Class,
) -> bool {
    let position = example.scene.objects[usize::from(object.0)].path[0];
    standing(stages, limits, example).iter().any(|(of, place)| *of == class && distance(position, *place) <= NEAR_M)
}

/// Class and place in the world of each unvetoed sighting.
fn standing(stages: &Stages, limits: &CorroborationLimits, example: &Example) -> Vec<(Class, [f32; 2])> {
    let StageClaims { candidates, disputed } = stages.candidates(&example.frames(), limits.score);
    let judged = corroborate(&example.sensors.camera, limits, Modalities::default(), &candidates, disputed);
    let left = judged.iter().filter_map(|j| j.sighting.filter(|s| s.is_uncontradicted()));
    left.map(|s| (s.class, world(&example.start, s.place.map(|v| v as f32)))).collect()
}

/// A place in the body frame (metres forward, metres left) in the world.
fn world(start: &StartPose, [forward, left]: [f32; 2]) -> [f32; 2] {
    let (sin, cos) = libm::sincosf(start.heading);
    [start.east + cos * forward - sin * left, start.north + sin * forward + cos * left]
}
