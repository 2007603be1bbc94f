//! Fit of warmth to a detection's class.
//!
//! The thermal stage reports regions warm like a vehicle or like a person; that is believed within bounds of
//! temperature alone: a vehicle shows a warm engine, a person skin and clothes. A decoy and an obstacle are no warmer
//! than their surroundings, or not warm like either. Limits are on the peak as the camera reads it, contrast already
//! faded by distance.

use wire::sensor::{Blob, Class, Detection};

/// Coldest and warmest plausible peak of a vehicle, centikelvin.
const VEHICLE_CK: (u16, u16) = (30_000, 39_000);
/// Coldest and warmest plausible peak of a person, centikelvin.
const PERSON_CK: (u16, u16) = (29_700, 31_300);
/// Shared over united area from which on something warm and a detection are of one object.
const SAME: f32 = 0.3;

/// The thermal stage's verdict on a detection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Warmth {
    /// The stage gave no product.
    Unknown,
    /// A class without warmth, and none there.
    Neutral,
    /// As warm as the class.
    Fits,
    /// No warmth where there should be some: a cold object, or a frame that the stage missed.
    Absent,
    /// Contradiction by a wrong temperature.
    Contradicts,
}

/// Judges `detection` by the warm regions of the frame.
pub fn judge(detection: &Detection, blobs: Option<&[Blob]>) -> Warmth {
    let Some(blobs) = blobs else { return Warmth::Unknown };
    let own_blobs = || blobs.iter().filter(|blob| blob.bounds.shared(&detection.bounds) >= SAME);
    let warm = |blob: &Blob| match blob.class {
        Class::Vehicle => (VEHICLE_CK.0..=VEHICLE_CK.1).contains(&blob.peak_ck),
        Class::Person => (PERSON_CK.0..=PERSON_CK.1).contains(&blob.peak_ck),
        Class::Decoy | Class::Obstacle => false,
    };
    match detection.class {
        class @ (Class::Vehicle | Class::Person) => {
            if own_blobs().any(|blob| blob.class == class && warm(blob)) {
                Warmth::Fits
            } else if own_blobs().next().is_none() {
                Warmth::Absent
            } else {
                Warmth::Contradicts
            }
        }
        Class::Decoy | Class::Obstacle => {
            if own_blobs().any(warm) {
                Warmth::Contradicts
            } else {
                Warmth::Neutral
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use wire::sensor::PixelBox;

    use super::*;

    fn blob(class: Class, peak_ck: u16, left: u16) -> Blob {
        let bounds = PixelBox { x0: left, y0: 50, x1: left + 20, y1: 60 };
        Blob { bounds, mean_ck: peak_ck - 300, peak_ck, class, score: 800 }
    }

    #[test]
    fn vehicle_needs_vehicle_like_warmth_in_place() {
        let bounds = PixelBox { x0: 40, y0: 50, x1: 60, y1: 60 };
        let claim = |class, blob| judge(&Detection { class, score: 900, bounds }, Some(&[blob]));
        assert_eq!(claim(Class::Vehicle, blob(Class::Vehicle, 31_800, 42)), Warmth::Fits);
        assert_eq!(claim(Class::Vehicle, blob(Class::Vehicle, 31_800, 55)), Warmth::Absent, "beside it");
        assert_eq!(claim(Class::Vehicle, blob(Class::Obstacle, 31_800, 42)), Warmth::Contradicts, "merely warm");
        assert_eq!(claim(Class::Vehicle, blob(Class::Person, 30_500, 42)), Warmth::Contradicts, "somebody before it");
        assert_eq!(claim(Class::Vehicle, blob(Class::Vehicle, 45_000, 42)), Warmth::Contradicts, "on fire");
        assert_eq!(
            claim(Class::Decoy, blob(Class::Obstacle, 31_800, 42)),
            Warmth::Neutral,
            "a heated decoy is one still"
        );
        assert_eq!(claim(Class::Decoy, blob(Class::Vehicle, 31_800, 42)), Warmth::Contradicts);
        assert_eq!(judge(&Detection { class: Class::Vehicle, score: 900, bounds }, None), Warmth::Unknown);
    }
}
