//! The thermal stage: warm regions of the thermal image, by threshold over the scene's own median and by connection.
//!
//! What a temperature means for a class is left to `corroborate::thermal`.

use wire::codec::List;
use wire::sensor::{Blob, PixelBox};

/// How much warmer than the scene's median a pixel must be, centikelvin.
const ABOVE: u16 = 400;
/// Fewest pixels of a region.
const FEWEST: usize = 4;
/// A region larger than this share of the image is not an object.
const LARGEST: f32 = 0.7;
/// Readings beyond these are the sensor's failure, centikelvin.
const PLAUSIBLE: core::ops::RangeInclusive<u16> = 20_000..=64_000;

/// Warm regions of a row-major plane of u16 little-endian centikelvin, largest first. `None` when the plane is not of
/// this size.
pub fn blobs(plane: &[u8], width: u16, height: u16) -> Option<List<Blob, 32>> {
    let (width, height) = (usize::from(width), usize::from(height));
    if plane.len() != 2 * width * height || plane.is_empty() {
        return None;
    }
    let kelvin: Vec<u16> = plane.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
    let threshold = median(&kelvin, width).saturating_add(ABOVE);
    let mut warm: Vec<bool> = kelvin.iter().map(|k| *k >= threshold && PLAUSIBLE.contains(k)).collect();
    let mut regions: Vec<Region> = (0..kelvin.len()).filter_map(|at| region(&kelvin, &mut warm, width, at)).collect();
    let most = (LARGEST * kelvin.len() as f32) as usize;
    regions.retain(|r| (FEWEST..=most).contains(&r.pixels));
    regions.sort_by_key(|r| core::cmp::Reverse(r.pixels));
    Some(regions.iter().map(Region::blob).collect())
}

/// Median of the lower half, where there is ground rather than sky.
fn median(kelvin: &[u16], width: usize) -> u16 {
    let rows = kelvin.len() / width;
    let mut lower: Vec<u16> = kelvin[rows / 2 * width..].to_vec();
    let middle = lower.len() / 2;
    *lower.select_nth_unstable(middle).1
}

struct Region {
    low: [usize; 2],
    high: [usize; 2],
    pixels: usize,
    sum: u64,
    peak: u16,
}

impl Region {
    fn blob(&self) -> Blob {
        let [x0, y0] = self.low.map(|v| v as u16);
        let [x1, y1] = self.high.map(|v| v as u16 + 1);
        let mean_ck = (self.sum / self.pixels.max(1) as u64) as u16;
        Blob { bounds: PixelBox { x0, y0, x1, y1 }, mean_ck, peak_ck: self.peak }
    }
}

/// The region connected to `start`, if that is warm and not taken yet. Takes it.
fn region(kelvin: &[u16], warm: &mut [bool], width: usize, start: usize) -> Option<Region> {
    if !warm[start] {
        return None;
    }
    warm[start] = false;
    let mut region = Region { low: [usize::MAX; 2], high: [0; 2], pixels: 0, sum: 0, peak: 0 };
    let mut open = vec![start];
    while let Some(at) = open.pop() {
        let (x, y) = (at % width, at / width);
        region.low = [region.low[0].min(x), region.low[1].min(y)];
        region.high = [region.high[0].max(x), region.high[1].max(y)];
        region.pixels += 1;
        region.sum += u64::from(kelvin[at]);
        region.peak = region.peak.max(kelvin[at]);
        let beside =
            [(x > 0).then(|| at - 1), (x + 1 < width).then_some(at + 1), at.checked_sub(width), Some(at + width)];
        for next in beside.into_iter().flatten() {
            if warm.get(next).copied().unwrap_or(false) {
                warm[next] = false;
                open.push(next);
            }
        }
    }
    Some(region)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_warm_patches_on_cool_ground_are_two_blobs_and_the_sky_is_none() {
        let (width, height) = (40usize, 30usize);
        let mut kelvin = vec![28_800u16; width * height];
        kelvin[..10 * width].fill(25_800);
        for (x, y, k) in [(5, 15, 30_500), (6, 15, 30_600), (5, 16, 30_400), (6, 16, 30_500)] {
            kelvin[y * width + x] = k;
        }
        (20..26).for_each(|x| kelvin[12 * width + x] = 31_500);
        let plane: Vec<u8> = kelvin.iter().flat_map(|k| k.to_le_bytes()).collect();
        let found = blobs(&plane, 40, 30).unwrap();
        assert_eq!(found.len(), 2);
        assert_eq!((found[0].bounds, found[0].peak_ck), (PixelBox { x0: 20, y0: 12, x1: 26, y1: 13 }, 31_500));
        assert_eq!((found[1].mean_ck, found[1].peak_ck), (30_500, 30_600));
        assert_eq!(blobs(&plane[2..], 40, 30), None);
    }
}
