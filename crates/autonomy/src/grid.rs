//! The planning grid: cells inside the geofence that may be driven, and the shortest way between two points of it.
//!
//! World frame, millimetres. The grid is made from fence, margin and map, once for each margin; moving obstacles are
//! passed to each search. Where there is no way with the planned clearance, a narrower one is searched that the body
//! just fits through. The search is A* of the `pathfinding` crate. Following the way is left to `navigation`.

use std::sync::Arc;

use pathfinding::prelude::astar;

use crate::extent::Extent;
use crate::geofence::{Geofence, Point, distance, nearer, to_segment};

/// Smallest cell, millimetres.
const CELL_MM: f64 = 500.0;
/// Most cells along a side.
const MAX_SIDE: u16 = 1024;
/// Distance from which a start in a closed place is left.
const OUT_MM: f64 = 6000.0;
/// Cost of a step to a neighbour, straight and diagonal.
const STRAIGHT: u32 = 10;
const DIAGONAL: u32 = 14;

/// A place to keep clear of, and how far from its centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keepout {
    /// Centre of the circle, millimetres.
    pub at: Point,
    /// Distance that is planned for, millimetres.
    pub radius: f64,
    /// The least distance with which the body passes, millimetres.
    pub least: f64,
}

impl Keepout {
    fn cuts(&self, a: Point, b: Point, width: Room) -> bool {
        to_segment(self.at, a, b) < self.distance(width)
    }

    fn distance(&self, width: Room) -> f64 {
        if width == Room::Wide { self.radius } else { self.least }
    }
}

/// Cells over the fence's bounding box.
#[derive(Clone, Debug)]
pub struct Grid {
    origin: Point,
    cell: f64,
    width: u16,
    height: u16,
    room: Arc<[Room]>,
    /// Things on the map, and the least distance to them with which the body fits through.
    map: Arc<[Extent]>,
    narrow: f64,
}

/// Room around the middle of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Room {
    /// Too near to the fence, or to something on the map.
    Closed,
    /// The body fits through.
    Narrow,
    /// The clearance that is planned for.
    Wide,
}

/// Clearances, millimetres.
#[derive(Clone, Copy, Debug)]
pub struct Clearance {
    /// To the fence.
    pub fence: f64,
    /// To things on the map, as planned for.
    pub wide: f64,
    /// To things on the map, the least with which the body fits through.
    pub narrow: f64,
}

type Cell = (u16, u16);

impl Grid {
    /// Opens the cells with a centre that keeps clear of the fence and of everything on the map.
    pub fn new(fence: &Geofence, map: &[Extent], clearance: Clearance) -> Grid {
        let (low, high) = extent(fence.corners());
        let side = (high.0 - low.0).max(high.1 - low.1);
        let cell = CELL_MM.max(side / f64::from(MAX_SIDE - 1));
        let cells = |length: f64| (libm::ceil(length / cell) as u16).clamp(1, MAX_SIDE);
        let (width, height) = (cells(high.0 - low.0), cells(high.1 - low.1));
        let (map, narrow) = (Arc::from(map), clearance.narrow);
        let mut grid = Grid { origin: low, cell, width, height, room: Arc::from([]), map, narrow };
        let all = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let keeps_clear = |place: Point| if fence.keeps(place, clearance.fence) { Room::Wide } else { Room::Closed };
        let mut room: Vec<Room> = all.map(|cell| keeps_clear(grid.centre(cell))).collect();
        for thing in Arc::clone(&grid.map).iter() {
            for cell in grid.cells_within(thing.at, thing.radius() + clearance.wide) {
                let distance = thing.distance(grid.centre(cell));
                let left = if distance < clearance.narrow {
                    Room::Closed
                } else if distance < clearance.wide {
                    Room::Narrow
                } else {
                    Room::Wide
                };
                let room = &mut room[grid.index(cell)];
                *room = left.min(*room);
            }
        }
        grid.room = room.into();
        grid
    }

    /// The way from `from` to `to` without its start, around closed cells and `moving` places, as wide as there is one;
    /// `None` where there is none. A start inside a closed place can be left.
    pub fn way(&self, from: Point, to: Point, moving: &[Keepout]) -> Option<Vec<Point>> {
        [Room::Wide, Room::Narrow].into_iter().find_map(|least| self.search(from, to, moving, least))
    }

    fn search(&self, from: Point, to: Point, moving: &[Keepout], least: Room) -> Option<Vec<Point>> {
        if self.clear(from, to, moving, least) {
            return Some(vec![to]);
        }
        let goal = self.cell_of(to);
        let is_occupied = |cell| moving.iter().any(|k| nearer(k.at, self.centre(cell), k.distance(least)));
        let free = |cell: &Cell| self.has_room(*cell, least) && !is_occupied(*cell);
        let next = |cell: &Cell| self.neighbours(*cell).filter(|(cell, _)| free(cell)).collect::<Vec<_>>();
        let out = self.nearest_free(from, free)?;
        let (cells, _) = astar(&out, next, |cell| octile(*cell, goal), |cell| *cell == goal)?;
        let begins_here = out == self.cell_of(from);
        let cells = cells.into_iter().skip(usize::from(begins_here)).map(|cell| self.centre(cell));
        let points: Vec<Point> = std::iter::once(from).chain(cells).chain([to]).collect();
        Some(self.straighten(&points, moving, least))
    }

    /// Cell of a point, or the nearest free one where that is taken and there is one within [`OUT_MM`]; none otherwise.
    fn nearest_free(&self, place: Point, free: impl Fn(&Cell) -> bool) -> Option<Cell> {
        let own_cell = self.cell_of(place);
        let distance_to = |cell: &Cell| distance(self.centre(*cell), place);
        let nearest =
            || self.cells_within(place, OUT_MM).filter(&free).min_by(|a, b| distance_to(a).total_cmp(&distance_to(b)));
        if free(&own_cell) { Some(own_cell) } else { nearest() }
    }

    /// True if one may drive straight from `a` to `b`. Where there is just room, a cell's middle does not speak for the
    /// whole of it.
    fn clear(&self, a: Point, b: Point, moving: &[Keepout], least: Room) -> bool {
        let steps = libm::ceil(distance(a, b) / (self.cell / 2.0)) as u32;
        let open = (1..=steps).all(|i| {
            let share = f64::from(i) / f64::from(steps);
            let place = (a.0 + share * (b.0 - a.0), a.1 + share * (b.1 - a.1));
            let cell = self.cell_of(place);
            self.has_room(cell, least) && (self.has_room(cell, Room::Wide) || self.fits(place))
        });
        open && !moving.iter().any(|k| k.cuts(a, b, least))
    }

    /// True if the body fits through with its middle there.
    fn fits(&self, place: Point) -> bool {
        self.map.iter().all(|thing| thing.distance(place) >= self.narrow)
    }

    /// Leaves out every point that the one before can see past.
    fn straighten(&self, points: &[Point], moving: &[Keepout], least: Room) -> Vec<Point> {
        let mut way = Vec::new();
        let mut index = 0;
        while index + 1 < points.len() {
            let seen = (index + 1..points.len()).rev().find(|i| self.clear(points[index], points[*i], moving, least));
            index = seen.unwrap_or(index + 1);
            way.push(points[index]);
        }
        way
    }

    fn neighbours(&self, (x, y): Cell) -> impl Iterator<Item = (Cell, u32)> {
        let steps = (-1..=1).flat_map(|dy: i16| (-1..=1).map(move |dx: i16| (dx, dy)));
        let (width, height) = (self.width, self.height);
        steps.filter(|step| *step != (0, 0)).filter_map(move |(dx, dy)| {
            let (x, y) = (x.checked_add_signed(dx)?, y.checked_add_signed(dy)?);
            let cost = if dx == 0 || dy == 0 { STRAIGHT } else { DIAGONAL };
            (x < width && y < height).then_some(((x, y), cost))
        })
    }

    fn has_room(&self, cell: Cell, least: Room) -> bool {
        self.room[self.index(cell)] >= least
    }

    fn index(&self, (x, y): Cell) -> usize {
        usize::from(y) * usize::from(self.width) + usize::from(x)
    }

    /// Cells of the square around a point that reaches as far as `reach` on each side.
    fn cells_within(&self, place: Point, reach: f64) -> impl Iterator<Item = Cell> + use<> {
        let (low, high) =
            (self.cell_of((place.0 - reach, place.1 - reach)), self.cell_of((place.0 + reach, place.1 + reach)));
        (low.1..=high.1).flat_map(move |y| (low.0..=high.0).map(move |x| (x, y)))
    }

    /// The cell of a point; one outside the grid belongs to the cell nearest to it.
    fn cell_of(&self, place: Point) -> Cell {
        let index = |n: f64, count: u16| (libm::floor(n / self.cell).max(0.0) as u16).min(count - 1);
        (index(place.0 - self.origin.0, self.width), index(place.1 - self.origin.1, self.height))
    }

    fn centre(&self, (x, y): Cell) -> Point {
        (self.origin.0 + (f64::from(x) + 0.5) * self.cell, self.origin.1 + (f64::from(y) + 0.5) * self.cell)
    }
}

/// Cost of a free way between two cells.
fn octile(a: Cell, b: Cell) -> u32 {
    let (dx, dy) = (u32::from(a.0.abs_diff(b.0)), u32::from(a.1.abs_diff(b.1)));
    STRAIGHT * dx.max(dy) + (DIAGONAL - STRAIGHT) * dx.min(dy)
}

fn extent(points: &[Point]) -> (Point, Point) {
    let empty_bounds = ((f64::MAX, f64::MAX), (f64::MIN, f64::MIN));
    points
        .iter()
        .fold(empty_bounds, |(low, high), p| ((low.0.min(p.0), low.1.min(p.1)), (high.0.max(p.0), high.1.max(p.1))))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn yard() -> Geofence {
        Geofence::new(&[(0, 0), (20_000, 0), (20_000, 20_000), (0, 20_000)])
    }

    const CLEARANCE: Clearance = Clearance { fence: 1500.0, wide: 1500.0, narrow: 750.0 };

    #[test]
    fn way_avoids_obstacles_inside_the_fence() {
        let rock = Extent::around_disc((10_000.0, 10_000.0), 1500.0);
        let grid = Grid::new(&yard(), &[rock], CLEARANCE);
        let (from, to) = ((3000.0, 10_000.0), (17_000.0, 10_000.0));
        let way = grid.way(from, to, &[]).unwrap();
        assert_eq!(way.last(), Some(&to));
        let legs = core::iter::once(from).chain(way.iter().copied()).zip(way.iter().copied());
        for (a, b) in legs {
            assert!(to_segment(rock.at, a, b) > 2000.0, "{a:?} to {b:?}");
        }
        assert!(way.iter().all(|p| yard().clearance(*p) >= 1500.0));
    }

    fn wall(gap: f64) -> [Extent; 2] {
        let half = (10_000.0 - gap / 2.0) / 2.0;
        [half, 20_000.0 - half].map(|north| Extent { at: (10_000.0, north), axis: (1.0, 0.0), half: (200.0, half) })
    }

    #[test]
    fn there_is_no_way_through_a_wall() {
        let way =
            |gap: f64| Grid::new(&yard(), &wall(gap), CLEARANCE).way((3000.0, 10_000.0), (17_000.0, 10_000.0), &[]);
        assert_eq!(way(0.0), None);
        assert_eq!(way(1000.0), None, "the body does not fit");
    }

    #[test]
    fn narrow_gate_is_passed_where_no_way_is_wide() {
        let grid = Grid::new(&yard(), &wall(2600.0), CLEARANCE);
        let way = grid.way((3000.0, 3000.0), (17_000.0, 3000.0), &[]).unwrap();
        let middle = core::iter::once((3000.0, 3000.0)).chain(way.iter().copied()).zip(way.iter().copied());
        let gate = middle.map(|(a, b)| to_segment((10_000.0, 10_000.0), a, b)).fold(f64::MAX, f64::min);
        assert!(gate < 600.0, "{way:?}");
    }
}
