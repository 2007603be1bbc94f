//! The thermal stage: warm regions of the thermal image, with place and likeness.
//!
//! Its own small network, of the colour detector's form, looks at three bands of the plane ([`crate::bands`]): warmth
//! above the ground in two spans, and absolute temperature. It knows vehicles and persons by where they are warm, and
//! calls other warm objects obstacles; it does not see objects as cold as the ground. Temperatures are read from the
//! plane itself, and their meaning for a class is left to `corroborate::thermal`.

use wire::codec::List;
use wire::sensor::{Blob, Detection};

use crate::bands::{centikelvin, image};
use crate::detector::Detector;

/// Least score of a reported blob, permille: on tuning frames 0.90 of vehicles and persons were then borne out, and 1
/// of 181 cold fakes (at 300: 0.82, and none).
const LEAST: u16 = 100;
/// Readings beyond these are the sensor's failure, centikelvin.
const PLAUSIBLE: core::ops::RangeInclusive<u16> = 20_000..=64_000;

/// Warm regions in a row-major plane of u16 little-endian centikelvin, surest first. `None` when the plane is not of
/// this size, or the network failed.
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
