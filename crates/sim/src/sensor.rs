//! The sensors: measurements of the world by the unit, in the units of `wire::sensor`.
//!
//! One ray per pixel ([`camera::Sweep`]) serves colour, depth and thermal, so the three agree on a pixel's content;
//! [`lidar`] casts its own rays, [`localisation`] reads the plant. Each sensor has its own stream of noise.

pub(crate) mod bearings;
pub mod camera;
pub mod depth;
pub mod lidar;
pub mod localisation;
pub mod rgb;
pub(crate) mod spatial;
pub mod thermal;

use ground_truth::Sensor;
use wire::sensor::{Camera, Lidar};
use wire::time::Span;

use crate::chaff;
use crate::fault::{Effect, Faults, imaging};
use crate::noise::{Noise, Stream};
use crate::past::Past;
use crate::plant::Plant;
use crate::world::World;

/// The imaging sensors with their newest planes; a frozen sensor keeps its old plane.
#[derive(Clone)]
pub struct Imagers {
    camera: Camera,
    sweep: camera::Sweep,
    lidar: lidar::Lidar,
    noise: [Noise; 4],
    /// Past frames of colour and of thermal.
    past: [Past<Vec<u8>>; 2],
    /// Row-major, 3 bytes a pixel.
    pub rgb: Vec<u8>,
    /// Row-major, u16 little-endian millimetres along the optical axis, 0 = no return.
    pub depth: Vec<u8>,
    /// Row-major, u16 little-endian centikelvin.
    pub thermal: Vec<u8>,
    /// Ring-major, u16 little-endian millimetres, 0 = no return.
    pub ranges: Vec<u8>,
}

impl Imagers {
    /// All four, seeded, with empty planes.
    pub fn new(camera: Camera, lidar: Lidar, seed: u64) -> Self {
        let pixels = usize::from(camera.width) * usize::from(camera.height);
        let lidar = lidar::Lidar::new(lidar);
        Imagers {
            camera,
            sweep: camera::Sweep::new(&camera),
            ranges: vec![0; lidar.beams() * 2],
            lidar,
            noise: [Stream::Rgb, Stream::Depth, Stream::Thermal, Stream::Lidar].map(|s| Noise::new(seed, s)),
            past: [Past::new(0), Past::new(0)],
            rgb: vec![0; pixels * 3],
            depth: vec![0; pixels * 2],
            thermal: vec![0; pixels * 2],
        }
    }

    /// Imagers with room for the past readings that `faults` will show.
    pub(crate) fn remembering(self, faults: &Faults) -> Self {
        Imagers { past: [Sensor::Rgb, Sensor::Thermal].map(|s| Past::new(faults.deepest_skew(s))), ..self }
    }

    pub(crate) fn reseed(&mut self, seed: u64) {
        self.noise.iter_mut().for_each(|noise| noise.reseed(seed));
    }

    /// Measures the world as reading `n`, under the faults in force `run` after the start.
    pub fn measure(&mut self, n: u64, world: &World, plant: &Plant, faults: &Faults, run: Span) {
        let [rgb, depth, thermal, lidar] = imaging(faults, run);
        let state = plant.state(world);
        let view = world.view(plant.body());
        let weather = &world.scene().weather;
        self.noise.iter_mut().for_each(|noise| noise.seek(n));
        let [rgb_noise, depth_noise, thermal_noise, lidar_noise] = &mut self.noise;
        if rgb.refreshes() || depth.refreshes() || thermal.refreshes() {
            self.sweep.cast(&self.camera, &state, &view);
        }
        if rgb.refreshes() {
            rgb::expose(&self.sweep, world, rgb_noise, &rgb, &mut self.rgb);
            self.rgb = self.past[0].pass(core::mem::take(&mut self.rgb), rgb.skew);
            chaff::paint(&self.camera, rgb_noise, rgb.chaff, &mut self.rgb);
            if let (Some(pattern), Some(strength)) = (&world.scene().perturbation, rgb.perturbation) {
                pattern.add(strength, usize::from(self.camera.width), &mut self.rgb);
            }
        }
        if depth.refreshes() {
            depth::expose(&self.sweep, depth_noise, &depth, weather, &mut self.depth);
        }
        if thermal.refreshes() {
            thermal::expose(&self.sweep, world, thermal_noise, &thermal, &mut self.thermal);
            self.thermal = self.past[1].pass(core::mem::take(&mut self.thermal), thermal.skew);
        }
        if lidar.refreshes() {
            self.lidar.scan((&state, &view), lidar_noise, &lidar, weather, &mut self.ranges);
        }
    }

    /// Numbers and mounting of the cameras.
    pub fn camera(&self) -> Camera {
        self.camera
    }

    /// True if the newest colour image shows a part of a print.
    pub(crate) fn show_a_print(&self, world: &World) -> bool {
        world.scene().objects.iter().any(|object| object.print.is_some())
            && self.sweep.pixels().iter().any(|pixel| rgb::skin(pixel, world).is_some())
    }

    /// Pixels of the newest sweep.
    pub fn sweep(&self) -> &camera::Sweep {
        &self.sweep
    }
}

/// Number of columns of `width` that a fault covers, from the left.
pub(crate) fn covered(effect: &Effect, width: usize) -> usize {
    width * usize::from(effect.occluded) / 1000
}
