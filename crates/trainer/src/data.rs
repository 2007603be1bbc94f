//! The data set: rendered frames, and the grid of targets that the network learns.
//!
//! The grid is that of `perception::grid`: cells of 4 pixels, and in each the objectness, one channel a class, and
//! the box as offset of its middle in cells and logarithm of its sides in units of 16 pixels.

use dataset::cells::{self, Split};
use dataset::example::{Example as Frame, ExampleError, counts};
use perception::grid::{CELL, COLUMNS, ROWS, UNIT};
use sha2::{Digest, Sha256};
use sim::Label;

/// Cells of the grid.
pub(crate) const CELLS: usize = ROWS * COLUMNS;

/// Share of an object's sides whose cells are its own.
const MIDDLE: f32 = 0.4;

/// One frame with what it shows.
pub(crate) struct Example {
    /// Row-major, 3 bytes a pixel.
    pub(crate) rgb: Vec<u8>,
    /// Objects large enough to be found.
    pub(crate) labels: Vec<Label>,
    /// Objects too small to be judged by.
    pub(crate) ignored: Vec<Label>,
}

/// What the network should give for one example, cell by cell.
pub(crate) struct Target {
    /// 1 where an object is.
    pub(crate) object: Vec<f32>,
    /// 0 where nothing is asked.
    pub(crate) asked: Vec<f32>,
    /// Where an object is: one over the root of how many cells it has, so that a near object does not drown a far one.
    pub(crate) weight: Vec<f32>,
    /// Four channels, one hot where an object is.
    pub(crate) class: Vec<f32>,
    /// Four channels: offset right and down in cells, logarithms of width and height in units.
    pub(crate) place: Vec<f32>,
}

/// Frames of what may be learnt from, the cells in turn, with the hash of all that is in them.
pub(crate) fn examples(frames: std::ops::Range<u64>) -> Result<(Vec<Example>, String), ExampleError> {
    let learnt: Vec<_> = cells::all()?.iter().filter(|cell| cell.learnt).collect();
    let (mut hash, mut examples) = (Sha256::new(), Vec::new());
    for k in frames {
        let cell = learnt[k as usize % learnt.len()];
        let frame = Frame::new(cell, Split::Training, k / learnt.len() as u64)?.frame;
        hash.update(&frame.rgb);
        for l in &frame.labels {
            let b = l.bounds;
            let numbers = [l.class as u16, b.x0, b.y0, b.x1, b.y1, l.pixels as u16];
            numbers.iter().for_each(|n| hash.update(n.to_le_bytes()));
        }
        let (labels, ignored) = frame.labels.into_iter().partition(counts);
        examples.push(Example { rgb: frame.rgb, labels, ignored });
    }
    let digest: [u8; 32] = hash.finalize().into();
    Ok((examples, digest.iter().map(|b| format!("{b:02x}")).collect()))
}

/// The grid of targets. A cell belongs to the smallest object whose middle part covers its middle, and in any case to
/// the object whose middle lies in it.
pub(crate) fn target(example: &Example, mirrored: bool) -> Target {
    let mut target = Target {
        object: vec![0.0; CELLS],
        asked: vec![1.0; CELLS],
        weight: vec![0.0; CELLS],
        class: vec![0.0; 4 * CELLS],
        place: vec![0.0; 4 * CELLS],
    };
    for label in &example.ignored {
        cells(label, mirrored, 1.0).for_each(|cell| target.asked[cell] = 0.0);
    }
    let mut labels: Vec<&Label> = example.labels.iter().collect();
    labels.sort_by_key(|l| core::cmp::Reverse(l.pixels));
    for label in &labels {
        cells(label, mirrored, 0.9).for_each(|cell| target.asked[cell] = 0.0);
    }
    for label in labels {
        let [x, y, w, h] = middle(label, mirrored);
        let weight = 1.0 / (cells(label, mirrored, MIDDLE).count() as f32).sqrt();
        for cell in cells(label, mirrored, MIDDLE) {
            (target.object[cell], target.asked[cell], target.weight[cell]) = (1.0, 1.0, weight);
            for class in 0..4 {
                target.class[class * CELLS + cell] = f32::from(u8::from(class == label.class as usize));
            }
            let (column, row) = ((cell % COLUMNS) as f32 + 0.5, (cell / COLUMNS) as f32 + 0.5);
            let place = [x / CELL - column, y / CELL - row, libm::logf(w / UNIT), libm::logf(h / UNIT)];
            place.iter().enumerate().for_each(|(k, v)| target.place[k * CELLS + cell] = *v);
        }
    }
    target
}

/// Middle, width and height in pixels.
fn middle(label: &Label, mirrored: bool) -> [f32; 4] {
    let b = label.bounds;
    let (w, h) = (f32::from(b.x1 - b.x0), f32::from(b.y1 - b.y0));
    let x = f32::from(b.x0) + 0.5 * w;
    [if mirrored { COLUMNS as f32 * CELL - x } else { x }, f32::from(b.y0) + 0.5 * h, w, h]
}

fn cells(label: &Label, mirrored: bool, share: f32) -> impl Iterator<Item = usize> + use<> {
    let [x, y, w, h] = middle(label, mirrored);
    let centre = (y / CELL) as usize * COLUMNS + (x / CELL) as usize;
    (0..CELLS).filter(move |cell| {
        let (column, row) = ((cell % COLUMNS) as f32 + 0.5, (cell / COLUMNS) as f32 + 0.5);
        let inside = (column * CELL - x).abs() <= 0.5 * share * w && (row * CELL - y).abs() <= 0.5 * share * h;
        inside || *cell == centre
    })
}
