//! Chaff: many weak detections in each frame, each of the class that an act may be designated on.
//!
//! Rendered, pictures of vehicles painted over the colour plane; unrendered, a detector's output for them. No two
//! frames have them at the same places.

use wire::codec::List;
use wire::sensor::{Camera, Class, Detection, PixelBox};

use crate::noise::Noise;
use ground_truth::MAX_CHAFF;

/// Scores of a weak detection, permille: not so low that the stage passes it over.
const SCORES: (f32, f32) = (500.0, 650.0);
/// Width of a weak detection, pixels, and the height of any as a share of its width.
const WIDTH: (f32, f32) = (16.0, 28.0);
const HEIGHT: f32 = 0.4;
/// The lines that pictures stand on, as shares of the image's height, how wide they are there, pixels, and how many of
/// 32 stand there, apart from each other: a detector that has learned how large a vehicle is at its distance passes
/// over detections of another size. Of 32 the shipped one finds 7 to 21 (median of 40 frames: 16); of 32 anywhere, 4 to
/// 10.
const LINES: [(f32, f32, u16); 5] = [(0.33, 14.0, 8), (0.42, 16.0, 8), (0.5, 18.0, 7), (0.6, 26.0, 5), (0.73, 28.0, 4)];
/// Colours of the painted vehicles.
const COATS: [[u8; 3]; 4] = [[150, 60, 50], [60, 80, 150], [200, 200, 200], [80, 40, 40]];

/// Adds up to `count` detections, as far as the list has room: more confident ones come first.
pub(crate) fn detect(camera: &Camera, noise: &mut Noise, count: u8, found: &mut List<Detection, 32>) {
    for _ in 0..count {
        let bounds = place(camera, noise);
        let score = uniform(noise, SCORES) as u16;
        found.push(Detection { class: Class::Vehicle, score, bounds });
    }
}

/// Paints `count` pictures over a plane of 3 bytes a pixel: in lines from the farthest to the nearest, in each evenly
/// and from anywhere on.
pub(crate) fn paint(camera: &Camera, noise: &mut Noise, count: u8, plane: &mut [u8]) {
    let (columns, rows) = (f32::from(camera.width), f32::from(camera.height));
    let (mut of_most, mut painted) = (0, 0);
    for (foot, width, share) in LINES {
        of_most += share;
        let many = u16::from(count) * of_most / u16::from(MAX_CHAFF) - painted;
        painted += many;
        let room = columns - width;
        let from = uniform(noise, (0.0, room));
        for k in 0..many {
            let left = (from + f32::from(k) * room / f32::from(many)) % room;
            let bounds = standing(left, foot * rows + uniform(noise, (-1.5, 1.5)), width);
            let coat = COATS[uniform(noise, (0.0, COATS.len() as f32)) as usize % COATS.len()];
            picture(camera, &bounds, coat, plane);
        }
    }
}

fn picture(camera: &Camera, bounds: &PixelBox, coat: [u8; 3], plane: &mut [u8]) {
    for (x, y) in (bounds.y0..bounds.y1).flat_map(|y| (bounds.x0..bounds.x1).map(move |x| (x, y))) {
        let share = |v: u16, low: u16, high: u16| (f32::from(v - low) + 0.5) / f32::from(high - low);
        let colour =
            vehicle(2.0 * share(x, bounds.x0, bounds.x1) - 1.0, 1.0 - 2.0 * share(y, bounds.y0, bounds.y1), coat);
        let from = 3 * (usize::from(y) * usize::from(camera.width) + usize::from(x));
        plane[from..from + 3].copy_from_slice(&colour);
    }
}

/// A vehicle's side: wheels, windows, coat; `along` and `up` in −1..1.
fn vehicle(along: f32, up: f32, coat: [u8; 3]) -> [u8; 3] {
    if up < -0.35 && (along.abs() - 0.6).abs() < 0.2 {
        [20; 3]
    } else if up > 0.3 && up < 0.85 && along.abs() < 0.75 {
        [34, 42, 52]
    } else {
        coat
    }
}

/// A box of `width` with its lower edge on `foot`.
fn standing(left: f32, foot: f32, width: f32) -> PixelBox {
    let top = foot - width * HEIGHT;
    PixelBox { x0: left as u16, y0: top as u16, x1: (left + width) as u16, y1: foot as u16 }
}

/// A place on the ground, in the lower half of the image.
fn place(camera: &Camera, noise: &mut Noise) -> PixelBox {
    let width = uniform(noise, WIDTH);
    let height = width * HEIGHT;
    let (right, low) = (f32::from(camera.width) - width, f32::from(camera.height) - height);
    let (x, y) = (uniform(noise, (0.0, right)), uniform(noise, (0.45 * low, low)));
    standing(x, y + height, width)
}

fn uniform(noise: &mut Noise, (low, high): (f32, f32)) -> f32 {
    low + (high - low) * noise.uniform()
}
