//! Unrendered mode: candidates straight from ground truth, in place of sensors and detector stages.
//!
//! **The noise model is uncalibrated.** Its figures ([`NoiseModel`]) are placeholders until they have been fitted to
//! the rendered pipeline; a result that rests on them is a hypothesis. It models: range, field of view, partial cover
//! of a vehicle or a decoy (`occlusion`; persons, obstacles and the ground by one ray per object and viewpoint), misses
//! that grow with range, jitter, class confusion and false positives, each modality with its own stream, and every
//! fault of `fault`. Corroboration, tracking and all later steps are the real code; they cannot tell where a candidate
//! came from.

use ground_truth::Sensor;
use rapier3d::prelude::Vector;
use serde::{Deserialize, Serialize};
use wire::codec::List;
use wire::id::{FrameId, ObjectId};
use wire::sensor::{
    Blob, Camera, Candidates, Class, Cluster, DepthSample, Detection, Lidar, Modality, PixelBox, ProductMode,
};
use wire::time::{Instant, Span};

use crate::chaff;
use crate::fault::{Effect, Faults, imaging};
use crate::noise::{Noise, Stream};
use crate::occlusion::{Eye, Part, Scan, Sight, bounding_box, corners, overlap};
use crate::past::Past;
use crate::plant::{Plant, State};
use crate::scene::Object;
use crate::sensor::camera::{clip, eye, project};
use crate::sensor::{covered, depth, thermal};
use crate::world::{Hit, Placement, Surface, View, World};

/// Figures of the uncalibrated noise model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct NoiseModel {
    /// Chance that a stage misses an object at no distance.
    pub miss: f32,
    /// Chance that it misses one at the end of its range.
    pub miss_far: f32,
    /// Chance of a false detection by a stage, per frame.
    pub false_positive: f32,
    /// Chance that a decoy is called a vehicle, or a vehicle a decoy.
    pub confusion: f32,
    /// Deviation of a box's edges, pixels.
    pub edge_px: f32,
    /// Deviation of a LiDAR cluster's place on each axis, metres.
    pub cluster_m: f32,
    /// Range of the image stages, metres.
    pub image_range: f32,
    /// Area of the smallest box that an image stage can make out, pixels.
    pub smallest_px: u32,
    /// Range of the LiDAR stage, metres.
    pub lidar_range: f32,
}

/// Confidence of the thermal stage, permille. A placeholder, as all of these are.
const WARM: u16 = 900;
/// Loss of the colour stage's confidence in a fully covered object, permille; proportional for a part.
const HIDDEN: f32 = 250.0;

impl Default for NoiseModel {
    fn default() -> Self {
        NoiseModel {
            miss: 0.005,
            miss_far: 0.1,
            false_positive: 0.01,
            confusion: 0.01,
            edge_px: 0.7,
            cluster_m: 0.06,
            image_range: 35.0,
            smallest_px: 14,
            lidar_range: 30.0,
        }
    }
}

impl NoiseModel {
    /// The model with so many times as many things that are confused or are not there; of the rest of the noise each
    /// reading's [`Effect`] tells.
    pub(crate) fn times(self, factor: f32) -> Self {
        let chance = |p: f32| (p * factor).min(1.0);
        Self { false_positive: chance(self.false_positive), confusion: chance(self.confusion), ..self }
    }

    fn misses(&self, noise: &mut Noise, share_of_range: f32, effect: &Effect) -> bool {
        let chance = self.miss + (self.miss_far - self.miss) * share_of_range * share_of_range;
        noise.chance((chance * effect.noise).min(1.0))
    }
}

/// An object that a camera pixel could show.
struct Seen<'a> {
    object: &'a Object,
    bounds: PixelBox,
    /// Metres along the optical axis to its visible surface.
    depth: f32,
    /// Share of it that no other object covers; 1 for the whole.
    share: f32,
}

/// The stages' stand-in, with their last products for frozen sensors.
#[derive(Clone, Debug)]
pub(crate) struct Stages {
    model: NoiseModel,
    camera: Camera,
    lidar_geometry: Lidar,
    rgb: Noise,
    depth: Noise,
    thermal: Noise,
    lidar: Noise,
    past_rgb: Past<(List<Detection, 32>, u32)>,
    past_thermal: Past<(List<Blob, 32>, u32)>,
    last: Option<Candidates>,
}

impl Stages {
    pub(crate) fn new(model: NoiseModel, camera: Camera, lidar: Lidar, seed: u64, faults: &Faults) -> Self {
        let noise = |stream| Noise::new(seed, stream);
        Stages {
            model,
            camera,
            lidar_geometry: lidar,
            rgb: noise(Stream::RgbCandidates),
            depth: noise(Stream::DepthCandidates),
            thermal: noise(Stream::ThermalCandidates),
            lidar: noise(Stream::LidarCandidates),
            past_rgb: Past::new(faults.deepest_skew(Sensor::Rgb)),
            past_thermal: Past::new(faults.deepest_skew(Sensor::Thermal)),
            last: None,
        }
    }

    pub(crate) fn reseed(&mut self, seed: u64) {
        for noise in [&mut self.rgb, &mut self.depth, &mut self.thermal, &mut self.lidar] {
            noise.reseed(seed);
        }
    }

    /// The candidates of one frame.
    pub(crate) fn observe(
        &mut self,
        (frame, stamp): (FrameId, Instant),
        world: &World,
        plant: &Plant,
        faults: &Faults,
        run: Span,
    ) -> Candidates {
        let [rgb, depth, thermal, lidar] = imaging(faults, run);
        let (state, view) = (plant.state(world), world.view(plant.body()));
        let camera = self.camera;
        let eye = Eye::new(&camera, &state, world, &view);
        let seen = self.seen(&eye);
        for noise in [&mut self.rgb, &mut self.depth, &mut self.thermal, &mut self.lidar] {
            noise.seek(frame.0);
        }
        let last = self.last.take();
        let was = |modality: Modality| last.as_ref().and_then(|l| l.grain).unwrap_or_default()[modality as usize];
        let colour = pick(
            &rgb,
            || self.colour(&seen, &rgb),
            || last.as_ref().and_then(|l| Some((l.rgb.clone()?, was(Modality::Rgb)))),
        );
        let (detections, rgb_grain) = colour.unzip();
        // A depth product refers to detections of its own message, so a frozen one must not outlive them.
        let found: &[Detection] = detections.as_deref().unwrap_or_default();
        let still_there =
            |d: &List<DepthSample, 32>| d.iter().filter(|s| usize::from(s.detection) < found.len()).copied().collect();
        let depths = pick(
            &depth,
            || (self.depths(found, &seen, &eye, &depth), self.depth.word()),
            || last.as_ref().and_then(|l| Some((l.depth.as_ref().map(still_there)?, was(Modality::Depth)))),
        );
        let (depths, depth_grain) = depths.unzip();
        let warmth = pick(
            &thermal,
            || self.warmth(&seen, world, &thermal),
            || last.as_ref().and_then(|l| Some((l.thermal.clone()?, was(Modality::Thermal)))),
        );
        let (blobs, thermal_grain) = warmth.unzip();
        let clusters = pick(
            &lidar,
            || (self.clusters(world, &state, &view, &lidar), self.lidar.word()),
            || last.as_ref().and_then(|l| Some((l.lidar.clone()?, was(Modality::Lidar)))),
        );
        let (clusters, lidar_grain) = clusters.unzip();
        let grain = [rgb_grain, depth_grain, thermal_grain, lidar_grain].map(Option::unwrap_or_default);
        let now = Candidates {
            frame,
            stamp,
            mode: ProductMode::Live,
            rgb: detections,
            depth: depths,
            thermal: blobs,
            lidar: clusters,
            grain: Some(grain),
        };
        self.last = Some(now.clone());
        now
    }

    fn seen<'a>(&self, eye: &Eye<'a>) -> Vec<Seen<'a>> {
        let objects = eye.world.scene().objects.iter().zip(eye.world.placements()).enumerate();
        objects.filter_map(|(index, (object, place))| self.look(eye, index, object, place)).collect()
    }

    /// The camera's view of an object.
    fn look<'a>(&self, eye: &Eye<'_>, index: usize, object: &'a Object, place: &Placement) -> Option<Seen<'a>> {
        let (_, depth) = project(&self.camera, eye.state, place.centre)?;
        if depth > self.model.image_range {
            return None;
        }
        let whole = bounds(&self.camera, eye.state, object, place)?;
        let part = if passes_for_a_vehicle(object) { eye.part(index, &whole) } else { Sight::Whole };
        let seen = match part {
            Sight::Whole => {
                let hit = sight(eye.view, self::eye(&self.camera, eye.state), place.centre, ObjectId(index as u16))?;
                Seen { object, bounds: whole, depth: depth * hit.distance, share: 1.0 }
            }
            Sight::Part(Part { bounds, share, depth }) => Seen { object, bounds, depth, share },
            Sight::Nothing => return None,
        };
        self.visible(&seen.bounds).then_some(seen)
    }

    /// Output of the colour stage: the present one, or that of some frames ago, and with chaff.
    fn colour(&mut self, seen: &[Seen<'_>], effect: &Effect) -> (List<Detection, 32>, u32) {
        let now = self.detections(seen, effect);
        let grain = self.rgb.word();
        let (mut shown, grain) = self.past_rgb.pass((now, grain), effect.skew);
        chaff::detect(&self.camera, &mut self.rgb, effect.chaff, &mut shown);
        (shown, grain)
    }

    fn warmth(&mut self, seen: &[Seen<'_>], world: &World, effect: &Effect) -> (List<Blob, 32>, u32) {
        let now = self.blobs(seen, world, effect);
        let grain = self.thermal.word();
        self.past_thermal.pass((now, grain), effect.skew)
    }

    fn detections(&mut self, seen: &[Seen<'_>], effect: &Effect) -> List<Detection, 32> {
        let mut found = List::default();
        for s in seen {
            let share = s.depth / self.model.image_range;
            let (missed, confused) =
                (self.model.misses(&mut self.rgb, share, effect), self.rgb.chance(self.model.confusion));
            let score = 930.0 - 250.0 * share - HIDDEN * (1.0 - s.share) + 40.0 * self.rgb.normal();
            let bounds = self.jitter(s.bounds, effect);
            if !missed && !hidden(&self.camera, effect, &s.bounds) {
                let class = if confused { mistaken(s.object.paint()) } else { s.object.paint() };
                found.push(Detection { class, score: score.clamp(300.0, 999.0) as u16, bounds });
            }
        }
        if self.rgb.chance(self.model.false_positive) {
            let class = Class::ALL[(self.rgb.uniform() * 4.0) as usize % 4];
            let bounds = phantom(&self.camera, &mut self.rgb);
            found.push(Detection { class, score: 350 + (self.rgb.uniform() * 250.0) as u16, bounds });
        }
        found
    }

    fn depths(
        &mut self,
        found: &[Detection],
        seen: &[Seen<'_>],
        eye: &Eye<'_>,
        effect: &Effect,
    ) -> List<DepthSample, 32> {
        let sample = |(index, detection): (usize, &Detection)| {
            let overlapping: Vec<&Seen<'_>> = seen.iter().filter(|s| overlap(&s.bounds, &detection.bounds)).collect();
            let metres = match overlapping[..] {
                [] => None,
                [one] if one.share >= 1.0 => Some(one.depth),
                [..] if overlapping.iter().any(|s| passes_for_a_vehicle(s.object)) => {
                    eye.median_depth(&detection.bounds)
                }
                [..] => overlapping.iter().map(|s| s.depth).min_by(f32::total_cmp),
            };
            // Drawn whether it is needed or not, so that the noise of what follows stays what it is.
            let nowhere = depth::REACH * self.depth.uniform();
            let metres = metres.unwrap_or(nowhere);
            let error = self.depth.normal() * (0.02 + 0.0005 * metres * metres) * effect.noise;
            let covered = hidden(&self.camera, effect, &detection.bounds);
            let median =
                if covered { depth::COVER_MM } else { ((metres + error) * 1000.0).clamp(1.0, 65_535.0) as u16 };
            DepthSample { detection: index as u8, median_mm: median }
        };
        found.iter().enumerate().map(sample).collect()
    }

    fn blobs(&mut self, seen: &[Seen<'_>], world: &World, effect: &Effect) -> List<Blob, 32> {
        let ambient = world.scene().ground.kelvin;
        let mut found = List::default();
        for s in seen {
            let missed = self.model.misses(&mut self.thermal, s.depth / self.model.image_range, effect);
            let jitter = 0.3 * self.thermal.normal();
            let above = (s.object.kelvin - ambient) * s.object.heat_share(world.seconds());
            let warmer = above * thermal::contrast(s.depth);
            if warmer > 4.0 && !missed && !hidden(&self.camera, effect, &s.bounds) {
                let mean_ck = thermal::centikelvin(ambient + 0.75 * warmer + jitter);
                let peak_ck = thermal::centikelvin(ambient + warmer + jitter);
                let class = match s.object.warm_as() {
                    like @ (Class::Vehicle | Class::Person) => like,
                    Class::Decoy | Class::Obstacle => Class::Obstacle,
                };
                found.push(Blob { bounds: s.bounds, mean_ck, peak_ck, class, score: WARM });
            }
        }
        if self.thermal.chance(self.model.false_positive) {
            let bounds = phantom(&self.camera, &mut self.thermal);
            let warm = thermal::centikelvin(ambient + 6.0 + 6.0 * self.thermal.uniform());
            found.push(Blob { bounds, mean_ck: warm, peak_ck: warm + 150, class: Class::Obstacle, score: WARM });
        }
        found
    }

    fn clusters(&mut self, world: &World, state: &State, view: &View<'_>, effect: &Effect) -> List<Cluster, 64> {
        let beams = self.lidar_geometry;
        let scan = Scan::new(&beams, state, world, view);
        let mut found = List::default();
        for (index, object) in world.scene().objects.iter().enumerate() {
            if scan.nearest(index) > self.model.lidar_range {
                continue;
            }
            let Some(Met { cluster, centroid, range }) = meet(&scan, index, object) else { continue };
            let missed = self.model.misses(&mut self.lidar, range / self.model.lidar_range, effect);
            let jitter = self.model.cluster_m * effect.noise;
            let (dx, dy) = (self.lidar.normal() * jitter, self.lidar.normal() * jitter);
            if range <= self.model.lidar_range && !missed && !shadowed(effect, centroid) {
                let (x_mm, y_mm) = (((centroid.x + dx) * 1000.0) as i32, ((centroid.y + dy) * 1000.0) as i32);
                found.push(Cluster { x_mm, y_mm, ..cluster });
            }
        }
        found
    }

    fn visible(&self, b: &PixelBox) -> bool {
        u32::from(b.x1 - b.x0) * u32::from(b.y1 - b.y0) >= self.model.smallest_px
    }

    fn jitter(&mut self, bounds: PixelBox, effect: &Effect) -> PixelBox {
        let spread = self.model.edge_px * effect.noise;
        let mut edge = |v: u16| f32::from(v) + spread * self.rgb.normal();
        let (low, high) = ([edge(bounds.x0), edge(bounds.y0)], [edge(bounds.x1) - 1.0, edge(bounds.y1) - 1.0]);
        clip(&self.camera, low, high).unwrap_or(bounds)
    }
}

/// A new product, the old one of a frozen sensor, or none of a dropped one.
fn pick<T>(effect: &Effect, new: impl FnOnce() -> T, old: impl FnOnce() -> Option<T>) -> Option<T> {
    if effect.dropout {
        None
    } else if effect.freeze {
        old()
    } else {
        Some(new())
    }
}

/// True if the way is free: the hit on `id`, its distance as a share of the way to the centre.
fn sight(view: &View<'_>, origin: Vector, centre: Vector, id: ObjectId) -> Option<Hit> {
    view.cast(origin, centre - origin, 1.0).filter(|hit| hit.surface == Surface::Object(id))
}

/// The image box around the object's eight corners.
pub(crate) fn bounds(camera: &Camera, state: &State, object: &Object, place: &Placement) -> Option<PixelBox> {
    let projected = corners(object, place).map(|corner| project(camera, state, corner));
    if projected.iter().any(Option::is_none) {
        return None;
    }
    bounding_box(camera, projected.iter().flatten())
}

/// LiDAR returns from an object.
struct Met {
    /// Returns as a cluster, with its size; the place is `centroid`.
    cluster: Cluster,
    /// Middle of the returns, body frame, metres.
    centroid: Vector,
    /// Distance to the returns, metres.
    range: f32,
}

fn meet(scan: &Scan<'_>, index: usize, object: &Object) -> Option<Met> {
    let part = if passes_for_a_vehicle(object) { scan.returns(index) } else { Sight::Whole };
    match part {
        Sight::Whole => {
            let origin = scan.state.to_world(Vector::new(0.0, 0.0, scan.beams.up_m));
            let centre = scan.world.placements()[index].centre;
            let hit = sight(scan.view, origin, centre, ObjectId(index as u16))?;
            let direction = centre - origin;
            // LiDAR meets the near side: a quarter of the way from there to the middle.
            let centroid = scan.state.to_body(origin + direction * (0.75 * hit.distance + 0.25));
            let [length, width, height] = object.size;
            Some(Met {
                cluster: sized(length.max(width) * 900.0, height * 850.0),
                centroid,
                range: direction.length() * hit.distance,
            })
        }
        Sight::Part(points) => {
            let span = |extent_along: fn(&Vector) -> f32| {
                let all = || points.iter().map(extent_along);
                all().fold(f32::MIN, f32::max) - all().fold(f32::MAX, f32::min)
            };
            let (along, across) = (span(|p| p.x), span(|p| p.y));
            let centroid = points.iter().fold(Vector::ZERO, |sum, p| sum + *p) / points.len() as f32;
            let width = (along * along + across * across).sqrt();
            Some(Met { cluster: sized(width * 1000.0, span(|p| p.z) * 1000.0), centroid, range: centroid.length() })
        }
        Sight::Nothing => None,
    }
}

/// A cluster of this size, millimetres, at no place yet.
fn sized(width: f32, height: f32) -> Cluster {
    Cluster { x_mm: 0, y_mm: 0, width_mm: width as u16, height_mm: height as u16 }
}

/// True if an occlusion covers the middle of a box.
fn hidden(camera: &Camera, effect: &Effect, bounds: &PixelBox) -> bool {
    usize::from((bounds.x0 + bounds.x1) / 2) < covered(effect, usize::from(camera.width))
}

/// True if an occlusion covers the LiDAR's beam to a place in the body frame.
fn shadowed(effect: &Effect, place: Vector) -> bool {
    let degrees = libm::atan2f(place.y, place.x).to_degrees();
    let azimuth = if degrees < 0.0 { degrees + 360.0 } else { degrees };
    azimuth < 360.0 * f32::from(effect.occluded) / 1000.0
}

/// True if a stage may call it a vehicle. Cover of any other object decides over no act, and stays with one ray.
fn passes_for_a_vehicle(object: &Object) -> bool {
    [object.class, object.paint(), object.warm_as()].iter().any(|c| matches!(c, Class::Vehicle | Class::Decoy))
}

fn mistaken(class: Class) -> Class {
    match class {
        Class::Vehicle => Class::Decoy,
        Class::Decoy => Class::Vehicle,
        Class::Person | Class::Obstacle => class,
    }
}

fn phantom(camera: &Camera, noise: &mut Noise) -> PixelBox {
    let x0 = (noise.uniform() * f32::from(camera.width - 24)) as u16;
    let y0 = (noise.uniform() * f32::from(camera.height - 24)) as u16;
    let (width, height) = (6 + (noise.uniform() * 16.0) as u16, 6 + (noise.uniform() * 16.0) as u16);
    PixelBox { x0, y0, x1: x0 + width, y1: y0 + height }
}
