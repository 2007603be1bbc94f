//! Chaff: many weak detections in each frame, every one of them of the class that an act may be designated on.
//!
//! Rendered, small pictures of vehicles painted over the colour plane, which shows through a little; unrendered, what a detector
//! makes of such. No two frames have them at the same places.

use wire::codec::List;
use wire::sensor::{Camera, Class, Detection, PixelBox};

use crate::noise::Noise;

/// Scores of a weak detection, permille: not so low that the stage passes it over.
const SCORES: (f32, f32) = (500.0, 650.0);
/// Width of a picture, pixels, and its height as a share of that.
const WIDTH: (f32, f32) = (16.0, 28.0);
const HEIGHT: f32 = 0.45;
/// How much of a picture shows.
const OPAQUE: f32 = 0.8;

/// Up to `count` detections more, as far as the list has room: what a detector is surer of stands before them.
pub(crate) fn detect(camera: &Camera, noise: &mut Noise, count: u8, found: &mut List<Detection, 32>) {
    for _ in 0..count {
        let bounds = place(camera, noise);
        let score = between(noise, SCORES) as u16;
        found.push(Detection { class: Class::Vehicle, score, bounds });
    }
}

/// Paints `count` pictures over a plane of 3 bytes a pixel.
pub(crate) fn paint(camera: &Camera, noise: &mut Noise, count: u8, plane: &mut [u8]) {
    for _ in 0..count {
        let at = place(camera, noise);
        for (x, y) in (at.y0..at.y1).flat_map(|y| (at.x0..at.x1).map(move |x| (x, y))) {
            let share = |v: u16, low: u16, high: u16| (f32::from(v - low) + 0.5) / f32::from(high - low);
            let colour = vehicle(2.0 * share(x, at.x0, at.x1) - 1.0, 1.0 - 2.0 * share(y, at.y0, at.y1));
            let from = 3 * (usize::from(y) * usize::from(camera.width) + usize::from(x));
            for (byte, channel) in plane[from..from + 3].iter_mut().zip(colour) {
                *byte = (f32::from(*byte) * (1.0 - OPAQUE) + channel * OPAQUE) as u8;
            }
        }
    }
}

/// A vehicle's side: wheels, windows, coat; `along` and `up` in −1..1.
fn vehicle(along: f32, up: f32) -> [f32; 3] {
    if up < -0.35 && (along.abs() - 0.6).abs() < 0.2 {
        [20.0; 3]
    } else if up > 0.3 && along.abs() < 0.75 {
        [34.0, 42.0, 52.0]
    } else {
        [150.0, 60.0, 50.0]
    }
}

/// Where there is ground, in the lower half of the image.
fn place(camera: &Camera, noise: &mut Noise) -> PixelBox {
    let width = between(noise, WIDTH);
    let height = width * HEIGHT;
    let (right, low) = (f32::from(camera.width) - width, f32::from(camera.height) - height);
    let (x, y) = (between(noise, (0.0, right)), between(noise, (0.45 * low, low)));
    PixelBox { x0: x as u16, y0: y as u16, x1: (x + width) as u16, y1: (y + height) as u16 }
}

fn between(noise: &mut Noise, (low, high): (f32, f32)) -> f32 {
    low + (high - low) * noise.uniform()
}
