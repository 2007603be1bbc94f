//! Whether warmth fits a detection's class.
//!
//! A vehicle shows a warm engine, a person the temperature of skin and clothes; a decoy and an obstacle are no warmer
//! than their surroundings. Limits are on a blob's peak as the camera reads it, contrast already faded by distance.

use wire::sensor::{Blob, Class, Detection, PixelBox};

/// Coldest and warmest plausible peak of a vehicle, centikelvin.
const VEHICLE_CK: (u16, u16) = (30_000, 39_000);
/// Coldest and warmest plausible peak of a person, centikelvin.
const PERSON_CK: (u16, u16) = (29_700, 31_300);
/// Slack around a detection when a blob's middle is looked for in it, pixels.
const SLACK_PX: u16 = 2;

/// What the thermal stage says about a detection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Warmth {
    /// The stage gave no product.
    Unknown,
    /// A class without warmth, and none there.
    Neutral,
    /// As warm as its class.
    Fits,
    /// Cold where it should be warm, or of a wrong temperature.
    Contradicts,
}

/// Judges `detection` by the frame's warm regions.
pub fn judge(detection: &Detection, blobs: Option<&[Blob]>) -> Warmth {
    let Some(blobs) = blobs else { return Warmth::Unknown };
    let expected = match detection.class {
        Class::Vehicle => Some(VEHICLE_CK),
        Class::Person => Some(PERSON_CK),
        Class::Decoy | Class::Obstacle => None,
    };
    let own = blobs.iter().filter(|b| match expected {
        Some(_) => belongs(&b.bounds, &detection.bounds),
        None => fills(&b.bounds, &detection.bounds),
    });
    let own = own.max_by_key(|b| (b.bounds.overlap(&detection.bounds), b.peak_ck));
    match (expected, own) {
        (None, None) => Warmth::Neutral,
        (None, Some(blob)) if blob.peak_ck < PERSON_CK.0 => Warmth::Neutral,
        (Some((low, high)), Some(blob)) if (low..=high).contains(&blob.peak_ck) => Warmth::Fits,
        (None | Some(_), Some(_)) | (Some(_), None) => Warmth::Contradicts,
    }
}

/// A blob belongs to a detection that holds its middle, or half of the smaller of the two boxes.
fn belongs(blob: &PixelBox, detection: &PixelBox) -> bool {
    let (x, y) = ((blob.x0 + blob.x1) / 2, (blob.y0 + blob.y1) / 2);
    let middle = x + SLACK_PX >= detection.x0
        && x <= detection.x1.saturating_add(SLACK_PX)
        && y + SLACK_PX >= detection.y0
        && y <= detection.y1.saturating_add(SLACK_PX);
    let shared = blob.overlap(detection);
    shared > 0 && (middle || 2 * shared >= blob.area().min(detection.area()))
}

/// What is warm behind a cold object, or before a part of it, does not make it warm.
fn fills(blob: &PixelBox, detection: &PixelBox) -> bool {
    2 * blob.overlap(detection) >= detection.area()
}
