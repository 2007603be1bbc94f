//! Perturbation of every colour image between the camera and its readers.
//!
//! One pattern, the same in each image: a universal adversarial perturbation (Moosavi-Dezfooli et al. 2017), as a sticker on the
//! lens or a tampered driver may add it. Its fields are wider than a pixel, so that a scenario can carry them. Its times are a
//! fault's business (`fault`); its maker and purpose are unknown here.

use serde::{Deserialize, Serialize};

/// Rows of fields, from the top.
pub const ROWS: usize = 30;
/// Fields in a row.
pub const COLUMNS: usize = 40;

/// A pattern over the whole image.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Perturbation {
    /// Row-major shifts of red, green and blue.
    fields: Vec<[i8; 3]>,
}

impl Perturbation {
    /// Fields, row-major; `None` unless there are [`ROWS`] × [`COLUMNS`].
    pub fn new(fields: Vec<[i8; 3]>) -> Option<Self> {
        (fields.len() == ROWS * COLUMNS).then_some(Perturbation { fields })
    }

    /// Row-major shifts of red, green and blue.
    pub fn fields(&self) -> &[[i8; 3]] {
        &self.fields
    }

    /// Adds it to a plane of 3 bytes a pixel, row-major with `width` pixels in a row, no byte by more than `strength`. Overflow is
    /// cut off.
    pub fn add(&self, strength: u8, width: usize, plane: &mut [u8]) {
        let most = i16::from(strength);
        let height = plane.len() / (3 * width).max(1);
        for (at, pixel) in plane.chunks_exact_mut(3).enumerate() {
            // None beyond the last, which a scene that was not checked might lack.
            let Some(field) = self.fields.get(field(at, width, height)) else { continue };
            for (byte, shift) in pixel.iter_mut().zip(field) {
                *byte = byte.saturating_add_signed(i16::from(*shift).clamp(-most, most).clamp(-128, 127) as i8);
            }
        }
    }
}

/// The field that a pixel lies in, by its place in an image of `width` by `height` pixels, neither of them 0.
pub fn field(at: usize, width: usize, height: usize) -> usize {
    (at / width * ROWS / height) * COLUMNS + at % width * COLUMNS / width
}

#[cfg(test)]
mod tests {
    use super::*;

    /// It is cut off at black and white.
    #[test]
    fn perturbation_shifts_fields_within_its_strength() {
        let mut fields = vec![[0; 3]; ROWS * COLUMNS];
        (fields[0], fields[1], fields[ROWS * COLUMNS - 1]) = ([127, -128, 5], [9; 3], [-5; 3]);
        let pattern = Perturbation::new(fields).unwrap();
        let (width, height) = (4 * COLUMNS, 4 * ROWS);
        let mut plane = vec![3; 3 * width * height];
        plane[0] = 250;
        pattern.add(8, width, &mut plane);
        assert_eq!(plane[..6], [255, 0, 8, 11, 0, 8]);
        assert_eq!(plane[3 * 4..][..3], [11; 3]);
        assert_eq!(plane[3 * width * height - 1], 0);
        assert_eq!(plane.iter().filter(|byte| **byte != 3).count(), 3 * 3 * 16);
        assert_eq!(Perturbation::new(vec![[0; 3]; 5]), None);
    }
}
