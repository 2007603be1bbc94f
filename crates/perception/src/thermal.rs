//! The thermal stage: warm regions of the thermal image, with place and likeness.
//!
//! A small network of its own, of the colour detector's form, looks at three bands of the plane ([`bands`]): warmth above the
//! ground in two spans, and absolute temperature. It knows vehicles and persons by where they are warm, and calls other warm
//! objects obstacles; it does not see objects as cold as the ground. Temperatures are read from the plane itself, and their
//! meaning for a class is left to `corroborate::thermal`.

use wire::codec::List;
use wire::sensor::{Blob, Detection};

use crate::detector::Detector;

/// Least score of a reported blob, permille: on tuning frames 0.90 of vehicles and persons were then borne out, and 1 of 181
/// cold fakes (at 300: 0.82, and none).
const LEAST: u16 = 100;
/// Readings beyond these are the sensor's failure, centikelvin.
const PLAUSIBLE: core::ops::RangeInclusive<u16> = 20_000..=64_000;

/// Warm regions in a row-major plane of u16 little-endian centikelvin, surest first. `None` when the plane is not of this size,
/// or the network failed.
pub fn blobs(network: &Detector, plane: &[u8], width: u16, height: u16) -> Option<List<Blob, 32>> {
    let kelvin = centikelvin(plane, width, height)?;
    let found = network.detect(&image(&kelvin, usize::from(width)), LEAST).ok()?;
    Some(found.iter().filter_map(|detection| blob(&kelvin, usize::from(width), detection)).collect())
}

/// Temperatures inside a detection; `None` if none of them is plausible.
fn blob(kelvin: &[u16], width: usize, detection: &Detection) -> Option<Blob> {
    let Detection { class, score, bounds } = *detection;
    let [x0, x1, y0, y1] = [bounds.x0, bounds.x1, bounds.y0, bounds.y1].map(usize::from);
    let rows = kelvin.chunks_exact(width).take(y1).skip(y0);
    let inside = rows.flat_map(|row| row.iter().take(x1).skip(x0)).filter(|k| PLAUSIBLE.contains(k));
    let (mut sum, mut count, mut peak) = (0u64, 0u64, 0u16);
    for k in inside {
        (sum, count, peak) = (sum + u64::from(*k), count + 1, peak.max(*k));
    }
    let mean_ck = sum.checked_div(count)? as u16;
    Some(Blob { bounds, mean_ck, peak_ck: peak, class, score })
}

/// Spans of the three bands, of which two are above or below the ground and one is of absolute temperature, centikelvin.
pub const BANDS: [(i32, i32); 3] = [(-2_000, 6_000), (-400, 1_200), (25_000, 35_000)];

/// The image that the network sees in a plane: for each pixel three bytes, how much warmer than the ground it is in two spans,
/// and how warm it is. `None` when the plane is not of this size.
pub fn bands(plane: &[u8], width: u16, height: u16) -> Option<Vec<u8>> {
    Some(image(&centikelvin(plane, width, height)?, usize::from(width)))
}

fn image(kelvin: &[u16], width: usize) -> Vec<u8> {
    let ground = i32::from(median(kelvin, width));
    let byte = |value: i32, (low, high): (i32, i32)| ((value - low).clamp(0, high - low) * 255 / (high - low)) as u8;
    let bands = |k: &u16| {
        let k = i32::from(*k);
        [byte(k - ground, BANDS[0]), byte(k - ground, BANDS[1]), byte(k, BANDS[2])]
    };
    kelvin.iter().flat_map(bands).collect()
}

fn centikelvin(plane: &[u8], width: u16, height: u16) -> Option<Vec<u16>> {
    let sized = plane.len() == 2 * usize::from(width) * usize::from(height) && !plane.is_empty();
    sized.then(|| plane.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect())
}

/// Median of the lower half, where there is ground rather than sky.
fn median(kelvin: &[u16], width: usize) -> u16 {
    let rows = kelvin.len() / width;
    let mut lower: Vec<u16> = kelvin[rows / 2 * width..].to_vec();
    let middle = lower.len() / 2;
    *lower.select_nth_unstable(middle).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_give_relative_and_absolute_warmth() {
        let mut kelvin = vec![28_800u16; 40 * 30];
        kelvin[..10 * 40].fill(25_800);
        (kelvin[15 * 40 + 5], kelvin[15 * 40 + 6]) = (30_000, 34_800);
        let plane: Vec<u8> = kelvin.iter().flat_map(|k| k.to_le_bytes()).collect();
        let bands = bands(&plane, 40, 30).unwrap();
        let at = |row: usize, column: usize| &bands[3 * (row * 40 + column)..][..3];
        assert_eq!(at(0, 0), [0, 0, 20], "sky");
        assert_eq!(at(20, 20), [63, 63, 96], "ground");
        assert_eq!(at(15, 5), [102, 255, 127], "12 K warmer");
        assert_eq!(at(15, 6), [255, 255, 249], "60 K warmer");
        assert_eq!(super::bands(&plane[2..], 40, 30), None);
    }
}
