//! Visible part of an object behind others, and distance of a part of the image.
//!
//! Unrendered sensing knows an object by its box. Where another object may cover that box, rays find the part that a
//! sensor still reaches, as they do in `sensor` for every pixel and beam. No ray is cast for an object that no other can
//! cover, and no random number is drawn here. A stage's response to a part is left to `candidates`.

use rapier3d::prelude::Vector;
use wire::id::ObjectId;
use wire::sensor::{Camera, Lidar, PixelBox};

use crate::plant::State;
use crate::scene::Object;
use crate::sensor::camera::{REACH, clip, eye, project, ray};
use crate::world::{Hit, Placement, Surface, View, World};

/// Most rays across, and down, a part of the image.
const RAYS: u16 = 24;
/// Beams without a return that the returns of one object may reach across.
const GAP: usize = 2;

/// A sensor's view of an object.
pub(crate) enum Sight<P> {
    /// No other object stands in front of it.
    Whole,
    /// A part.
    Part(P),
    /// Others cover all of it.
    Nothing,
}

/// The part of an object that the camera sees, the largest where cover cuts it into several.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Part {
    /// Box around it.
    pub(crate) bounds: PixelBox,
    /// Share of the object that it is, 0 to 1.
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

/// True if an unobstructed ray would meet an object's box, its sides further out by `spare`.
fn crosses((object, spare): (&Object, f32), place: &Placement, from: Vector, towards: Vector) -> bool {
    let [cos, sin] = place.facing;
    let local = |v: Vector| [v.x * cos + v.y * sin, v.y * cos - v.x * sin, v.z];
    let (from, towards) = (local(from - place.centre), local(towards));
    let (mut enters, mut leaves) = (0.0f32, f32::MAX);
    for axis in 0..3 {
        let half = object.size[axis] / 2.0 + spare;
        if towards[axis] == 0.0 {
            leaves = if from[axis].abs() > half { -1.0 } else { leaves };
            continue;
        }
        let ends = [-half, half].map(|side| (side - from[axis]) / towards[axis]);
        (enters, leaves) = (enters.max(ends[0].min(ends[1])), leaves.min(ends[0].max(ends[1])));
    }
    enters <= leaves
}

/// The camera at one instant.
pub(crate) struct Eye<'a> {
    pub(crate) camera: &'a Camera,
    pub(crate) state: &'a State,
    pub(crate) world: &'a World,
    pub(crate) view: &'a View<'a>,
}

impl Eye<'_> {
    /// The camera's view of object `index` with the full box `bounds`.
    pub(crate) fn part(&self, index: usize, bounds: &PixelBox) -> Sight<Part> {
        let (object, place) = (&self.world.scene().objects[index], &self.world.placements()[index]);
        let depths = corners(object, place).map(|corner| self.depth(corner));
        let behind = depths.into_iter().flatten().fold(0.0, f32::max);
        if !self.may_be_covered(index, bounds, behind) {
            return Sight::Whole;
        }
        let id = Surface::Object(ObjectId(index as u16));
        let grid = Grid::over(bounds);
        let rays: Vec<Vector> = grid.points().map(|at| self.state.rotation * ray(self.camera, at)).collect();
        let hits: Vec<Option<Hit>> = rays.iter().map(|towards| self.cast(*towards)).collect();
        let from = eye(self.camera, self.state);
        let covers = |(hit, towards): &(&Option<Hit>, &Vector)| {
            hit.is_some_and(|h| h.surface != id && h.surface != Surface::Ground)
                && crosses((object, 0.0), place, from, **towards)
        };
        let covered = hits.iter().zip(&rays).filter(covers).count();
        if covered == 0 {
            return Sight::Whole;
        }
        let own = |cell: &usize| hits[*cell].is_some_and(|h| h.surface == id);
        let all = (0..hits.len()).filter(own).count();
        let largest = grid.largest(|cell| own(&cell));
        let depth = median(largest.iter().filter_map(|cell| Some(hits[*cell]?.distance)).collect());
        let Some((bounds, depth)) = grid.around(&largest).zip(depth) else { return Sight::Nothing };
        Sight::Part(Part { bounds, share: largest.len() as f32 / (all + covered) as f32, depth })
    }

    /// Median depth in the middle half of a box, metres, as perception's depth stage reads it; `None` for sky.
    pub(crate) fn median_depth(&self, bounds: &PixelBox) -> Option<f32> {
        let half = |low: u16, high: u16| (low + (high - low) / 4, high - (high - low) / 4);
        let ((x0, x1), (y0, y1)) = (half(bounds.x0, bounds.x1), half(bounds.y0, bounds.y1));
        let grid = Grid::over(&PixelBox { x0, y0, x1, y1 });
        let rays = grid.points().map(|at| self.state.rotation * ray(self.camera, at));
        median(rays.filter_map(|towards| Some(self.cast(towards)?.distance)).collect())
    }

    /// True if the box of another object that is nearer than `behind` may overlap `bounds`. One that reaches behind the camera
    /// has no box and may.
    fn may_be_covered(&self, index: usize, bounds: &PixelBox, behind: f32) -> bool {
        let objects = self.world.scene().objects.iter().zip(self.world.placements()).enumerate();
        objects.filter(|(other, _)| *other != index).any(|(_, (object, place))| {
            let projected = corners(object, place).map(|corner| project(self.camera, self.state, corner));
            let ahead: Vec<([f32; 2], f32)> = projected.into_iter().flatten().collect();
            let is_nearer = ahead.iter().any(|(_, depth)| *depth < behind);
            is_nearer && (ahead.len() < 8 || around(self.camera, &ahead).is_some_and(|b| overlap(&b, bounds)))
        })
    }

    fn depth(&self, at: Vector) -> Option<f32> {
        Some(project(self.camera, self.state, at)?.1)
    }

    fn cast(&self, towards: Vector) -> Option<Hit> {
        self.view.cast(eye(self.camera, self.state), towards, REACH)
    }
}

/// The box around image points, each with its depth.
pub(crate) fn around<'a>(camera: &Camera, points: impl IntoIterator<Item = &'a ([f32; 2], f32)>) -> Option<PixelBox> {
    let (mut low, mut high) = ([f32::MAX; 2], [f32::MIN; 2]);
    for (at, _) in points {
        for axis in 0..2 {
            low[axis] = low[axis].min(at[axis]);
            high[axis] = high[axis].max(at[axis]);
        }
    }
    clip(camera, low, high)
}

/// Pixels of a box, every one of a small box and at most [`RAYS`] each way of a large one.
struct Grid {
    bounds: PixelBox,
    step: [u16; 2],
    cells: [usize; 2],
}

impl Grid {
    fn over(bounds: &PixelBox) -> Self {
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
                let beside = [(column > 0, cell.wrapping_sub(1)), (column + 1 < columns, cell + 1)];
                let above = [(row > 0, cell.wrapping_sub(columns)), (row + 1 < rows, cell + columns)];
                next.extend(beside.into_iter().chain(above).filter(|(is_there, _)| *is_there).map(|(_, cell)| cell));
            }
            if group.len() > largest.len() {
                largest = group;
            }
        }
        largest
    }

    /// The box around cells.
    fn around(&self, cells: &[usize]) -> Option<PixelBox> {
        let span = |of: &dyn Fn(usize) -> usize| {
            Some((cells.iter().map(|c| of(*c)).min()?, cells.iter().map(|c| of(*c)).max()?))
        };
        let (left, right) = span(&|cell| cell % self.cells[0])?;
        let (top, bottom) = span(&|cell| cell / self.cells[0])?;
        let PixelBox { x0, y0, x1, y1 } = self.bounds;
        let at = |low: u16, step: u16, cell: usize, most: u16| (low + step * cell as u16).min(most);
        Some(PixelBox {
            x0: at(x0, self.step[0], left, x1),
            y0: at(y0, self.step[1], top, y1),
            x1: at(x0, self.step[0], right + 1, x1),
            y1: at(y0, self.step[1], bottom + 1, y1),
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
}

impl Scan<'_> {
    /// Points of the beams that return from object `index`, body frame; of returns that cover separates, the larger group.
    pub(crate) fn returns(&self, index: usize) -> Sight<Vec<Vector>> {
        let middle = azimuth(self.state.to_body(self.world.placements()[index].centre));
        let own = self.extent(index, middle);
        if own.right - own.left > core::f32::consts::PI || !self.may_be_covered(index, middle, &own) {
            return Sight::Whole;
        }
        let id = Surface::Object(ObjectId(index as u16));
        let (object, place) = (&self.world.scene().objects[index], &self.world.placements()[index]);
        let origin = self.state.to_world(Vector::new(0.0, 0.0, self.beams.up_m));
        let (mut groups, mut last, mut covered): (Vec<Vec<Vector>>, Option<usize>, bool) = (Vec::new(), None, false);
        for (k, azimuth) in self.azimuths(middle, &own).enumerate() {
            for ring in 0..self.beams.rings {
                let direction = self.state.rotation * self.direction(azimuth, ring);
                // A beam past it says nothing of it, and neither does what is behind it.
                if !crosses((object, ROUNDING_M), place, origin, direction) {
                    continue;
                }
                let Some(hit) = self.view.cast(origin, direction, own.farthest + 1.0) else { continue };
                if hit.surface == id {
                    if last.is_none_or(|before| k - before > 1 + GAP) {
                        groups.push(Vec::new());
                    }
                    last = Some(k);
                    let point = self.state.to_body(origin + direction * hit.distance);
                    groups.last_mut().into_iter().for_each(|group| group.push(point));
                } else if hit.surface != Surface::Ground && crosses((object, 0.0), place, origin, direction) {
                    covered = true;
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

    fn may_be_covered(&self, index: usize, middle: f32, own: &Extent) -> bool {
        let others = (0..self.world.placements().len()).filter(|other| *other != index);
        let nearer = others.filter(|other| self.nearest(*other) < own.farthest);
        nearer.map(|other| self.extent(other, middle)).any(|other| {
            let turns = other.right - other.left > core::f32::consts::PI;
            turns || (other.left < own.right && own.left < other.right)
        })
    }

    /// Least distance at which an object may be, metres.
    pub(crate) fn nearest(&self, index: usize) -> f32 {
        let (object, place) = (&self.world.scene().objects[index], &self.world.placements()[index]);
        let half = Vector::new(object.size[0], object.size[1], object.size[2]).length() / 2.0;
        (self.state.to_body(place.centre).length() - half).max(0.0)
    }

    /// Extent of an object as seen from the LiDAR, azimuths from `middle`.
    fn extent(&self, index: usize, middle: f32) -> Extent {
        let (object, place) = (&self.world.scene().objects[index], &self.world.placements()[index]);
        let mut extent = Extent { left: f32::MAX, right: f32::MIN, farthest: 0.0 };
        for corner in corners(object, place).map(|corner| self.state.to_body(corner)) {
            let turn = wrapped(azimuth(corner) - middle);
            (extent.left, extent.right) = (extent.left.min(turn), extent.right.max(turn));
            extent.farthest = extent.farthest.max(corner.length());
        }
        extent
    }

    /// The beams' azimuths within an extent, from its right to its left.
    fn azimuths(&self, middle: f32, own: &Extent) -> impl Iterator<Item = f32> {
        let step = core::f32::consts::TAU / f32::from(self.beams.azimuths);
        let (first, last) = (libm::ceilf((middle + own.left) / step), libm::floorf((middle + own.right) / step));
        let count = (last - first + 1.0).clamp(0.0, f32::from(self.beams.azimuths)) as u16;
        (0..count).map(move |k| (first + f32::from(k)) * step)
    }

    fn direction(&self, azimuth: f32, ring: u16) -> Vector {
        let elevation = (self.beams.lowest_deg + self.beams.ring_step_deg * f32::from(ring)).to_radians();
        let ((sin_e, cos_e), (sin_a, cos_a)) = (libm::sincosf(elevation), libm::sincosf(azimuth));
        Vector::new(cos_e * cos_a, cos_e * sin_a, sin_e)
    }
}

/// Azimuths in radians and distances in metres between which an object lies.
struct Extent {
    left: f32,
    right: f32,
    farthest: f32,
}

fn azimuth(body: Vector) -> f32 {
    libm::atan2f(body.y, body.x)
}

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
    use wire::sensor::Class;

    use super::*;
    use crate::candidates::bounds;
    use crate::render::{Label, render, settled};
    use crate::scene::{Scene, Start};

    /// A parked vehicle, and walls.
    fn scene(walls: &[([f32; 2], [f32; 3])]) -> Scene {
        let mut objects = Scene::default().objects;
        let wall = objects.remove(3);
        objects.truncate(1);
        (objects[0].path, objects[0].heading) = (vec![[8.0, -3.0]], 1.2);
        objects.extend(walls.iter().map(|(at, size)| Object {
            class: Class::Obstacle,
            path: vec![*at],
            size: *size,
            heading: 0.0,
            ..wall.clone()
        }));
        Scene { objects, ..Scene::default() }
    }

    fn labelled(scene: &Scene, pose: Start) -> Option<Label> {
        render(&wire::platform::Sensors::GROUND, scene, pose, 5)
            .unwrap()
            .labels
            .into_iter()
            .find(|label| label.object == ObjectId(0))
    }

    /// Of the same scene from the same place, pixel by pixel. A cell of the grid is the least that can be told.
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
            let (scene, pose) = (scene(walls), Start { east, north: -5.0, heading: 0.0 });
            let (world, plant) = settled(&scene, pose).unwrap();
            let (state, view, camera) = (plant.state(&world), world.view(plant.body()), Camera::GROUND);
            let whole = bounds(&camera, &state, &scene.objects[0], &world.placements()[0]).unwrap();
            let eye = Eye { camera: &camera, state: &state, world: &world, view: &view };
            let alone = labelled(&self::scene(&[]), pose).unwrap();
            let shown = labelled(&scene, pose);
            match (eye.part(0, &whole), shown) {
                (Sight::Whole, Some(shown)) => assert_eq!(shown.pixels, alone.pixels, "{walls:?} {east}"),
                (Sight::Part(part), Some(shown)) => {
                    let cell = (whole.x1 - whole.x0).max(whole.y1 - whole.y0).div_ceil(RAYS);
                    let (a, b) = (part.bounds, shown.bounds);
                    let off = [a.x0.abs_diff(b.x0), a.x1.abs_diff(b.x1), a.y0.abs_diff(b.y0), a.y1.abs_diff(b.y1)];
                    assert!(off.iter().all(|off| *off <= cell), "{walls:?} {east}: {a:?} {b:?}");
                    let share = shown.pixels as f32 / alone.pixels as f32;
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
        let of = |walls: &[([f32; 2], [f32; 3])]| {
            let scene = scene(walls);
            let (world, plant) = settled(&scene, Start { east: -2.0, north: -5.0, heading: 0.0 }).unwrap();
            let (state, view) = (plant.state(&world), world.view(plant.body()));
            match (Scan { beams: &Lidar::GROUND, state: &state, world: &world, view: &view }).returns(0) {
                Sight::Whole => "whole".to_owned(),
                Sight::Nothing => "nothing".to_owned(),
                // The edge of the wall lies 0.16 to 0.17 radians to the left.
                Sight::Part(points) => format!("part, past the edge: {}", points.iter().all(|p| azimuth(*p) > 0.15)),
            }
        };
        assert_eq!(of(&[]), "whole");
        assert_eq!(of(&[([1.0, 4.0], [0.5, 1.0, 2.0])]), "whole");
        assert_eq!(of(&[([4.0, -6.0], [0.5, 4.0, 3.0])]), "part, past the edge: true");
        assert_eq!(of(&[([3.0, -4.0], [0.5, 8.0, 4.0])]), "nothing");
    }
}
