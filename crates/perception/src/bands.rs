//! Bands of a thermal plane: the image that a network sees of it. Two are of warmth above or below the ground, one is
//! of absolute temperature.

/// Spans of the three bands, of which two are above or below the ground and one is of absolute temperature,
/// centikelvin.
pub const BANDS: [(i32, i32); 3] = [(-2_000, 6_000), (-400, 1_200), (25_000, 35_000)];

/// The image that the network sees in a plane: for each pixel three bytes, how much warmer than the ground it is in two
/// spans, and how warm it is. `None` when the plane is not of this size.
pub fn bands(plane: &[u8], width: u16, height: u16) -> Option<Vec<u8>> {
    Some(image(&centikelvin(plane, width, height)?, usize::from(width)))
}

pub(crate) fn image(kelvin: &[u16], width: usize) -> Vec<u8> {
    let ground = i32::from(median(kelvin, width));
    let byte = |value: i32, (low, high): (i32, i32)| ((value - low).clamp(0, high - low) * 255 / (high - low)) as u8;
    let bands = |k: &u16| {
        let k = i32::from(*k);
        [byte(k - ground, BANDS[0]), byte(k - ground, BANDS[1]), byte(k, BANDS[2])]
    };
    kelvin.iter().flat_map(bands).collect()
}

pub(crate) fn centikelvin(plane: &[u8], width: u16, height: u16) -> Option<Vec<u16>> {
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
        let band = |row: usize, column: usize| &bands[3 * (row * 40 + column)..][..3];
        assert_eq!(band(0, 0), [0, 0, 20], "sky");
        assert_eq!(band(20, 20), [63, 63, 96], "ground");
        assert_eq!(band(15, 5), [102, 255, 127], "12 K warmer");
        assert_eq!(band(15, 6), [255, 255, 249], "60 K warmer");
        assert_eq!(super::bands(&plane[2..], 40, 30), None);
    }
}
