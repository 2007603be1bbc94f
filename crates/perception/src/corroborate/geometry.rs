//! Place and size of a detection: depth against LiDAR, and both against the size of its class.
//!
//! All places are in the body frame. Depth and LiDAR see an object's near surface; its middle lies behind by half its
//! extent along the line of sight, which is estimated from the class and the apparent width.

use wire::sensor::{Camera, Class, Cluster, Detection, Modalities, Modality, PixelBox};

use super::CorroborationLimits;

/// Depth inside a detection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Depth {
    /// Along the optical axis, metres.
    pub metres: f64,
}

/// Place of a detection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DetectionPlace {
    /// Middle of the object: metres forward, metres left.
    pub middle: [f64; 2],
    /// Standard deviation on each axis, metres.
    pub sigma: f64,
}

/// Verdicts of depth and LiDAR. One is `None` when the stage gave no product for the frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spatial {
    /// Depth places the object and its size is plausible there.
    pub depth: Option<bool>,
    /// LiDAR has a cluster there.
    pub lidar: Option<bool>,
    /// Depth or LiDAR contradict the detection or each other.
    pub vetoed: Modalities,
    /// The place, if the available modalities agree.
    pub place: Option<DetectionPlace>,
}

impl Spatial {
    /// Turns contradictions of `unheard` modalities into support. Where depth and LiDAR contradict each other, there
    /// still is no place.
    pub(super) fn pass_over(&mut self, unheard: Modalities) {
        let heard = |m: &Modality| self.vetoed.contains(*m) && !unheard.contains(*m);
        let left = Modality::ALL.into_iter().filter(heard).fold(Modalities::default(), Modalities::with_modality);
        for (modality, verdict) in [(Modality::Depth, &mut self.depth), (Modality::Lidar, &mut self.lidar)] {
            if self.vetoed.contains(modality) && !left.contains(modality) {
                *verdict = Some(true);
            }
        }
        self.vetoed = left;
    }
}

/// Columns by which a cluster may lie outside its detection, and beyond an edge of the image that cuts the detection.
const SLACK_PX: f64 = 3.0;
const CUT_SLACK_PX: f64 = 60.0;
/// A box within this many pixels of the image's edge may be cut by it.
const EDGE_PX: u16 = 1;
/// Nearer than this there is no room for an object in front of the unit, metres.
const NEAREST_M: f64 = 0.8;

/// Size of a class, metres.
struct Prior {
    /// Least and greatest apparent width.
    width: (f64, f64),
    /// Least and greatest apparent height.
    height: (f64, f64),
    /// Sum of the horizontal sides, for the extent along the line of sight.
    sides: f64,
}

fn prior(class: Class) -> Prior {
    let [widest, highest] = class.largest_mm().map(|mm| f64::from(mm) / 1000.0);
    let (narrowest, lowest, sides) = match class {
        Class::Vehicle | Class::Decoy => (1.2, 1.0, 6.0),
        Class::Person => (0.3, 1.1, 1.0),
        Class::Obstacle => (0.3, 0.3, 3.0),
    };
    Prior { width: (narrowest, widest), height: (lowest, highest), sides }
}

/// Judges place and size of `detection`. `depth` and `clusters` are absent when their stage gave no product; the inner
/// `depth` is absent when the product holds no value for this detection.
pub fn judge(
    camera: &Camera,
    limits: &CorroborationLimits,
    detection: &Detection,
    depth: Option<Option<Depth>>,
    clusters: Option<&[Cluster]>,
) -> Spatial {
    let bounds = &detection.bounds;
    let by_depth = depth.flatten().filter(|d| d.metres >= NEAREST_M);
    let surface = by_depth.map(|d| surface(camera, bounds, d.metres));
    let in_sight = |c: &&Cluster| sees(camera, bounds, c);
    let cluster = clusters.and_then(|clusters| match surface {
        Some(at) => clusters.iter().filter(in_sight).min_by(|a, b| distance(at, a).total_cmp(&distance(at, b))),
        None => clusters.iter().filter(in_sight).min_by_key(|c| c.x_mm),
    });
    let mut spatial = Spatial {
        depth: depth.map(|_| false),
        lidar: clusters.map(|_| false),
        vetoed: Modalities::default(),
        place: None,
    };
    let agree = match (surface, cluster) {
        (Some(at), Some(c)) => {
            let limit = f64::from(limits.agreement_m) + f64::from(limits.agreement_per_m) * at[0];
            // A box cut at the side says how far away the object is, but not where its middle is across.
            let across = !cut(bounds.x0, bounds.x1, camera.width);
            if across { distance(at, c) <= limit } else { (at[0] - centroid(c)[0]).abs() <= limit }
        }
        (Some(_) | None, Some(_) | None) => true,
    };
    if !agree {
        spatial.vetoed = spatial.vetoed.with_modality(Modality::Depth).with_modality(Modality::Lidar);
        return spatial;
    }
    let range = |at: [f64; 2]| at[0] - f64::from(camera.forward_m);
    if let Some(position) = surface {
        let fits = plausible(camera, detection, range(position));
        spatial.depth = Some(fits);
        spatial.vetoed = if fits { spatial.vetoed } else { spatial.vetoed.with_modality(Modality::Depth) };
    }
    if let Some(c) = cluster {
        let fits = f64::from(c.width_mm) / 1000.0 <= 1.5 * prior(detection.class).width.1;
        spatial.lidar = Some(fits);
        spatial.vetoed = if fits { spatial.vetoed } else { spatial.vetoed.with_modality(Modality::Lidar) };
    }
    // LiDAR measures range better; the box says where the middle is across the line of sight.
    let near = match (surface, cluster) {
        (Some(at), Some(c)) => {
            let [x, y] = centroid(c);
            Some([0.5 * (at[0] + x), 0.5 * (at[1] + y)])
        }
        (Some(at), None) => Some(at),
        (None, Some(c)) => Some(centroid(c)),
        (None, None) => None,
    };
    spatial.place = near.map(|position| place(camera, detection, position));
    spatial
}

/// The surface point in the middle of the box.
fn surface(camera: &Camera, bounds: &PixelBox, metres: f64) -> [f64; 2] {
    let column = 0.5 * (f64::from(bounds.x0) + f64::from(bounds.x1));
    let right = (column - f64::from(camera.width) / 2.0) / f64::from(camera.focal_px) * metres;
    [f64::from(camera.forward_m) + metres, -right]
}

fn centroid(cluster: &Cluster) -> [f64; 2] {
    [f64::from(cluster.x_mm) / 1000.0, f64::from(cluster.y_mm) / 1000.0]
}

fn distance(place: [f64; 2], cluster: &Cluster) -> f64 {
    let [x, y] = centroid(cluster);
    ((place[0] - x) * (place[0] - x) + (place[1] - y) * (place[1] - y)).sqrt()
}

/// True if the cluster's middle is seen inside the box.
fn sees(camera: &Camera, bounds: &PixelBox, cluster: &Cluster) -> bool {
    let [x, y] = centroid(cluster);
    let along = x - f64::from(camera.forward_m);
    if along < NEAREST_M {
        return false;
    }
    let column = f64::from(camera.width) / 2.0 - y / along * f64::from(camera.focal_px);
    let slack = |cut: bool| if cut { CUT_SLACK_PX } else { SLACK_PX };
    let low = f64::from(bounds.x0) - slack(bounds.x0 <= EDGE_PX);
    let high = f64::from(bounds.x1) + slack(bounds.x1 + EDGE_PX >= camera.width);
    (low..=high).contains(&column)
}

/// True if the image's edge may cut a span.
fn cut(low: u16, high: u16, most: u16) -> bool {
    low <= EDGE_PX || high + EDGE_PX >= most
}

/// True if a box of this size at this distance can be the class. A box cut by the image's edge has no least size, and
/// one object may hide part of another, so the least size is taken at half.
fn plausible(camera: &Camera, detection: &Detection, metres: f64) -> bool {
    let (bounds, prior) = (&detection.bounds, prior(detection.class));
    let scale = metres / f64::from(camera.focal_px);
    let fits = |low: u16, high: u16, most: u16, (least, greatest): (f64, f64)| {
        let size = f64::from(high.saturating_sub(low));
        let cut = cut(low, high, most);
        (size - 2.5) * scale <= 1.3 * greatest && (cut || (size + 2.5) * scale >= 0.5 * least)
    };
    fits(bounds.x0, bounds.x1, camera.width, prior.width) && fits(bounds.y0, bounds.y1, camera.height, prior.height)
}

/// Place of a detection: from the near surface towards the middle of the object, along the line of sight.
fn place(camera: &Camera, detection: &Detection, near: [f64; 2]) -> DetectionPlace {
    let along = (near[0] - f64::from(camera.forward_m)).max(NEAREST_M);
    let range = (along * along + near[1] * near[1]).sqrt();
    let bounds = &detection.bounds;
    let apparent = f64::from(bounds.x1.saturating_sub(bounds.x0)) * along / f64::from(camera.focal_px);
    let sides = prior(detection.class).sides;
    let depth = (0.5 * (sides - apparent)).clamp(0.15 * sides, 0.35 * sides) * 0.8;
    let share = depth / range;
    DetectionPlace { middle: [near[0] + along * share, near[1] + near[1] * share], sigma: 0.3 + 0.01 * range }
}
