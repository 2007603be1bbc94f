//! Detection over all the cameras at once: the image of the fused network, and its disputes with the colour detector.
//!
//! The three cameras share one view, so the network sees colour, bands of warmth and nearness pixel by pixel, and
//! proposes by whichever shows an object. Colour is deceived more cheaply than the others together, and is blind at
//! night and in fog: so its detector's silence is no objection, another class at the same place is one, and its own
//! claim that the network does not share is reported and not believed. Thermal, depth and LiDAR judge each claim
//! afterwards, in [`crate::corroborate`].

use wire::codec::List;
use wire::sensor::{Detection, Frames};

use crate::bands;

/// Planes: three of colour, three of warmth ([`bands::bands`]), one of nearness.
pub const PLANES: usize = 7;

/// Depths at which nearness is 1 and at which it ends, millimetres; even in their logarithm between.
const NEAREST_MM: f32 = 1_000.0;
const FARTHEST_MM: f32 = 60_000.0;

/// Colour detections from this score on can dispute a proposal, permille.
pub const SAY: u16 = 300;
/// Shared over united area from which on a proposal and a colour detection are of one object.
const SAME: f32 = 0.45;

/// Detections of a frame that are disputed, by their index, one bit each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Disputed(u32);

impl Disputed {
    /// True if the detection with this index is disputed.
    pub fn contains(self, index: usize) -> bool {
        u32::try_from(index).ok().and_then(|index| self.0.checked_shr(index)).is_some_and(|bits| bits & 1 == 1)
    }

    fn with_index(self, index: usize) -> Self {
        Disputed(self.0 | 1_u32.checked_shl(index as u32).unwrap_or(0))
    }
}

/// All that is claimed in a frame: the network's proposals, best first, and behind them claims of the colour detector
/// that it does not share. Those are disputed, and so is a proposal where the colour detector names another class;
/// silence of the colour detector is no dispute. `seen` are its detections of at least [`SAY`], of which those below
/// `least` are no claims.
pub fn claims(proposed: &[Detection], seen: &[Detection], least: u16) -> (List<Detection, 32>, Disputed) {
    let same = |a: &Detection, b: &Detection| a.bounds.shared(&b.bounds) >= SAME;
    let answer = |proposal: &Detection| {
        let detections = seen.iter().filter(|other| same(other, proposal));
        detections.max_by(|a, b| a.bounds.shared(&proposal.bounds).total_cmp(&b.bounds.shared(&proposal.bounds)))
    };
    let shared = |claim: &Detection| proposed.iter().any(|other| other.class == claim.class && same(other, claim));
    let unshared = seen.iter().filter(|claim| claim.score >= least && !shared(claim));
    let all = proposed.iter().map(|proposal| (*proposal, answer(proposal).is_some_and(|s| s.class != proposal.class)));
    let all: Vec<(Detection, bool)> = all.chain(unshared.map(|claim| (*claim, true))).take(32).collect();
    let disputed = all.iter().enumerate().filter(|(_, (_, disputed))| *disputed);
    let disputed = disputed.fold(Disputed::default(), |set, (index, _)| set.with_index(index));
    (all.into_iter().map(|(detection, _)| detection).collect(), disputed)
}

/// Seven bytes a pixel, row-major. A plane that is missing or of another size is nought; `None` without any.
pub fn image(frames: &Frames<'_>) -> Option<Vec<u8>> {
    let pixels = usize::from(frames.width) * usize::from(frames.height);
    let colour = frames.rgb.map(|plane| plane.as_ref()).filter(|plane: &&[u8]| plane.len() == 3 * pixels);
    let warmth = frames.thermal.and_then(|plane| bands::bands(plane, frames.width, frames.height));
    let depth = frames.depth.map(|plane| plane.as_ref()).filter(|plane: &&[u8]| plane.len() == 2 * pixels);
    if colour.is_none() && warmth.is_none() && depth.is_none() {
        return None;
    }
    let near = nearness();
    let mut image = vec![0; PLANES * pixels];
    for (k, pixel) in image.chunks_exact_mut(PLANES).enumerate() {
        if let Some(colour) = colour {
            pixel[..3].copy_from_slice(&colour[3 * k..][..3]);
        }
        if let Some(warmth) = &warmth {
            pixel[3..6].copy_from_slice(&warmth[3 * k..][..3]);
        }
        if let Some(depth) = depth {
            let mm = u16::from_le_bytes([depth[2 * k], depth[2 * k + 1]]);
            pixel[6] = near[usize::from(mm >> 4)];
        }
    }
    Some(image)
}

/// Nearness by depth in units of 16 mm: 255 at the nearest, 1 at the farthest and beyond, 0 without a return.
fn nearness() -> [u8; 4096] {
    let span = libm::logf(FARTHEST_MM / NEAREST_MM);
    core::array::from_fn(|k| {
        if k == 0 {
            return 0;
        }
        let share = libm::logf(FARTHEST_MM / (k as f32 * 16.0)) / span;
        (1.0 + 254.0 * share.clamp(0.0, 1.0)) as u8
    })
}

#[cfg(test)]
mod tests {
    use wire::id::FrameId;
    use wire::sensor::{Class, PixelBox};
    use wire::time::Instant;

    use super::*;

    #[test]
    fn missing_planes_are_nought_and_near_is_bright() {
        let depth: Vec<u8> = [0u16, 900, 7_746, 60_000].into_iter().flat_map(u16::to_le_bytes).collect();
        let (rgb, depth) = ([9u8; 12], depth);
        let frames = |rgb, depth| Frames {
            frame: FrameId(1),
            stamp: Instant(1),
            width: 2,
            height: 2,
            rgb,
            depth,
            thermal: None,
            lidar: None,
        };
        let seen = image(&frames(Some((&rgb[..]).into()), Some((&depth[..]).into()))).unwrap();
        let near: Vec<u8> = seen.chunks_exact(PLANES).map(|pixel| pixel[6]).collect();
        assert_eq!((&seen[..6], &near[..]), (&[9, 9, 9, 0, 0, 0][..], &[0, 255, 128, 1][..]));
        assert_eq!(image(&frames(None, None)), None);
    }

    #[test]
    fn colour_may_be_silent_and_may_not_contradict() {
        let detection =
            |class, score, x0| Detection { class, score, bounds: PixelBox { x0, y0: 50, x1: x0 + 20, y1: 60 } };
        let proposed = vec![detection(Class::Vehicle, 900, 40)];
        let claims = |seen: &[Detection]| {
            let (found, disputed) = claims(&proposed, seen, 400);
            (found.to_vec(), (0..40).filter(|index| disputed.contains(*index)).collect::<Vec<_>>())
        };
        assert_eq!(claims(&[]), (proposed.clone(), vec![]));
        assert_eq!(claims(&[detection(Class::Vehicle, 400, 42)]), (proposed.clone(), vec![]));
        let (decoy, vehicle) = (detection(Class::Decoy, 310, 42), detection(Class::Vehicle, 800, 100));
        assert_eq!(claims(&[decoy]), (proposed.clone(), vec![0]), "too faint a claim to stand by itself");
        assert_eq!(claims(&[vehicle]), (vec![proposed[0], vehicle], vec![1]), "the network does not see it");
        let decoy = detection(Class::Decoy, 800, 42);
        assert_eq!(claims(&[decoy]), (vec![proposed[0], decoy], vec![0, 1]));
    }
}
