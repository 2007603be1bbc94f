//! Relief of the ground: seeded value noise on a fixed grid, the same on every machine.
//!
//! The grid is a square around the scene, wider than it so that a unit that leaves its fence still has ground
//! under it. Heights between grid points are bilinear here and piecewise triangular in the collider; they differ by
//! millimetres at the slopes a scene may have.

use crate::scene::{Ground, Scene};

/// Least side of the square of ground, metres, centred on the scene.
const SIDE: f32 = 160.0;
/// Ground beyond the outermost place of a scene, metres.
const BEYOND: f32 = 30.0;
/// Side of a cell, metres.
const CELL: f32 = 2.0;

/// Heights on the grid; row-major, rows from south to north, columns from west to east.
#[derive(Clone, Debug)]
pub struct Terrain {
    cells: usize,
    heights: Vec<f32>,
    highest: f32,
}

impl Terrain {
    /// The relief that a scene describes.
    pub fn new(scene: &Scene) -> Self {
        let ground = &scene.ground;
        let half_cells = ((scene.reach() + BEYOND).max(SIDE / 2.0) / CELL).ceil() as usize;
        let cells = 2 * half_cells;
        let n = cells + 1;
        let coordinate = |i: usize| (i as f32 - half_cells as f32) * CELL;
        let heights: Vec<f32> = (0..n * n).map(|k| relief(ground, coordinate(k % n), coordinate(k / n))).collect();
        let highest = heights.iter().copied().fold(f32::MIN, f32::max);
        Terrain { cells, heights, highest }
    }

    /// Cells along one side.
    pub fn cells(&self) -> usize {
        self.cells
    }

    /// Side of the square, metres.
    pub fn side(&self) -> f32 {
        self.cells as f32 * CELL
    }

    /// Height in metres of the grid point `row` from the south and `column` from the west.
    pub fn height_at(&self, row: usize, column: usize) -> f32 {
        self.heights[row * (self.cells + 1) + column]
    }

    /// Height in metres of the highest place.
    pub(crate) fn highest(&self) -> f32 {
        self.highest
    }

    /// Height in metres at a place; beyond the grid, that of its edge.
    pub fn height(&self, east: f32, north: f32) -> f32 {
        let (i, s) = self.cell(north);
        let (j, t) = self.cell(east);
        let south = self.height_at(i, j) + (self.height_at(i, j + 1) - self.height_at(i, j)) * t;
        let north = self.height_at(i + 1, j) + (self.height_at(i + 1, j + 1) - self.height_at(i + 1, j)) * t;
        south + (north - south) * s
    }

    /// Cell index and position inside it, both along one axis.
    fn cell(&self, metres: f32) -> (usize, f32) {
        let scaled = ((metres + self.side() / 2.0) / CELL).clamp(0.0, self.cells as f32 - 0.001);
        let index = scaled as usize;
        (index, scaled - index as f32)
    }
}

fn relief(ground: &Ground, east: f32, north: f32) -> f32 {
    let coarse = smooth(ground.seed, east / ground.wavelength, north / ground.wavelength);
    let fine = smooth(ground.seed ^ 0x5bd1, east * 2.7 / ground.wavelength, north * 2.7 / ground.wavelength);
    ground.amplitude * (0.8 * coarse + 0.2 * fine)
}

/// Value noise in -1..=1 with continuous slope, lattice spacing 1.
pub(crate) fn smooth(seed: u64, x: f32, y: f32) -> f32 {
    let (x0, y0) = (libm::floorf(x), libm::floorf(y));
    let (s, t) = (fade(x - x0), fade(y - y0));
    let corner = |dx: i64, dy: i64| lattice(seed, x0 as i64 + dx, y0 as i64 + dy);
    let south = corner(0, 0) + (corner(1, 0) - corner(0, 0)) * s;
    let north = corner(0, 1) + (corner(1, 1) - corner(0, 1)) * s;
    south + (north - south) * t
}

fn fade(t: f32) -> f32 {
    t * t * (3.0 - 2.0 * t)
}

/// A number in -1..=1 that depends only on its arguments.
pub(crate) fn lattice(seed: u64, x: i64, y: i64) -> f32 {
    let mut h = seed ^ (x as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (y as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
    h = (h ^ (h >> 31)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    h = (h ^ (h >> 29)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (h >> 40) as f32 / 8_388_608.0 - 1.0
}
