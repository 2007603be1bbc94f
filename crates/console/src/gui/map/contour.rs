//! Lines of equal height over a survey of the ground (marching squares, linear within a cell).

use crate::site::{GroundPoint, Relief};

/// Distances between two lines that are chosen from, metres.
const STEPS: [f32; 9] = [0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0];
/// Most lines between the lowest and the highest place.
const LINES: f32 = 8.0;

/// The lines of a survey.
pub(super) struct Contours {
    /// Height between two lines, metres.
    pub(super) step: f32,
    /// Pieces of the lines, each within one cell.
    pub(super) segments: Vec<[GroundPoint; 2]>,
}

/// Lines of a survey; `None` if the survey is empty, flat, or higher than the largest step divides into [`LINES`]
/// lines.
pub(super) fn lines(relief: &Relief) -> Option<Contours> {
    let rows = relief.rows();
    let heights = || rows.iter().flat_map(|row| row.iter().copied());
    let (low, high) = (heights().fold(f32::INFINITY, f32::min), heights().fold(f32::NEG_INFINITY, f32::max));
    let step = STEPS.into_iter().find(|step| (high - low) / step <= LINES)?;
    let levels: Vec<f32> = ((low / step).ceil() as i32..=(high / step).floor() as i32)
        .take(LINES as usize + 1)
        .map(|line| line as f32 * step)
        .collect();
    let mut segments = Vec::new();
    for (row, pair) in rows.windows(2).enumerate() {
        for column in 0..relief.columns - 1 {
            let corners = [pair[0][column], pair[0][column + 1], pair[1][column + 1], pair[1][column]];
            levels.iter().for_each(|level| cell(relief, [column, row], corners, *level, &mut segments));
        }
    }
    (!segments.is_empty()).then_some(Contours { step, segments })
}

/// The pieces of one line in one cell, with corners counter-clockwise from the south-west.
fn cell(relief: &Relief, [column, row]: [usize; 2], corners: [f32; 4], level: f32, into: &mut Vec<[GroundPoint; 2]>) {
    const ROUND: [GroundPoint; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let mut crossings = [[0.0; 2]; 4];
    let mut found = 0;
    for side in 0..4 {
        let (from, to) = (corners[side], corners[(side + 1) % 4]);
        if (from < level) != (to < level) {
            let (a, b, share) = (ROUND[side], ROUND[(side + 1) % 4], (level - from) / (to - from));
            let along = |axis: usize, cell: usize| {
                relief.corner[axis] + relief.cell * (cell as f32 + a[axis] + (b[axis] - a[axis]) * share)
            };
            crossings[found] = [along(0, column), along(1, row)];
            found += 1;
        }
    }
    // None, two, or, on a saddle, four: then the pieces stand beside each other.
    into.extend(crossings[..found].chunks_exact(2).map(|ends| [ends[0], ends[1]]));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn relief(columns: usize, height: impl Fn(usize, usize) -> f32) -> Relief {
        let heights = (0..columns * columns).map(|k| height(k % columns, k / columns)).collect();
        Relief { corner: [-4.0, 2.0], cell: 0.5, columns, heights }
    }

    #[test]
    fn line_points_lie_at_their_height() {
        // A slope to the east: 0.1 m a column.
        let found = lines(&relief(9, |column, _| column as f32 * 0.1 + 0.03)).unwrap();
        assert!((found.step - 0.1).abs() < 1e-6);
        for [x, y] in found.segments.iter().flatten() {
            let height = (x + 4.0) / 0.5 * 0.1 + 0.03;
            assert!((height / found.step - (height / found.step).round()).abs() < 1e-3, "{height}");
            assert!((2.0..=6.0).contains(y));
        }
        // One piece a row and a line: at 0.1 to 0.8 m.
        assert_eq!(found.segments.len(), 8 * 8);
    }

    #[test]
    fn hill_lines_close_and_a_saddle_splits() {
        let hill =
            lines(&relief(17, |c, r| 1.0 - ((c as f32 - 8.0).powi(2) + (r as f32 - 8.0).powi(2)) / 64.0)).unwrap();
        let inner: Vec<_> = hill.segments.iter().flatten().filter(|p| p.iter().all(|x| x.is_finite())).collect();
        assert_eq!(inner.len(), hill.segments.len() * 2);
        let saddle = lines(&relief(2, |c, r| if c == r { 0.0 } else { 0.1 })).unwrap();
        assert!(saddle.segments.len() >= 2);
    }

    #[test]
    fn flat_empty_or_hostile_ground_has_no_lines() {
        assert!(lines(&relief(5, |_, _| 0.31)).is_none());
        for columns in [0, 1, 65, usize::MAX] {
            assert!(lines(&Relief { columns, ..relief(5, |c, _| c as f32) }).is_none());
        }
        for bad in [f32::NAN, f32::INFINITY, -1.0, 0.0] {
            assert!(lines(&Relief { cell: bad, ..relief(5, |c, _| c as f32) }).is_none());
        }
        assert!(lines(&relief(5, |c, r| if c == r { f32::NAN } else { 0.0 })).is_none());
        assert!(lines(&relief(5, |c, r| if c == r { f32::MAX } else { f32::MIN })).is_none());
    }
}
