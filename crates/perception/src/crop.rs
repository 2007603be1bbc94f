//! Crops of a track from the images of a frame, for the operator.
//!
//! Cut at the camera's own resolution where the track's box fits, else with every few pixels made one. Choosing the
//! track is left to the core.

use wire::codec::List;
use wire::crop::{CAMERAS, Crop, HEIGHT, PIXELS, Pixels, WIDTH};
use wire::id::TrackId;
use wire::sensor::{Frames, PixelBox};

/// Crops of `track`, which is at `bounds` in the images; none of a camera without a reading, or of images that are
/// smaller than a crop.
pub fn crops(frames: &Frames<'_>, track: TrackId, bounds: &PixelBox) -> List<Crop, CAMERAS> {
    let Some(window) = Window::around_box(bounds, (frames.width, frames.height)) else { return List::default() };
    let pixels = window.width * window.height;
    let colour = frames.rgb.filter(|plane| plane.len() == 3 * pixels).map(|plane| window.colour(plane));
    let warmth = frames.thermal.filter(|plane| plane.len() == 2 * pixels).map(|plane| window.warmth(plane));
    let depth = frames.depth.filter(|plane| plane.len() == 2 * pixels).map(|plane| window.depth(plane));
    let crop = |pixels| Crop { track, frame: frames.frame, scale: window.scale as u8, pixels };
    [colour, warmth, depth].into_iter().flatten().map(crop).collect()
}

/// The part of an image that a crop shows.
struct Window {
    left: usize,
    top: usize,
    scale: usize,
    /// Width of the image.
    width: usize,
    height: usize,
}

impl Window {
    /// The smallest around a box, as far as it is inside an image of this size.
    fn around_box(bounds: &PixelBox, size: (u16, u16)) -> Option<Window> {
        let (width, height) = (usize::from(size.0), usize::from(size.1));
        let most = (width / WIDTH).min(height / HEIGHT);
        let [x0, y0, x1, y1] = [bounds.x0, bounds.y0, bounds.x1, bounds.y1].map(usize::from);
        let (wide, high) = (x1.saturating_sub(x0), y1.saturating_sub(y0));
        let scale = wide.div_ceil(WIDTH).max(high.div_ceil(HEIGHT)).clamp(1, most.max(1));
        let start = |low: usize, side: usize, crop: usize, all: usize| {
            (low + side / 2).saturating_sub(scale * crop / 2).min(all - scale * crop)
        };
        (most > 0).then(|| Window {
            left: start(x0, wide, WIDTH, width),
            top: start(y0, high, HEIGHT, height),
            scale,
            width,
            height,
        })
    }

    /// Indices of the image's pixels that make one of the crop.
    fn block(&self, at: usize) -> impl Iterator<Item = usize> + Clone + use<> {
        let (column, row) = (self.left + at % WIDTH * self.scale, self.top + at / WIDTH * self.scale);
        let (scale, width) = (self.scale, self.width);
        (0..scale * scale).map(move |i| (row + i / scale) * width + column + i % scale)
    }

    fn colour(&self, plane: &[u8]) -> Pixels {
        let mut bytes = [0; 2 * PIXELS];
        for (at, two) in bytes.chunks_exact_mut(2).enumerate() {
            let mean = |channel: usize| mean(self.block(at).map(|pixel| u32::from(plane[3 * pixel + channel]))) as u16;
            let packed = mean(0) >> 3 << 11 | mean(1) >> 2 << 5 | mean(2) >> 3;
            two.copy_from_slice(&packed.to_le_bytes());
        }
        Pixels::Colour(bytes.into())
    }

    fn warmth(&self, plane: &[u8]) -> Pixels {
        let means = self.means(plane, |_| true);
        let (least, most) = range(&means);
        Pixels::Warmth(least, most, means.map(|mean| share(mean, (least, most), 255) as u8).into())
    }

    fn depth(&self, plane: &[u8]) -> Pixels {
        let means = self.means(plane, |depth| depth > 0);
        let returns: Vec<u16> = means.iter().copied().filter(|mean| *mean > 0).collect();
        let (least, most) = range(&returns);
        let byte = |mean: u16| if mean == 0 { 0 } else { u8::MAX - share(mean, (least, most), 254) as u8 };
        Pixels::Depth(least, most, means.map(byte).into())
    }

    /// Means of the values that count, zero where none does.
    fn means(&self, plane: &[u8], counts: impl Fn(u32) -> bool) -> [u16; PIXELS] {
        let value = |pixel: usize| u32::from(u16::from_le_bytes([plane[2 * pixel], plane[2 * pixel + 1]]));
        std::array::from_fn(|i| mean(self.block(i).map(value).filter(|value| counts(*value))) as u16)
    }
}

fn mean(values: impl Iterator<Item = u32>) -> u32 {
    let (sum, n) = values.fold((0, 0), |(sum, n), value| (sum + value, n + 1));
    sum / n.max(1)
}

fn range(values: &[u16]) -> (u16, u16) {
    let least = values.iter().copied().min().unwrap_or_default();
    (least, values.iter().copied().max().unwrap_or_default())
}

/// Share, of `whole`, of the way between two values.
fn share(value: u16, (least, most): (u16, u16), whole: u32) -> u32 {
    u32::from(value - least) * whole / u32::from(most - least).max(1)
}

#[cfg(test)]
mod tests {
    use wire::id::FrameId;
    use wire::time::Instant;

    use super::*;

    /// A picture with its column as colour, its row as warmth, and a depth of one metre left of the middle.
    fn cut(bounds: PixelBox) -> List<Crop, CAMERAS> {
        let (width, height) = (160_u16, 120_u16);
        let places = || (0..height).flat_map(|row| (0..width).map(move |column| (row, column)));
        let rgb: Vec<u8> = places().flat_map(|(_, column)| [column as u8, 0, 0]).collect();
        let thermal: Vec<u8> = places().flat_map(|(row, _)| (28_000 + row).to_le_bytes()).collect();
        let depth: Vec<u8> = places().flat_map(|(_, column)| (1_000 * u16::from(column < 80)).to_le_bytes()).collect();
        let (rgb, depth, thermal) = (Some(&rgb[..]), Some(&depth[..]), Some(&thermal[..]));
        let [rgb, depth, thermal] = [rgb, depth, thermal].map(|plane| plane.map(Into::into));
        let frame = Frames { frame: FrameId(3), stamp: Instant(1), width, height, rgb, depth, thermal, lidar: None };
        crops(&frame, TrackId(7), &bounds)
    }

    #[test]
    fn small_boxes_are_cut_pixel_by_pixel() {
        let crops = cut(PixelBox { x0: 70, y0: 50, x1: 90, y1: 60 });
        let Some(Crop { scale: 1, pixels: Pixels::Colour(colour), .. }) = crops.first() else { panic!("{crops:?}") };
        assert_eq!(colour[..2], (68_u16 >> 3 << 11).to_le_bytes());
        let Pixels::Warmth(least, most, warmth) = crops[1].pixels else { panic!("{crops:?}") };
        assert_eq!((least, most, warmth[0], warmth[PIXELS - 1]), (28_046, 28_063, 0, 255));
        let Pixels::Depth(1_000, 1_000, depth) = crops[2].pixels else { panic!("{crops:?}") };
        assert_eq!((depth[11], depth[12]), (255, 0), "a return left of the middle, none right of it");
    }

    /// So it fits into a datagram.
    #[test]
    fn longest_crop_has_887_bytes() {
        let pixels = Pixels::Colour([0; 2 * PIXELS].into());
        let longest = Crop { track: TrackId(u32::MAX), frame: FrameId(u64::MAX), scale: u8::MAX, pixels };
        assert_eq!(wire::codec::encode(&longest).len(), 887);
    }

    #[test]
    fn large_boxes_are_scaled_down() {
        let crops = cut(PixelBox { x0: 0, y0: 0, x1: 160, y1: 120 });
        let Pixels::Colour(colour) = crops[0].pixels else { panic!("{crops:?}") };
        assert_eq!((crops[0].scale, u16::from_le_bytes([colour[0], colour[1]]) >> 11), (6, (8 + 2) >> 3));
    }

    /// At an edge the crop moves inside the image.
    #[test]
    fn boxes_of_any_place_are_cut_whole() {
        for bounds in
            [(0, 0, 1, 1), (159, 119, 160, 120), (150, 0, 200, 300), (60_000, 60_000, 65_535, 65_535), (9, 9, 3, 3)]
        {
            let (x0, y0, x1, y1) = bounds;
            assert_eq!(cut(PixelBox { x0, y0, x1, y1 }).len(), CAMERAS);
        }
    }
}
