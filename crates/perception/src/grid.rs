//! The grid of the detector's output, and how its raw numbers become detections.
//!
//! The network gives `[1, 9, 30, 40]`: for each cell of 4 × 4 pixels the objectness and one number a class (both
//! logits), the offset of the box's middle from the cell's in cells, and the logarithms of its sides in units of 16
//! pixels. The trainer encodes with the same constants.

use wire::codec::List;
use wire::sensor::{Class, Detection};

use crate::boxes::{Candidate, best};
use crate::letterbox::{HEIGHT, WIDTH};

/// Side of a cell, pixels.
pub const CELL: f32 = 4.0;
/// Cells in a row.
pub const COLUMNS: usize = 40;
/// Rows of cells.
pub const ROWS: usize = 30;
/// Unit of a box's sides, pixels.
pub const UNIT: f32 = 16.0;
/// Numbers for each cell.
pub const CHANNELS: usize = 9;
/// Number of cells.
const CELLS: usize = COLUMNS * ROWS;
/// Detections of at least `least` permille, best first, without doubles. `raw` is channel-major, [`CHANNELS`] × cells.
pub fn decode(raw: &[f32], least: u16) -> List<Detection, 32> {
    best((0..CELLS).filter_map(|cell| candidate(raw, cell, f32::from(least) / 1000.0)).collect())
}

fn candidate(raw: &[f32], cell: usize, least: f32) -> Option<Candidate> {
    let channel = |c: usize| raw.get(c * CELLS + cell).copied().filter(|v| v.is_finite());
    let object = probability(channel(0)?);
    if object < least {
        return None;
    }
    let logits = [channel(1)?, channel(2)?, channel(3)?, channel(4)?];
    let likeliest = Class::ALL.into_iter().max_by(|a, b| logits[*a as usize].total_cmp(&logits[*b as usize]))?;
    let total: f32 = logits.iter().map(|l| libm::expf(l - logits[likeliest as usize])).sum();
    // A class that is hardly more likely than the next halves the score at most.
    let score = object * (0.5 + 0.5 / total);
    let x = (channel(5)? + (cell % COLUMNS) as f32 + 0.5) * CELL;
    let y = (channel(6)? + (cell / COLUMNS) as f32 + 0.5) * CELL;
    let side = |log: f32, most: usize| (UNIT * libm::expf(log.min(4.0))).min(most as f32);
    let (w, h) = (side(channel(7)?, WIDTH), side(channel(8)?, HEIGHT));
    let edges = [x - 0.5 * w, y - 0.5 * h, x + 0.5 * w, y + 0.5 * h];
    (score >= least).then_some(Candidate { class: likeliest, score, edges })
}

fn probability(logit: f32) -> f32 {
    1.0 / (1.0 + libm::expf(-logit))
}

#[cfg(test)]
mod tests {
    use wire::sensor::PixelBox;

    use super::*;

    fn raw(cells: &[(usize, [f32; CHANNELS])]) -> Vec<f32> {
        let mut raw = vec![0.0; CHANNELS * CELLS];
        raw[..CELLS].fill(-9.0);
        for (cell, values) in cells {
            values.iter().enumerate().for_each(|(c, v)| raw[c * CELLS + cell] = *v);
        }
        raw
    }

    #[test]
    fn neighbouring_cells_of_one_object_merge() {
        let cell = 15 * COLUMNS + 20;
        let row = [4.0, 0.0, 6.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let next_row = [3.0, 0.0, 6.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0];
        let found = decode(&raw(&[(cell, row), (cell + 1, next_row)]), 350);
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].class, Class::Person);
        assert_eq!(found[0].bounds, PixelBox { x0: 74, y0: 54, x1: 90, y1: 70 });
    }

    #[test]
    fn numbers_that_are_not_finite_give_nothing() {
        let mut bad = raw(&[]);
        bad.fill(f32::NAN);
        assert!(decode(&bad, 350).is_empty());
        assert!(decode(&raw(&[(5, [f32::INFINITY; CHANNELS])]), 350).is_empty());
    }
}
