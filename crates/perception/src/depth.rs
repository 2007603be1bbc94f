//! The depth stage: how far away the middle of each colour detection is.

use wire::codec::List;
use wire::sensor::{DepthSample, Detection, PixelBox};

/// Median depth of each detection's central half; a detection without returns there has no sample. `None` when the
/// plane (row-major, u16 little-endian millimetres) is not of this size.
pub fn samples(plane: &[u8], width: u16, height: u16, detections: &[Detection]) -> Option<List<DepthSample, 32>> {
    if plane.len() != 2 * usize::from(width) * usize::from(height) {
        return None;
    }
    let sample = |(index, detection): (usize, &Detection)| {
        let median_mm = median(plane, width, height, &detection.bounds)?;
        Some(DepthSample { detection: index as u8, median_mm })
    };
    Some(detections.iter().enumerate().filter_map(sample).collect())
}

fn median(plane: &[u8], width: u16, height: u16, bounds: &PixelBox) -> Option<u16> {
    let (columns, rows) = (middle(bounds.x0, bounds.x1, width), middle(bounds.y0, bounds.y1, height));
    let mut returns: Vec<u16> = Vec::new();
    for row in rows {
        for column in columns.clone() {
            let index = 2 * (usize::from(row) * usize::from(width) + usize::from(column));
            returns.push(u16::from_le_bytes([plane[index], plane[index + 1]]));
        }
    }
    returns.retain(|mm| *mm > 0);
    let half = returns.len() / 2;
    if returns.is_empty() { None } else { Some(*returns.select_nth_unstable(half).1) }
}

/// The central half of a span, at least one pixel, inside the image.
fn middle(low: u16, high: u16, most: u16) -> core::ops::Range<u16> {
    let quarter = high.saturating_sub(low) / 4;
    let start = (low + quarter).min(most.saturating_sub(1));
    start..high.saturating_sub(quarter).clamp(start + 1, most.max(start + 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use wire::sensor::Class;

    /// Pixels in the outer half of the box do not count either.
    #[test]
    fn median_ignores_pixels_without_return() {
        let mut plane = vec![0u8; 2 * 16 * 12];
        let mut set = |x: usize, y: usize, mm: u16| plane[2 * (y * 16 + x)..][..2].copy_from_slice(&mm.to_le_bytes());
        (4..8).for_each(|x| set(x, 5, 7_000));
        set(2, 5, 1_000);
        let detection = |bounds| Detection { class: Class::Person, score: 900, bounds };
        let nearby = detection(PixelBox { x0: 2, y0: 2, x1: 10, y1: 10 });
        let empty_detection = detection(PixelBox { x0: 11, y0: 0, x1: 16, y1: 3 });
        let found = samples(&plane, 16, 12, &[empty_detection, nearby]).unwrap();
        assert_eq!(found.len(), 1);
        assert_eq!(found[0], DepthSample { detection: 1, median_mm: 7_000 });
    }
}
