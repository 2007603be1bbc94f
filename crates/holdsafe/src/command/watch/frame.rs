//! A frame for a person's eyes: colour, depth, thermal and LiDAR, each with the stages' detections.

use console::sidecar::{Image, Mark, Sight};
use export::LARGEST;
use perception::corroborate::CorroborationLimits;
use perception::lidar::returns;
use perception::stages::Stages;
use wire::bus::body;
use wire::codec::decode;
use wire::sensor::{Class, Cluster, Frames, Lidar, PixelBox};

/// Side of the LiDAR's picture from above, pixels, and the length of ground that it covers, metres.
const ABOVE: (usize, f32) = (120, 48.0);
/// Radius of the mark around a cluster's middle, metres.
const AROUND_M: f32 = 1.2;
/// Temperatures that are black and white, kelvin.
const WARMTH: [f32; 2] = [270.0, 320.0];

/// The message `bytes` of frames, header and tags too, as processed by `stages`; `None` where it is no such message.
pub(super) fn sights(bytes: &[u8], stages: &Stages) -> Option<Vec<Sight>> {
    let frames: Frames<'_> = decode(body(bytes)?, LARGEST).ok()?;
    let found = stages.candidates(&frames, CorroborationLimits::default().score).candidates;
    let size = (usize::from(frames.width), usize::from(frames.height));
    let image =
        |rgb: Vec<u8>| (rgb.len() == size.0 * size.1 * 3).then_some(Image { width: size.0, height: size.1, rgb });
    let colours = found.rgb.iter().flat_map(|list| list.iter()).map(|d| mark(d.bounds, d.class, d.score)).collect();
    let warm = found.thermal.iter().flat_map(|list| list.iter()).map(|b| mark(b.bounds, b.class, b.score)).collect();
    let clusters = found.lidar.iter().flat_map(|list| list.iter()).map(cluster).collect();
    Some(vec![
        sight("colour", "as seen", frames.rgb.and_then(|plane| image(plane.to_vec())), colours),
        sight(
            "depth",
            "near is bright",
            frames.depth.and_then(|plane| image(shades(plane, depth_brightness))),
            Vec::new(),
        ),
        sight(
            "thermal",
            "270 K black, 320 K white",
            frames.thermal.and_then(|plane| image(shades(plane, warmth))),
            warm,
        ),
        sight("LiDAR", "from above, 48 m wide", frames.lidar.map(|ranges| draw_top_view(ranges)), clusters),
    ])
}

fn sight(name: &'static str, legend: &'static str, image: Option<Image>, marks: Vec<Mark>) -> Sight {
    Sight { name, legend: legend.into(), image, marks }
}

fn mark(bounds: PixelBox, class: Class, score: u16) -> Mark {
    let edges = [bounds.x0, bounds.y0, bounds.x1, bounds.y1].map(f32::from);
    Mark { edges, says: format!("{} {} %", class.name(), score / 10) }
}

/// Around a cluster, seen from above.
fn cluster(of: &Cluster) -> Mark {
    let [ahead, left] = [of.x_mm, of.y_mm].map(|mm| mm as f32 / 1e3);
    let [x, y] = pixel(-left, ahead);
    let half = AROUND_M / ABOVE.1 * ABOVE.0 as f32;
    Mark { edges: [x - half, y - half, x + half, y + half], says: format!("{:.0} m", libm::hypotf(ahead, left)) }
}

/// Pixel in the LiDAR's picture of a point a given number of metres to the right and ahead.
fn pixel(right: f32, ahead: f32) -> [f32; 2] {
    let (side, metres) = (ABOVE.0 as f32, ABOVE.1);
    [right, -ahead].map(|at| at / metres * side + side / 2.0)
}

/// A plane of 16-bit numbers in grey.
fn shades(plane: &[u8], shade: fn(u16) -> u8) -> Vec<u8> {
    plane.chunks_exact(2).flat_map(|b| [shade(u16::from_le_bytes([b[0], b[1]])); 3]).collect()
}

/// Brightness of a depth in millimetres; zero, no return, is black.
fn depth_brightness(mm: u16) -> u8 {
    if mm == 0 { 0 } else { (255.0 * 3_000.0 / (3_000.0 + f32::from(mm))) as u8 }
}

/// Hundredths of a kelvin.
fn warmth(centikelvin: u16) -> u8 {
    let [black, white] = WARMTH;
    ((f32::from(centikelvin) / 100.0 - black) / (white - black) * 255.0).clamp(0.0, 255.0) as u8
}

/// Beam returns, seen from above; the unit is in the middle.
fn draw_top_view(ranges: &[u8]) -> Image {
    let side = ABOVE.0;
    let mut rgb = vec![20; side * side * 3];
    let mut dot = |right: f32, ahead: f32, shade: u8| {
        let [x, y] = pixel(right, ahead);
        if (0.0..side as f32).contains(&x) && (0.0..side as f32).contains(&y) {
            let index = (y as usize * side + x as usize) * 3;
            rgb[index..index + 3].fill(shade);
        }
    };
    returns(Lidar::GROUND, ranges).for_each(|[ahead, left, _]| dot(-left, ahead, 210));
    dot(0.0, 0.0, 255);
    Image { width: side, height: side, rgb }
}
