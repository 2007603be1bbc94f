//! The pinhole camera's rays: one for each pixel, cast once for colour, depth and thermal alike.
//!
//! Camera geometry is `wire::sensor::Camera`: pixel (0, 0) is the upper left, the optical axis is the body's x axis,
//! columns run to the body's right and rows down. Rays are not normalised: their component along the optical axis is
//! 1, so the ray parameter of a hit *is* the depth along the axis.

use rapier3d::prelude::Vector;
use wire::sensor::{Camera, PixelBox};

use crate::plant::State;
use crate::world::{Hit, View};

/// Greatest depth along the optical axis, metres.
pub const REACH: f32 = 80.0;

/// Content of one pixel.
#[derive(Clone, Copy, Debug)]
pub struct Pixel {
    /// The surface, or `None` for sky.
    pub hit: Option<Hit>,
    /// End of the ray, world frame; meaningless for sky.
    pub point: Vector,
}

/// All pixels of one exposure, row-major.
#[derive(Clone, Debug)]
pub struct Sweep {
    width: usize,
    pixels: Vec<Pixel>,
}

impl Sweep {
    /// Room for the camera's pixels, all sky.
    pub fn new(camera: &Camera) -> Self {
        let width = usize::from(camera.width);
        let sky = Pixel { hit: None, point: Vector::ZERO };
        Sweep { width, pixels: vec![sky; width * usize::from(camera.height)] }
    }

    /// Casts every ray.
    pub fn cast(&mut self, camera: &Camera, state: &State, view: &View<'_>) {
        let eye = eye(camera, state);
        for (k, pixel) in self.pixels.iter_mut().enumerate() {
            let centre = [(k % self.width) as f32 + 0.5, (k / self.width) as f32 + 0.5];
            let direction = state.rotation * ray(camera, centre);
            let hit = view.cast(eye, direction, REACH);
            *pixel = Pixel { hit, point: eye + direction * hit.map_or(0.0, |h| h.distance) };
        }
    }

    /// Pixels in a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Pixels, row by row.
    pub fn pixels(&self) -> &[Pixel] {
        &self.pixels
    }
}

/// The camera's centre of projection in the world frame.
pub fn eye(camera: &Camera, state: &State) -> Vector {
    state.to_world(Vector::new(camera.forward_m, 0.0, camera.up_m))
}

/// The ray through image point (column, row), body frame, with unit component along the optical axis.
pub fn ray(camera: &Camera, [column, row]: [f32; 2]) -> Vector {
    let right = (column - f32::from(camera.width) / 2.0) / camera.focal_px;
    let down = (row - f32::from(camera.height) / 2.0) / camera.focal_px;
    Vector::new(1.0, -right, -down)
}

/// Image point (column, row) and depth of a world point; `None` behind the camera.
pub fn project(camera: &Camera, state: &State, world: Vector) -> Option<([f32; 2], f32)> {
    let body = state.to_body(world) - Vector::new(camera.forward_m, 0.0, camera.up_m);
    if body.x < 0.1 {
        return None;
    }
    let column = f32::from(camera.width) / 2.0 - body.y / body.x * camera.focal_px;
    let row = f32::from(camera.height) / 2.0 - body.z / body.x * camera.focal_px;
    Some(([column, row], body.x))
}

/// A box of image points cut to the image; `None` if it lies outside.
pub fn clip(camera: &Camera, low: [f32; 2], high: [f32; 2]) -> Option<PixelBox> {
    let cut = |v: f32, most: u16| v.clamp(0.0, f32::from(most)) as u16;
    let (x0, y0) = (cut(low[0], camera.width), cut(low[1], camera.height));
    let (x1, y1) = (cut(high[0] + 0.999, camera.width), cut(high[1] + 0.999, camera.height));
    (x0 < x1 && y0 < y1).then_some(PixelBox { x0, y0, x1, y1 })
}
