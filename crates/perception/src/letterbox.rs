//! The camera's image within a model's: scaled evenly, in the middle, the rest grey; and the way back for boxes.

use ndarray::Array4;

/// Width of the camera's image, pixels.
pub const WIDTH: usize = 160;
/// Height of the camera's image, pixels.
pub const HEIGHT: usize = 120;
/// Smallest and largest side of a model's image, pixels.
pub const SIDES: std::ops::RangeInclusive<usize> = 32..=640;
/// The grey around the image: the one that the common exporters train with.
const GREY: f32 = 114.0 / 255.0;

/// Place of the camera's image within a model's.
#[derive(Clone, Debug)]
pub struct Letterbox {
    scale: f32,
    left: usize,
    top: usize,
    rows: Vec<Option<Tap>>,
    columns: Vec<Option<Tap>>,
}

/// The two pixels of the camera that lie around a pixel of the model, and the second one's share.
#[derive(Clone, Copy, Debug)]
struct Tap(usize, usize, f32);

impl Letterbox {
    /// Letterbox for an image of `height` by `width` pixels; `None` where a side is outside [`SIDES`].
    pub fn new(height: usize, width: usize) -> Option<Self> {
        if !SIDES.contains(&height) || !SIDES.contains(&width) {
            return None;
        }
        let scale = (width as f32 / WIDTH as f32).min(height as f32 / HEIGHT as f32);
        let (left, columns) = taps(width, WIDTH, scale);
        let (top, rows) = taps(height, HEIGHT, scale);
        Some(Letterbox { scale, left, top, rows, columns })
    }

    /// True if the model sees the camera's image as it is.
    pub fn is_plain(&self) -> bool {
        self.rows.len() == HEIGHT && self.columns.len() == WIDTH
    }

    /// Planes in 0..1, from a row-major image of the camera's size with a byte a plane of each pixel, such as RGB.
    pub(crate) fn tensor(&self, image: &[u8]) -> Array4<f32> {
        let planes = image.len() / (HEIGHT * WIDTH);
        let byte = |channel: usize, y: usize, x: usize| f32::from(image[planes * (y * WIDTH + x) + channel]) / 255.0;
        if self.is_plain() {
            return Array4::from_shape_fn((1, planes, HEIGHT, WIDTH), |(_, channel, row, column)| {
                byte(channel, row, column)
            });
        }
        let value = |(_, channel, row, column): (usize, usize, usize, usize)| {
            let (Some(Tap(y0, y1, v)), Some(Tap(x0, x1, u))) = (self.rows[row], self.columns[column]) else {
                return GREY;
            };
            let along = |y: usize| byte(channel, y, x0) * (1.0 - u) + byte(channel, y, x1) * u;
            along(y0) * (1.0 - v) + along(y1) * v
        };
        Array4::from_shape_fn((1, planes, self.rows.len(), self.columns.len()), value)
    }

    /// Left, top, right and bottom in the camera's image of a box that a model placed by middle and sides in its own,
    /// cut to the image.
    pub(crate) fn undo(&self, [x, y, w, h]: [f32; 4]) -> [f32; 4] {
        let across = |v: f32| ((v - self.left as f32) / self.scale).clamp(0.0, WIDTH as f32);
        let down = |v: f32| ((v - self.top as f32) / self.scale).clamp(0.0, HEIGHT as f32);
        [across(x - 0.5 * w), down(y - 0.5 * h), across(x + 0.5 * w), down(y + 0.5 * h)]
    }
}

/// Start of the image along one side, and for each pixel of the model its source pixels.
fn taps(side: usize, camera: usize, scale: f32) -> (usize, Vec<Option<Tap>>) {
    let shown = ((camera as f32 * scale + 0.5) as usize).min(side);
    let first = (side - shown) / 2;
    let tap = |k: usize| {
        let from = ((k as f32 + 0.5) / scale - 0.5).clamp(0.0, (camera - 1) as f32);
        let low = from as usize;
        Tap(low, (low + 1).min(camera - 1), from - low as f32)
    };
    (first, (0..side).map(|k| k.checked_sub(first).filter(|k| *k < shown).map(tap)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(value: impl Fn(usize, usize) -> u8) -> Vec<u8> {
        (0..HEIGHT * WIDTH).flat_map(|k| [value(k / WIDTH, k % WIDTH), 0, 255]).collect()
    }

    #[test]
    fn camera_sized_image_is_passed_on_unchanged() {
        let letterbox = Letterbox::new(HEIGHT, WIDTH).unwrap();
        let rgb = image(|row, column| (row * 7 + column * 3) as u8);
        let tensor = letterbox.tensor(&rgb);
        assert!(letterbox.is_plain());
        for (row, column) in [(0, 0), (57, 91), (119, 159)] {
            for channel in 0..3 {
                let byte = rgb[3 * (row * WIDTH + column) + channel];
                assert_eq!(tensor[(0, channel, row, column)], f32::from(byte) / 255.0);
            }
        }
    }

    #[test]
    fn drawn_marks_return_for_every_model_size() {
        for (height, width) in [(128, 160), (320, 320), (640, 640), (96, 64), (32, 640)] {
            let letterbox = Letterbox::new(height, width).unwrap();
            let tensor =
                letterbox.tensor(&image(
                    |row, column| {
                        if (40..80).contains(&row) && (20..100).contains(&column) { 255 } else { 0 }
                    },
                ));
            // Blue is everywhere in the image, so pixels that are red and blue are the square.
            let red = |row, column| tensor[(0, 0, row, column)] > 0.5 && tensor[(0, 2, row, column)] > 0.9;
            let rows: Vec<usize> = (0..height).filter(|row| (0..width).any(|column| red(*row, column))).collect();
            let columns: Vec<usize> = (0..width).filter(|column| (0..height).any(|row| red(row, *column))).collect();
            let ends = |indices: &[usize]| (indices[0] as f32, indices[indices.len() - 1] as f32 + 1.0);
            let ((top, bottom), (left, right)) = (ends(&rows), ends(&columns));
            let found = letterbox.undo([(left + right) / 2.0, (top + bottom) / 2.0, right - left, bottom - top]);
            // A pixel of a small model covers several of the camera.
            let slack = (1.0 / letterbox.scale).max(0.5);
            for (got, want) in found.iter().zip([20.0, 40.0, 100.0, 80.0]) {
                assert!((got - want).abs() <= slack, "{height}x{width}: {found:?}");
            }
        }
    }

    /// Sides beyond the bounds are refused.
    #[test]
    fn area_beside_the_image_is_grey() {
        let letterbox = Letterbox::new(160, 160).unwrap();
        let tensor = letterbox.tensor(&image(|_, _| 255));
        assert_eq!((tensor[(0, 0, 19, 80)], tensor[(0, 0, 20, 80)]), (GREY, 1.0));
        assert_eq!((tensor[(0, 0, 139, 80)], tensor[(0, 0, 140, 80)]), (1.0, GREY));
        assert!(Letterbox::new(31, 160).is_none() && Letterbox::new(120, 641).is_none());
    }
}
