//! Visible part of an object behind others, and distance of a part of the image.
//!
//! Unrendered sensing knows an object by its box. Where another object may cover that box, rays find the part that a
//! sensor still reaches, as they do in `sensor` for every pixel and beam. The boxes of the objects that may be met
//! answer a ray, and the physical world where a person or the relief decides. No ray is cast for an object that no
//! other can cover, and no random number is drawn here. A stage's response to a part is left to `candidates`.

use rapier3d::prelude::Vector;
use wire::sensor::{Camera, Class, Lidar, PixelBox};

use crate::plant::State;
use crate::scene::Object;
use crate::sensor::camera::{REACH, clip, eye, project, ray};
use crate::world::{Placement, Surface, View, World};

/// Most rays across, and down, a part of the image.
const RAYS: u16 = 24;
/// Beams without a return that the returns of one object may reach across.
const GAP: usize = 2;

/// A sensor's view of an object.
pub(crate) enum Sight<P> {
    /// No other object is in front of it.
    Whole,
    /// Others cover all but this part.
    Part(P),
    /// Others cover all of it.
    Nothing,
}

/// The part of an object that the camera sees, the largest where cover cuts it into several.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Part {
    /// Box around it.
    pub(crate) bounds: PixelBox,
    /// Share of the object that the part is, 0 to 1.
    pub(crate) share: f32,
    /// Median depth of its surface along the optical axis, metres.
    pub(crate) depth: f32,
}

/// The eight corners of an object's box, world frame.
pub(crate) fn corners(object: &Object, place: &Placement) -> [Vector; 8] {
    let [l, w, h] = object.size.map(|s| s / 2.0);
    let [cos, sin] = place.facing;
    core::array::from_fn(|corner| {
        let sign = |bit: usize, v: f32| if corner & bit == 0 { v } else { -v };
        let (along, across) = (sign(1, l), sign(2, w));
        place.centre + Vector::new(along * cos - across * sin, along * sin + across * cos, sign(4, h))
    })
}

/// True if two boxes share a pixel.
pub(crate) fn overlap(a: &PixelBox, b: &PixelBox) -> bool {
    a.x0 < b.x1 && b.x0 < a.x1 && a.y0 < b.y1 && b.y0 < a.y1
}

/// Room for rounding around a box, metres.
const ROUNDING_M: f32 = 0.05;

/// Ray parameter at which an unobstructed ray enters an object's box, its sides further out by `spare`; 0 from inside.
fn entry((object, spare): (&Object, f32), place: &Placement, from: Vector, direction: Vector) -> Option<f32> {
    let [cos, sin] = place.facing;
    let local = |v: Vector| [v.x * cos + v.y * sin, v.y * cos - v.x * sin, v.z];
    let (from, direction) = (local(from - place.centre), local(direction));
    let (mut enters, mut leaves) = (0.0f32, f32::MAX);
    for axis in 0..3 {
        let half = object.size[axis] / 2.0 + spare;
        if direction[axis] == 0.0 {
            leaves = if from[axis].abs() > half { -1.0 } else { leaves };
            continue;
        }
        let ends = [-half, half].map(|side| (side - from[axis]) / direction[axis]);
        (enters, leaves) = (enters.max(ends[0].min(ends[1])), leaves.min(ends[0].max(ends[1])));
    }
    (enters <= leaves).then_some(enters)
}

/// A ray and how far it is of interest, in lengths of `towards`.
#[derive(Clone, Copy)]
struct Ray {
    from: Vector,
    towards: Vector,
    reach: f32,
}

/// Answers rays that only a few objects can meet by their boxes, and asks the physical world where a box is not the
/// whole truth.
struct Boxes<'a> {
    world: &'a World,
    view: &'a View<'a>,
}

impl Boxes<'_> {
    /// Ray parameter at which a ray enters the box of object `index`, its sides further out by `spare`.
    fn enters(&self, index: usize, spare: f32, ray: Ray) -> Option<f32> {
        let (object, place) = (&self.world.scene().objects[index], &self.world.placements()[index]);
        entry((object, spare), place, ray.from, ray.towards).filter(|distance| *distance <= ray.reach)
    }

    /// The first of `indices` that a ray meets, with the ray parameter there; `None` where that is the ground or
    /// nothing.
    fn first(&self, indices: impl Iterator<Item = usize>, ray: Ray) -> Option<(usize, f32)> {
        let mut nearest: Option<(usize, f32)> = None;
        let mut is_round = false;
        for index in indices {
            let object = &self.world.scene().objects[index];
            let is_person = object.class == Class::Person;
            // A short person is a ball that reaches beyond the box.
            let spare = if is_person { object.size[0].min(object.size[1]) / 2.0 } else { 0.0 };
            let Some(at) = self.enters(index, spare, ray) else { continue };
            is_round |= is_person;
            if nearest.is_none_or(|(_, before)| at < before) {
                nearest = Some((index, at));
            }
        }
        let (_, distance) = nearest?;
        // Between the two the ray is as high as the lower one at least.
        let lowest = ray.from.z.min((ray.from + ray.towards * distance).z);
        let is_above_ground = lowest > self.world.terrain().highest();
        if !is_round && is_above_ground {
            return nearest;
        }
        let hit = self.view.cast(ray.from, ray.towards, ray.reach)?;
        match hit.surface {
            Surface::Object(id) => Some((usize::from(id.0), hit.distance)),
            Surface::Ground => None,
        }
    }
}

/// The camera at one instant.
pub(crate) struct Eye<'a> {
    pub(crate) camera: &'a Camera,
    pub(crate) state: &'a State,
    pub(crate) world: &'a World,
    pub(crate) view: &'a View<'a>,
    silhouettes: Vec<Silhouette>,
}

/// Place of an object's box in the image.
#[derive(Clone, Copy)]
struct Silhouette {
    /// `None` outside the image. One that reaches behind the camera may be anywhere in it.
    bounds: Option<PixelBox>,
    /// Depths of its nearest and farthest parts before the camera, metres.
    depths: [f32; 2],
}

impl Silhouette {
    fn project(camera: &Camera, state: &State, (object, place): (&Object, &Placement)) -> Self {
        let projected = corners(object, place).map(|corner| project(camera, state, corner));
        let ahead: Vec<([f32; 2], f32)> = projected.into_iter().flatten().collect();
        let depths = [(f32::MAX, f32::min as fn(f32, f32) -> f32), (0.0, f32::max)];
        let mut depths = depths.map(|(start, fold)| ahead.iter().map(|(_, depth)| *depth).fold(start, fold));
        if (1..8).contains(&ahead.len()) {
            depths[0] = 0.0;
        }
        let bounds = match ahead.len() {
            0 => None,
            8 => bounding_box(camera, &ahead),
            _ => Some(PixelBox { x0: 0, y0: 0, x1: camera.width, y1: camera.height }),
        };
        Silhouette { bounds, depths }
    }

    fn overlaps(&self, bounds: &PixelBox) -> bool {
        self.bounds.is_some_and(|own_bounds| overlap(&own_bounds, bounds))
    }

    fn contains(&self, [column, row]: [f32; 2]) -> bool {
        let inside = |low: u16, value: f32, high: u16| f32::from(low) <= value && value <= f32::from(high);
        self.bounds.is_some_and(|own_bounds| {
            inside(own_bounds.x0, column, own_bounds.x1) && inside(own_bounds.y0, row, own_bounds.y1)
        })
    }
}

impl<'a> Eye<'a> {
    pub(crate) fn new(camera: &'a Camera, state: &'a State, world: &'a World, view: &'a View<'a>) -> Self {
        let objects = world.scene().objects.iter().zip(world.placements());
        let silhouettes = objects.map(|object| Silhouette::project(camera, state, object)).collect();
        Eye { camera, state, world, view, silhouettes }
    }

    /// The camera's view of object `index` with the full box `bounds`.
    pub(crate) fn part(&self, index: usize, bounds: &PixelBox) -> Sight<Part> {
        let mut indices = self.nearer_than(self.silhouettes[index].depths[1], bounds);
        if indices.iter().all(|other| *other == index) {
            return Sight::Whole;
        }
        if !indices.contains(&index) {
            indices.push(index);
        }
        let boxes = Boxes { world: self.world, view: self.view };
        let grid = Grid::covering(bounds);
        let rays: Vec<Ray> = grid.points().map(|place| self.ray(place)).collect();
        let first = |(at, ray): ([f32; 2], &Ray)| {
            let is_same = |other: &usize| *other == index || self.silhouettes[*other].contains(at);
            boxes.first(indices.iter().copied().filter(is_same), *ray)
        };
        let hits: Vec<Option<(usize, f32)>> = grid.points().zip(&rays).map(first).collect();
        let covers = |(hit, ray): &(&Option<(usize, f32)>, &Ray)| {
            hit.is_some_and(|(met, _)| met != index) && boxes.enters(index, 0.0, **ray).is_some()
        };
        let covered = hits.iter().zip(&rays).filter(covers).count();
        if covered == 0 {
            return Sight::Whole;
        }
        let is_hit = |cell: &usize| hits[*cell].is_some_and(|(met, _)| met == index);
        let all = (0..hits.len()).filter(is_hit).count();
        let largest = grid.largest(|cell| is_hit(&cell));
        let depth = median(largest.iter().filter_map(|cell| Some(hits[*cell]?.1)).collect());
        let Some((bounds, depth)) = grid.cells_box(&largest).zip(depth) else { return Sight::Nothing };
        Sight::Part(Part { bounds, share: largest.len() as f32 / (all + covered) as f32, depth })
    }

    /// Median depth in the middle half of a box, metres, as perception's depth stage reads it; `None` for sky.
    pub(crate) fn median_depth(&self, bounds: &PixelBox) -> Option<f32> {
        let half = |low: u16, high: u16| (low + (high - low) / 4, high - (high - low) / 4);
        let ((x0, x1), (y0, y1)) = (half(bounds.x0, bounds.x1), half(bounds.y0, bounds.y1));
        let middle = PixelBox { x0, y0, x1, y1 };
        let (indices, boxes) = (self.nearer_than(f32::MAX, &middle), Boxes { world: self.world, view: self.view });
        let grid = Grid::covering(&middle);
        let depths = grid.points().map(|place| self.ray(place)).filter_map(|ray| {
            let met = boxes.first(indices.iter().copied(), ray).map(|(_, distance)| distance);
            met.or_else(|| Some(self.view.cast(ray.from, ray.towards, REACH)?.distance))
        });
        median(depths.collect())
    }

    /// The objects of which a part may be nearer than `depth` within `bounds`.
    fn nearer_than(&self, depth: f32, bounds: &PixelBox) -> Vec<usize> {
        let silhouettes = self.silhouettes.iter().enumerate();
        silhouettes
            .filter(|(_, own_silhouette)| own_silhouette.depths[0] < depth && own_silhouette.overlaps(bounds))
            .map(|(index, _)| index)
            .collect()
    }

    fn ray(&self, place: [f32; 2]) -> Ray {
        Ray { from: eye(self.camera, self.state), towards: self.state.rotation * ray(self.camera, place), reach: REACH }
    }
}

/// The box around image points, each with its depth.
pub(crate) fn bounding_box<'a>(
    camera: &Camera,
    points: impl IntoIterator<Item = &'a ([f32; 2], f32)>,
) -> Option<PixelBox> {
    let (mut low, mut high) = ([f32::MAX; 2], [f32::MIN; 2]);
    for (at, _) in points {
        for axis in 0..2 {
            low[axis] = low[axis].min(at[axis]);
            high[axis] = high[axis].max(at[axis]);
        }
    }
    clip(camera, low, high)
}

/// Sample points in a box: each pixel of a small box, at most [`RAYS`] by [`RAYS`] of a large one.
struct Grid {
    bounds: PixelBox,
    step: [u16; 2],
    cells: [usize; 2],
}

impl Grid {
    fn covering(bounds: &PixelBox) -> Self {
        let sides = [bounds.x1 - bounds.x0, bounds.y1 - bounds.y0];
        let step = sides.map(|side| side.div_ceil(RAYS).max(1));
        let cells = [0, 1].map(|axis| usize::from(sides[axis].div_ceil(step[axis])));
        Grid { bounds: *bounds, step, cells }
    }

    /// The middle of each cell, row by row.
    fn points(&self) -> impl Iterator<Item = [f32; 2]> {
        let middle = |low: u16, step: u16, cell: usize| f32::from(low) + f32::from(step) * (cell as f32 + 0.5);
        let PixelBox { x0, y0, .. } = self.bounds;
        (0..self.cells[0] * self.cells[1]).map(move |cell| {
            let (column, row) = (cell % self.cells[0], cell / self.cells[0]);
            [middle(x0, self.step[0], column), middle(y0, self.step[1], row)]
        })
    }

    /// The largest group of neighbouring cells that satisfy `test`; the first of several.
    fn largest(&self, test: impl Fn(usize) -> bool) -> Vec<usize> {
        let (columns, rows) = (self.cells[0], self.cells[1]);
        let mut left: Vec<bool> = (0..columns * rows).map(test).collect();
        let mut largest = Vec::new();
        for start in 0..columns * rows {
            let (mut group, mut next) = (Vec::new(), vec![start]);
            while let Some(cell) = next.pop() {
                if !core::mem::take(&mut left[cell]) {
                    continue;
                }
                group.push(cell);
                let (column, row) = (cell % columns, cell / columns);
                let neighbours = [(column > 0, cell.wrapping_sub(1)), (column + 1 < columns, cell + 1)];
                let above = [(row > 0, cell.wrapping_sub(columns)), (row + 1 < rows, cell + columns)];
                next.extend(
                    neighbours.into_iter().chain(above).filter(|(is_there, _)| *is_there).map(|(_, cell)| cell),
                );
            }
            if group.len() > largest.len() {
                largest = group;
            }
        }
        largest
    }

    /// The box around cells.
    fn cells_box(&self, cells: &[usize]) -> Option<PixelBox> {
        let span = |bound: &dyn Fn(usize) -> usize| {
            Some((cells.iter().map(|c| bound(*c)).min()?, cells.iter().map(|c| bound(*c)).max()?))
        };
        let (left, right) = span(&|cell| cell % self.cells[0])?;
        let (top, bottom) = span(&|cell| cell / self.cells[0])?;
        let PixelBox { x0, y0, x1, y1 } = self.bounds;
        let edge = |low: u16, step: u16, cell: usize, most: u16| (low + step * cell as u16).min(most);
        Some(PixelBox {
            x0: edge(x0, self.step[0], left, x1),
            y0: edge(y0, self.step[1], top, y1),
            x1: edge(x0, self.step[0], right + 1, x1),
            y1: edge(y0, self.step[1], bottom + 1, y1),
        })
    }
}

fn median(mut values: Vec<f32>) -> Option<f32> {
    let half = values.len() / 2;
    if values.is_empty() { None } else { Some(*values.select_nth_unstable_by(half, f32::total_cmp).1) }
}

/// The LiDAR at one instant.
pub(crate) struct Scan<'a> {
    pub(crate) beams: &'a Lidar,
    pub(crate) state: &'a State,
    pub(crate) world: &'a World,
    pub(crate) view: &'a View<'a>,
    extents: Vec<Extent>,
}

impl<'a> Scan<'a> {
    pub(crate) fn new(beams: &'a Lidar, state: &'a State, world: &'a World, view: &'a View<'a>) -> Self {
        let objects = world.scene().objects.iter().zip(world.placements());
        let extents = objects.map(|(object, place)| Extent::from_object(object, place, state, beams.up_m)).collect();
        Scan { beams, state, world, view, extents }
    }

    /// Points of the beams that return from object `index`, body frame; of returns that cover separates, the larger
    /// group.
    pub(crate) fn returns(&self, index: usize) -> Sight<Vec<Vector>> {
        let own_extent = &self.extents[index];
        let before = |other: &usize| *other != index && self.extents[*other].may_cover(own_extent);
        let mut indices: Vec<usize> = (0..self.extents.len()).filter(before).collect();
        if own_extent.is_around() || indices.is_empty() {
            return Sight::Whole;
        }
        indices.push(index);
        let (object, place) = (&self.world.scene().objects[index], &self.world.placements()[index]);
        let boxes = Boxes { world: self.world, view: self.view };
        let from = self.state.to_world(Vector::new(0.0, 0.0, self.beams.up_m));
        let rings = (0..self.beams.rings).map(|ring| libm::sincosf(self.elevation(ring)));
        let elevations: Vec<(f32, f32)> = rings.filter(|(sin, cos)| own_extent.is_at_slope(sin / cos)).collect();
        let (mut groups, mut last, mut covered): (Vec<Vec<Vector>>, Option<usize>, bool) = (Vec::new(), None, false);
        for (k, azimuth) in self.azimuths(own_extent).enumerate() {
            let (sin_a, cos_a) = libm::sincosf(azimuth);
            let is_same = |other: &usize| *other == index || self.extents[*other].spans(azimuth);
            let others_here: Vec<usize> = indices.iter().copied().filter(is_same).collect();
            for (sin_e, cos_e) in &elevations {
                let towards = self.state.rotation * Vector::new(cos_e * cos_a, cos_e * sin_a, *sin_e);
                // A beam past it says nothing of it, and neither does what is behind it.
                if entry((object, ROUNDING_M), place, from, towards).is_none() {
                    continue;
                }
                let ray = Ray { from, towards, reach: own_extent.farthest + 1.0 };
                let Some((met, distance)) = boxes.first(others_here.iter().copied(), ray) else { continue };
                if met == index {
                    if last.is_none_or(|before| k - before > 1 + GAP) {
                        groups.push(Vec::new());
                    }
                    last = Some(k);
                    let point = self.state.to_body(from + towards * distance);
                    groups.last_mut().into_iter().for_each(|group| group.push(point));
                } else {
                    covered |= boxes.enters(index, 0.0, ray).is_some();
                }
            }
        }
        let largest = groups.into_iter().rev().max_by_key(Vec::len).filter(|group| group.len() > 1);
        match (covered, largest) {
            (false, _) => Sight::Whole,
            (true, Some(points)) => Sight::Part(points),
            (true, None) => Sight::Nothing,
        }
    }

    /// Least distance at which an object may be, metres.
    pub(crate) fn nearest(&self, index: usize) -> f32 {
        self.extents[index].nearest
    }

    /// The beams' azimuths within an extent, from its right to its left.
    fn azimuths(&self, own_extent: &Extent) -> impl Iterator<Item = f32> {
        let step = core::f32::consts::TAU / f32::from(self.beams.azimuths);
        let (first, last) = (
            libm::ceilf((own_extent.middle + own_extent.right) / step),
            libm::floorf((own_extent.middle + own_extent.left) / step),
        );
        let count = (last - first + 1.0).clamp(0.0, f32::from(self.beams.azimuths)) as u16;
        (0..count).map(move |k| (first + f32::from(k)) * step)
    }

    fn elevation(&self, ring: u16) -> f32 {
        (self.beams.lowest_deg + self.beams.ring_step_deg * f32::from(ring)).to_radians()
    }
}

/// Part of the LiDAR's turn in which an object lies.
struct Extent {
    /// Azimuth of its middle, and the turns from there to its ends, radians.
    middle: f32,
    right: f32,
    left: f32,
    /// Bounds of its distance, metres.
    nearest: f32,
    farthest: f32,
    /// Bounds of its height over the LiDAR by its horizontal distance.
    slopes: [f32; 2],
}

impl Extent {
    fn from_object(object: &Object, place: &Placement, state: &State, up_m: f32) -> Self {
        let centre = state.to_body(place.centre);
        let middle = azimuth(centre);
        let half = Vector::new(object.size[0], object.size[1], object.size[2]).length() / 2.0;
        let nearest = (centre.length() - half).max(0.0);
        let slopes = [f32::MAX, f32::MIN];
        let mut extent = Extent { middle, right: f32::MAX, left: f32::MIN, nearest, farthest: 0.0, slopes };
        let across = (centre.x * centre.x + centre.y * centre.y).sqrt();
        let distances = [(across - half - ROUNDING_M).max(ROUNDING_M), across + half + ROUNDING_M];
        for corner in corners(object, place).map(|corner| state.to_body(corner)) {
            let turn = wrapped(azimuth(corner) - middle);
            (extent.right, extent.left) = (extent.right.min(turn), extent.left.max(turn));
            extent.farthest = extent.farthest.max(corner.length());
            // A nearer point between corners is steeper and a farther one flatter.
            let slopes =
                distances.map(|distance| [-ROUNDING_M, ROUNDING_M].map(|spare| (corner.z - up_m + spare) / distance));
            extent.slopes[0] = slopes.as_flattened().iter().copied().fold(extent.slopes[0], f32::min);
            extent.slopes[1] = slopes.as_flattened().iter().copied().fold(extent.slopes[1], f32::max);
        }
        extent
    }

    fn may_cover(&self, other: &Extent) -> bool {
        let turn = wrapped(self.middle - other.middle);
        let overlaps = |turn: f32| turn + self.right < other.left && other.right < turn + self.left;
        let turns = [-core::f32::consts::TAU, 0.0, core::f32::consts::TAU].map(|whole| turn + whole);
        self.nearest < other.farthest && (self.is_around() || turns.into_iter().any(overlaps))
    }

    fn spans(&self, azimuth: f32) -> bool {
        self.is_around() || (self.right..=self.left).contains(&wrapped(azimuth - self.middle))
    }

    fn is_at_slope(&self, slope: f32) -> bool {
        (self.slopes[0]..=self.slopes[1]).contains(&slope)
    }

    /// True if the LiDAR may stand within the object's outline, where corners tell of no extent.
    fn is_around(&self) -> bool {
        self.left - self.right > core::f32::consts::PI
    }
}

fn azimuth(body: Vector) -> f32 {
    libm::atan2f(body.y, body.x)
}

/// An equal turn within half a turn of none.
fn wrapped(turn: f32) -> f32 {
    use core::f32::consts::{PI, TAU};
    match turn {
        t if t > PI => t - TAU,
        t if t <= -PI => t + TAU,
        t => t,
    }
}

#[cfg(test)]
mod tests {
    use wire::id::ObjectId;

    use super::*;
    use crate::candidates::bounds;
    use crate::render::{Label, render, settled};
    use crate::scene::{Scene, StartPose};

    /// A parked vehicle, and walls.
    fn scene(walls: &[([f32; 2], [f32; 3])]) -> Scene {
        let mut objects = Scene::default().objects;
        let wall = objects.remove(3);
        objects.truncate(1);
        (objects[0].path, objects[0].heading) = (vec![[8.0, -3.0]], 1.2);
        objects.extend(walls.iter().map(|(place, size)| Object {
            class: Class::Obstacle,
            path: vec![*place],
            size: *size,
            heading: 0.0,
            ..wall.clone()
        }));
        Scene { objects, ..Scene::default() }
    }

    fn labelled(scene: &Scene, pose: StartPose) -> Option<Label> {
        render(&config::platform::Sensors::GROUND, scene, pose, 5)
            .unwrap()
            .labels
            .into_iter()
            .find(|label| label.object == ObjectId(0))
    }

    /// Compared on equal scene from the same place, pixel by pixel. A cell of the grid is the least that can be
    /// distinguished.
    #[test]
    fn covered_vehicle_matches_its_rendered_part() {
        let walls: [&[([f32; 2], [f32; 3])]; 5] = [
            &[],
            &[([-5.0, -4.2], [3.0, 0.5, 1.0])],
            &[([3.0, -4.2], [0.5, 1.0, 1.2])],
            &[([2.0, -4.5], [0.5, 1.5, 2.5])],
            &[([1.0, -4.0], [0.5, 8.0, 4.0])],
        ];
        let mut parts = 0;
        for (walls, east) in walls.iter().flat_map(|walls| [-14.0, -9.0, -7.0].map(|east| (*walls, east))) {
            let (scene, pose) = (scene(walls), StartPose { east, north: -5.0, heading: 0.0 });
            let (world, plant) = settled(&scene, pose).unwrap();
            let (state, view, camera) = (plant.state(&world), world.view(plant.body()), Camera::GROUND);
            let whole = bounds(&camera, &state, &scene.objects[0], &world.placements()[0]).unwrap();
            let eye = Eye::new(&camera, &state, &world, &view);
            let single_label = labelled(&self::scene(&[]), pose).unwrap();
            let shown = labelled(&scene, pose);
            match (eye.part(0, &whole), shown) {
                (Sight::Whole, Some(shown)) => assert_eq!(shown.pixels, single_label.pixels, "{walls:?} {east}"),
                (Sight::Part(part), Some(shown)) => {
                    let cell = (whole.x1 - whole.x0).max(whole.y1 - whole.y0).div_ceil(RAYS);
                    let (a, b) = (part.bounds, shown.bounds);
                    let off = [a.x0.abs_diff(b.x0), a.x1.abs_diff(b.x1), a.y0.abs_diff(b.y0), a.y1.abs_diff(b.y1)];
                    assert!(off.iter().all(|off| *off <= cell), "{walls:?} {east}: {a:?} {b:?}");
                    let share = shown.pixels as f32 / single_label.pixels as f32;
                    assert!((part.share - share).abs() < 0.05, "{walls:?} {east}: {} {share}", part.share);
                    parts += 1;
                }
                (Sight::Nothing, None) => {}
                (_, shown) => panic!("{walls:?} {east}: {shown:?}"),
            }
        }
        assert!(parts >= 4, "{parts}");
    }

    /// None comes from behind a wall.
    #[test]
    fn beams_return_from_uncovered_parts_only() {
        let depths_of = |walls: &[([f32; 2], [f32; 3])]| {
            let scene = scene(walls);
            let (world, plant) = settled(&scene, StartPose { east: -2.0, north: -5.0, heading: 0.0 }).unwrap();
            let (state, view) = (plant.state(&world), world.view(plant.body()));
            match Scan::new(&Lidar::GROUND, &state, &world, &view).returns(0) {
                Sight::Whole => "whole".to_owned(),
                Sight::Nothing => "nothing".to_owned(),
                // The edge of the wall lies 0.16 to 0.17 radians to the left.
                Sight::Part(points) => format!("part, past the edge: {}", points.iter().all(|p| azimuth(*p) > 0.15)),
            }
        };
        assert_eq!(depths_of(&[]), "whole");
        assert_eq!(depths_of(&[([1.0, 4.0], [0.5, 1.0, 2.0])]), "whole");
        assert_eq!(depths_of(&[([4.0, -6.0], [0.5, 4.0, 3.0])]), "part, past the edge: true");
        assert_eq!(depths_of(&[([3.0, -4.0], [0.5, 8.0, 4.0])]), "nothing");
    }
}
