//! Selection among boxes that a head gave to detections: the best of those that show one object, cut to pixels.

use wire::codec::List;
use wire::sensor::{Class, Detection, PixelBox};

use crate::letterbox::{HEIGHT, WIDTH};

/// Two boxes that share more than this of their union show one object.
const SAME: f32 = 0.45;
/// Most boxes that suppression compares.
const MOST: usize = 300;

/// A box before it is cut to pixels. Its numbers are finite.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    pub(crate) class: Class,
    pub(crate) score: f32,
    /// Left, top, right, bottom, pixels of the camera.
    pub(crate) edges: [f32; 4],
}

/// Selects detections among `found`: best first, one for each object; of equal boxes the earlier.
pub(crate) fn best(mut found: Vec<Candidate>) -> List<Detection, 32> {
    found.sort_by(|a, b| b.score.total_cmp(&a.score));
    found.truncate(MOST);
    let mut candidates: Vec<Candidate> = Vec::new();
    for one in found {
        if candidates.iter().all(|k| shared(&k.edges, &one.edges) <= SAME) {
            candidates.push(one);
        }
    }
    candidates.iter().filter_map(detection).collect()
}

/// Shared area over united area.
fn shared(a: &[f32; 4], b: &[f32; 4]) -> f32 {
    let area = |e: &[f32; 4]| (e[2] - e[0]).max(0.0) * (e[3] - e[1]).max(0.0);
    let both = area(&[a[0].max(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].min(b[3])]);
    both / (area(a) + area(b) - both).max(1e-6)
}

fn detection(candidate: &Candidate) -> Option<Detection> {
    let pixel = |v: f32, most: usize| (v + 0.5).clamp(0.0, most as f32) as u16;
    let [x0, y0, x1, y1] = candidate.edges;
    let bounds = PixelBox { x0: pixel(x0, WIDTH), y0: pixel(y0, HEIGHT), x1: pixel(x1, WIDTH), y1: pixel(y1, HEIGHT) };
    let visible = bounds.x0 < bounds.x1 && bounds.y0 < bounds.y1;
    visible.then_some(Detection {
        class: candidate.class,
        score: (candidate.score * 1000.0).min(1000.0) as u16,
        bounds,
    })
}
