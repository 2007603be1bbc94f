//! The LiDAR stage: groups of returns that stand above the ground.
//!
//! Ground is followed outward ring by ring in each azimuth: a return belongs to it while it rises no steeper than
//! terrain may, measured from the last ground return, so slopes and a pitched unit are no objects. A far object's
//! lowest return passes for ground until the next one stands above it; then it is taken back. The remaining returns are
//! joined to segments along an azimuth and then across neighbouring azimuths.

use std::sync::Arc;

use wire::codec::List;
use wire::sensor::{Cluster, Lidar};

/// Rise that is still ground: at no distance from the last ground return, metres, and for each metre of it.
const RISE_M: f32 = 0.15;
const SLOPE: f32 = 0.3;
/// Returns of one azimuth further apart than this belong to different things, metres.
const GAP_M: f32 = 0.8;
/// Segments of neighbouring azimuths are separate objects if their ranges differ by more than this too: at no range,
/// and for each metre.
const STEP_M: f32 = 0.5;
const STEP_PER_M: f32 = 0.03;
/// A return taken for ground is the foot of an object that stands above it within this much of its range, metres.
const FOOT_M: f32 = 0.5;
/// Azimuths without a return that a cluster may reach across.
const REACH: usize = 2;
/// Fewest returns, least height and greatest extent of a cluster.
const FEWEST: u32 = 2;
const LEAST_HEIGHT_M: f32 = 0.2;
const LARGEST_M: f32 = 8.0;

/// Points of the returns, in the LiDAR's own frame (x ahead, y left, z up), metres, ring by ring: `plane` is
/// ring-major, u16 little-endian millimetres. A beam without a return is left out, and so is data beyond one scan.
pub fn returns(beams: Lidar, plane: &[u8]) -> impl Iterator<Item = [f32; 3]> {
    let azimuths = usize::from(beams.azimuths).max(1);
    let ranges = plane.chunks_exact(2).map(|b| f32::from(u16::from_le_bytes([b[0], b[1]])) / 1e3);
    ranges.take(azimuths * usize::from(beams.rings)).enumerate().filter(|(_, range)| *range > 0.0).map(
        move |(k, range)| {
            let (ring, azimuth) = ((k / azimuths) as f32, (k % azimuths) as f32);
            let (rise, reach) = libm::sincosf((beams.lowest_deg + beams.ring_step_deg * ring).to_radians());
            let (left, ahead) = libm::sincosf((360.0 / azimuths as f32 * azimuth).to_radians());
            [range * reach * ahead, range * reach * left, range * rise]
        },
    )
}

/// The stage with its beams' directions.
#[derive(Clone, Debug)]
pub struct Scanner {
    azimuths: usize,
    up_m: f32,
    /// Sine and cosine of each ring's elevation.
    rings: Arc<[(f32, f32)]>,
    /// Sine and cosine of each azimuth.
    directions: Arc<[(f32, f32)]>,
}

/// Returns of one azimuth that belong together.
#[derive(Clone, Copy, Debug)]
struct Segment {
    azimuth: usize,
    near: f32,
    far: f32,
    low: f32,
    high: f32,
    returns: u32,
    /// Sum of the returns' horizontal ranges.
    sum: f32,
}

impl Scanner {
    /// A scanner for this geometry.
    pub fn new(lidar: &Lidar) -> Self {
        let direction = |degrees: f32| libm::sincosf(degrees.to_radians());
        let rings = (0..lidar.rings).map(|k| direction(lidar.lowest_deg + lidar.ring_step_deg * f32::from(k)));
        let directions = (0..lidar.azimuths).map(|k| direction(f32::from(k) * 360.0 / f32::from(lidar.azimuths)));
        Scanner {
            azimuths: usize::from(lidar.azimuths),
            up_m: lidar.up_m,
            rings: rings.collect(),
            directions: directions.collect(),
        }
    }

    /// Clusters in the body frame, nearest first. `None` when the plane (ring-major, u16 little-endian millimetres,
    /// 0 = no return) is not of this geometry.
    pub fn clusters(&self, plane: &[u8]) -> Option<List<Cluster, 64>> {
        if plane.len() != 2 * self.azimuths * self.rings.len() {
            return None;
        }
        let segments: Vec<Segment> = (0..self.azimuths).flat_map(|azimuth| self.segments(plane, azimuth)).collect();
        let roots = join(&segments, self.azimuths);
        let mut shapes: Vec<(usize, Shape)> = Vec::new();
        for (segment, root) in segments.iter().zip(&roots) {
            let shape = match shapes.iter().position(|(r, _)| r == root) {
                Some(at) => &mut shapes[at].1,
                None => {
                    shapes.push((*root, Shape::default()));
                    let last = shapes.len() - 1;
                    &mut shapes[last].1
                }
            };
            shape.add(segment, self.directions[segment.azimuth]);
        }
        let mut shapes: Vec<Shape> = shapes.into_iter().map(|(_, s)| s).filter(Shape::plausible).collect();
        shapes.sort_by(|a, b| a.range().total_cmp(&b.range()));
        Some(shapes.iter().map(Shape::cluster).collect())
    }

    /// Returns above the ground in one azimuth, nearest ring first.
    fn segments(&self, plane: &[u8], azimuth: usize) -> Vec<Segment> {
        let (mut before, mut ground, mut found) = ((0.0, 0.0), (0.0, 0.0), Vec::<Segment>::new());
        for (ring, (sin, cos)) in self.rings.iter().enumerate() {
            let index = 2 * (ring * self.azimuths + azimuth);
            let range = f32::from(u16::from_le_bytes([plane[index], plane[index + 1]])) / 1000.0;
            if range <= 0.0 {
                continue;
            }
            let (r, z) = (range * cos, self.up_m + range * sin);
            let (run, rise) = (r - ground.0, z - ground.1);
            if rise <= RISE_M + SLOPE * run.max(0.0) {
                (before, ground) = (ground, (r, z));
                continue;
            }
            match found.last_mut().filter(|s| r - s.far <= GAP_M && s.near - r <= GAP_M) {
                Some(segment) => segment.take(r, z),
                None => {
                    let mut segment = Segment { azimuth, near: r, far: r, low: z, high: z, returns: 1, sum: r };
                    if ground.0 > 0.0 && run.abs() <= FOOT_M {
                        segment.take(ground.0, ground.1);
                        ground = before;
                    }
                    found.push(segment);
                }
            }
        }
        found
    }
}

impl Segment {
    fn take(&mut self, r: f32, z: f32) {
        (self.near, self.far) = (self.near.min(r), self.far.max(r));
        (self.low, self.high) = (self.low.min(z), self.high.max(z));
        self.returns += 1;
        self.sum += r;
    }

    fn touches(&self, other: &Segment) -> bool {
        let step = STEP_M + STEP_PER_M * self.near;
        self.near - other.far <= step && other.near - self.far <= step
    }
}

/// Lowest index of the segments connected to each segment. Segments are in order of azimuth, which wraps around.
fn join(segments: &[Segment], azimuths: usize) -> Vec<usize> {
    let mut parents: Vec<usize> = (0..segments.len()).collect();
    let mut first = vec![segments.len(); azimuths + 1];
    for (index, segment) in segments.iter().enumerate().rev() {
        first[segment.azimuth] = index;
    }
    for azimuth in (0..azimuths).rev() {
        first[azimuth] = first[azimuth].min(first[azimuth + 1]);
    }
    for (index, segment) in segments.iter().enumerate() {
        for step in 1..=1 + REACH {
            let next = (segment.azimuth + step) % azimuths;
            let (from, to) = (first[next], first[next + 1]);
            for (offset, candidate) in segments[from..to].iter().enumerate() {
                if segment.touches(candidate) {
                    let other = from + offset;
                    let (a, b) = (root(&mut parents, index), root(&mut parents, other));
                    parents[a.max(b)] = a.min(b);
                }
            }
        }
    }
    (0..segments.len()).map(|index| root(&mut parents, index)).collect()
}

fn root(parents: &mut [usize], mut at: usize) -> usize {
    while parents[at] != at {
        parents[at] = parents[parents[at]];
        at = parents[at];
    }
    at
}

/// Segments that belong together.
#[derive(Clone, Copy, Debug)]
struct Shape {
    returns: u32,
    sum: [f32; 2],
    low: [f32; 3],
    high: [f32; 3],
}

impl Default for Shape {
    fn default() -> Self {
        Shape { returns: 0, sum: [0.0; 2], low: [f32::MAX; 3], high: [f32::MIN; 3] }
    }
}

impl Shape {
    fn add(&mut self, segment: &Segment, (sin, cos): (f32, f32)) {
        self.returns += segment.returns;
        self.sum = [self.sum[0] + segment.sum * cos, self.sum[1] + segment.sum * sin];
        for (r, z) in [(segment.near, segment.low), (segment.far, segment.high)] {
            let point = [r * cos, r * sin, z];
            self.low = core::array::from_fn(|axis| self.low[axis].min(point[axis]));
            self.high = core::array::from_fn(|axis| self.high[axis].max(point[axis]));
        }
    }

    fn extent(&self) -> f32 {
        let (dx, dy) = (self.high[0] - self.low[0], self.high[1] - self.low[1]);
        (dx * dx + dy * dy).sqrt()
    }

    fn plausible(&self) -> bool {
        let height = self.high[2] - self.low[2];
        self.returns >= FEWEST && height >= LEAST_HEIGHT_M && self.extent() <= LARGEST_M
    }

    fn centroid(&self) -> [f32; 2] {
        self.sum.map(|s| s / self.returns.max(1) as f32)
    }

    fn range(&self) -> f32 {
        let [x, y] = self.centroid();
        x * x + y * y
    }

    fn cluster(&self) -> Cluster {
        let [x, y] = self.centroid().map(|v| (v * 1000.0) as i32);
        let millimetres = |metres: f32| (metres * 1000.0).clamp(0.0, 65_535.0) as u16;
        let height_mm = millimetres(self.high[2] - self.low[2]);
        Cluster { x_mm: x, y_mm: y, width_mm: millimetres(self.extent()), height_mm }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ranges over a plane that rises by `slope` along x, with walls of 1.6 m given as (nearest azimuth, farthest, x).
    fn scan(slope: f32, walls: &[(i32, i32, f32)]) -> Vec<u8> {
        let lidar = Lidar::GROUND;
        let mut plane = Vec::new();
        for ring in 0..lidar.rings {
            let (sin, cos) = libm::sincosf((lidar.lowest_deg + lidar.ring_step_deg * f32::from(ring)).to_radians());
            for azimuth in 0..i32::from(lidar.azimuths) {
                let degrees = if azimuth > 180 { azimuth - 360 } else { azimuth };
                let cos_a = libm::cosf((degrees as f32).to_radians());
                let sink = slope * cos * cos_a - sin;
                let mut range = if sink > 0.0 { lidar.up_m / sink } else { 0.0 };
                for (_, _, x) in walls.iter().filter(|w| (w.0..=w.1).contains(&degrees)) {
                    let (reach, base) = (x / (cos * cos_a), slope * x);
                    let z = lidar.up_m + reach * sin;
                    if z >= base && z <= base + 1.6 && (range == 0.0 || reach < range) {
                        range = reach;
                    }
                }
                let millimetres = if range < 60.0 { (range * 1000.0) as u16 } else { 0 };
                plane.extend(millimetres.to_le_bytes());
            }
        }
        plane
    }

    #[test]
    fn bare_ground_level_or_sloping_has_no_clusters() {
        let scanner = Scanner::new(&Lidar::GROUND);
        for slope in [-0.1, 0.0, 0.12] {
            assert_eq!(scanner.clusters(&scan(slope, &[])).unwrap().len(), 0, "slope {slope}");
        }
        assert!(scanner.clusters(&[0; 10]).is_none());
    }

    /// Though its azimuths wrap around.
    #[test]
    fn object_straight_ahead_is_one_cluster() {
        let scanner = Scanner::new(&Lidar::GROUND);
        for slope in [-0.05, 0.0, 0.1] {
            let found = scanner.clusters(&scan(slope, &[(-8, 8, 12.0), (30, 36, 9.0)])).unwrap();
            assert_eq!(found.len(), 2, "slope {slope}: {found:?}");
            let ahead = found.iter().find(|c| c.y_mm.abs() < 500).unwrap();
            assert!((ahead.x_mm - 12_000).abs() < 150, "{ahead:?}");
            assert!((3_000..4_000).contains(&ahead.width_mm), "{ahead:?}");
        }
    }
}
