//! A drive through a scene with the truth beside every frame, for scoring perception over time.
//!
//! Each frame is sensed both ways at one instant: rendered, and by the noise model that replaces rendering. The
//! unit gets no commands; it follows one set-point from standstill. Use of the frames is the caller's.

use rapier3d::prelude::Vector;
use wire::id::FrameId;
use wire::sensor::{Camera, Candidates, Lidar, Navigation, PixelBox};
use wire::time::{Instant, Span};

use crate::FRAME_STEPS;
use crate::candidates::{self, NoiseModel, Stages};
use crate::fault::Faults;
use crate::limits::SceneError;
use crate::plant::{Plant, SetPoint};
use crate::render::{Labelled, labelled, settled};
use crate::scene::{Scene, StartPose};
use crate::sensor::Imagers;
use crate::sensor::localisation::Navigators;
use crate::world::{Placement, STEP, World};

/// Share of its box that nearer objects' boxes may cover before an object counts as hidden in part.
const COVERED: f32 = 0.3;

/// A frame of a ride.
#[derive(Clone, Debug)]
pub struct Shot {
    /// Number, from 1.
    pub frame: FrameId,
    /// Time, from the start of the ride.
    pub stamp: Instant,
    /// The sensors' output, with its labels.
    pub shown: Labelled,
    /// The noise model's output in its place.
    pub stand_in: Candidates,
    /// True pose of the unit.
    pub pose: StartPose,
    /// Localisation and odometry of this instant.
    pub navigation: Navigation,
    /// Place of each object of the scene, metres east and north.
    pub places: Vec<[f32; 2]>,
    /// Unobstructed box of each in the image.
    pub boxes: Vec<Option<PixelBox>>,
    /// True if nearer ones hide a part of it there.
    pub hidden: Vec<bool>,
}

/// A unit under way.
pub struct Ride {
    world: World,
    plant: Plant,
    faults: Faults,
    imagers: Imagers,
    stages: Stages,
    navigators: Navigators,
    speed: f32,
    curvature: f32,
    steps: u64,
    settled: u64,
}

impl Ride {
    /// Ride through `scene` from its start, at `speed` (m/s) along a `curvature` (1/m); `seed` seeds all noise.
    ///
    /// # Errors
    /// The scene cannot be built.
    pub fn new(
        scene: &Scene,
        (speed, curvature): (f32, f32),
        model: NoiseModel,
        seed: u64,
    ) -> Result<Self, SceneError> {
        let (world, plant) = settled(scene, scene.start)?;
        let (camera, lidar, faults) = (Camera::GROUND, Lidar::GROUND, Faults::new(&[])?);
        let settled = (world.seconds() / (STEP.0 as f64 / 1e6)).round() as u64;
        Ok(Ride {
            world,
            plant,
            imagers: Imagers::new(camera, lidar, seed),
            stages: Stages::new(model, camera, lidar, seed, &faults),
            navigators: Navigators::new(seed, 0),
            faults,
            speed,
            curvature,
            steps: 0,
            settled,
        })
    }

    /// Drives a tenth of a second and takes the next frame.
    pub fn shoot(&mut self) -> Shot {
        for _ in 0..FRAME_STEPS {
            self.steps += 1;
            let now = Instant((self.settled + self.steps) * STEP.0);
            let until = now + Span::ms(500);
            self.plant.accept(now, SetPoint::course((self.speed, self.curvature), until));
            self.plant.step(now, &mut self.world);
        }
        let (number, stamp) = (self.steps / FRAME_STEPS, Instant(self.steps * STEP.0));
        let (frame, run) = (FrameId(number), Span(stamp.0));
        self.imagers.measure(number, &self.world, &self.plant, &self.faults, run);
        let state = self.plant.state(&self.world);
        let (fix, odometry) = self.navigators.read(number, &state, &self.faults, run);
        let box_of = |(object, place): (_, &Placement)| {
            let bounds = candidates::bounds(&self.imagers.camera(), &state, object, place)?;
            Some((bounds, (place.centre - state.position).length()))
        };
        let placed = self.world.scene().objects.iter().zip(self.world.placements());
        let boxes: Vec<Option<(PixelBox, f32)>> = placed.map(box_of).collect();
        Shot {
            frame,
            stamp,
            shown: labelled(&self.imagers, &self.world),
            stand_in: self.stages.observe((frame, stamp), &self.world, &self.plant, &self.faults, run),
            pose: StartPose { east: state.position.x, north: state.position.y, heading: state.yaw() },
            navigation: Navigation { stamp, fix, odometry, spatial: None },
            places: self.world.placements().iter().map(|p| flat(p.centre)).collect(),
            hidden: boxes.iter().map(|b| b.is_some_and(|b| hides(&boxes, b))).collect(),
            boxes: boxes.iter().map(|b| b.map(|(bounds, _)| bounds)).collect(),
        }
    }
}

/// True if boxes of nearer objects cover part of a box.
fn hides(boxes: &[Option<(PixelBox, f32)>], (bounds, far): (PixelBox, f32)) -> bool {
    let nearer = boxes.iter().flatten().filter(|(_, metres)| *metres < far);
    let covered: u32 = nearer.map(|(other, _)| bounds.overlap(other)).sum();
    covered as f32 > COVERED * bounds.area() as f32
}

fn flat(place: Vector) -> [f32; 2] {
    [place.x, place.y]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ride_repeats_its_frames_for_a_seed() {
        let scene = Scene::default();
        let ride = |seed| Ride::new(&scene, (1.0, 0.0), NoiseModel::default(), seed).unwrap();
        let (mut a, mut b, mut other) = (ride(3), ride(3), ride(4));
        let (mut first, mut last) = (None, None);
        for _ in 0..12 {
            let (x, y, z) = (a.shoot(), b.shoot(), other.shoot());
            assert_eq!((&x.shown, &x.stand_in, &x.navigation), (&y.shown, &y.stand_in, &y.navigation));
            assert_ne!(x.shown.rgb, z.shown.rgb);
            first = first.or(x.navigation.fix);
            last = x.navigation.fix;
        }
        let travelled =
            |fix: Option<wire::sensor::Fix>| fix.map(|f| (f64::from(f.pose.x_mm), f64::from(f.pose.y_mm))).unwrap();
        let ((x0, y0), (x1, y1)) = (travelled(first), travelled(last));
        let metres = (x1 - x0).hypot(y1 - y0) / 1000.0;
        assert!((0.4..1.2).contains(&metres), "{metres}");
    }
}
