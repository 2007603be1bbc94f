//! The data set: rendered frames, and the grid of targets that the network learns.
//!
//! The grid is that of `perception::grid`: cells of 8 pixels, and in each the objectness, one channel a class, and
//! the box as offset of its middle in cells and logarithm of its sides in units of 16 pixels.

use perception::grid::{CELL, COLUMNS, ROWS, UNIT};
use sha2::{Digest, Sha256};
use sim::{Label, Labelled, render};

use crate::scenes::scene;

/// Cells of the grid.
pub(crate) const CELLS: usize = ROWS * COLUMNS;
/// An object smaller than this is neither to be found nor to be missed.
const LEAST: (u16, u16, u32) = (2, 4, 12);

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
    /// Four channels, one hot where an object is.
    pub(crate) class: Vec<f32>,
    /// Four channels: offset right and down in cells, logarithms of width and height in units.
    pub(crate) place: Vec<f32>,
}

/// Renders the examples of these seeds; gives them with the hash of all that is learnt from.
pub(crate) fn examples(seeds: std::ops::Range<u64>) -> Result<(Vec<Example>, String), sim::scene::SceneError> {
    let mut hash = Sha256::new();
    let mut examples = Vec::new();
    for seed in seeds {
        let (scene, start) = scene(seed);
        let frame = render(&scene, start, seed)?;
        hash.update(&frame.rgb);
        for l in &frame.labels {
            let b = l.bounds;
            let numbers = [l.class as u16, b.x0, b.y0, b.x1, b.y1, l.pixels as u16];
            numbers.iter().for_each(|n| hash.update(n.to_le_bytes()));
        }
        examples.push(example(frame));
    }
    let digest: [u8; 32] = hash.finalize().into();
    Ok((examples, digest.iter().map(|b| format!("{b:02x}")).collect()))
}

fn example(frame: Labelled) -> Example {
    let (labels, ignored) = frame.labels.into_iter().partition(findable);
    Example { rgb: frame.rgb, labels, ignored }
}

/// Whether an object shows enough of itself to be asked for.
pub(crate) fn findable(l: &Label) -> bool {
    let b = l.bounds;
    b.x1 - b.x0 >= LEAST.0 && b.y1 - b.y0 >= LEAST.1 && l.pixels >= LEAST.2
}

/// The grid of targets. A cell belongs to the smallest object whose middle half covers its middle, and in any case to
/// the object whose middle lies in it.
pub(crate) fn target(example: &Example, mirrored: bool) -> Target {
    let mut target = Target {
        object: vec![0.0; CELLS],
        asked: vec![1.0; CELLS],
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
        for cell in cells(label, mirrored, 0.5) {
            (target.object[cell], target.asked[cell]) = (1.0, 1.0);
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
