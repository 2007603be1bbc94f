//! Frames made worse for the fused network, so that it leans on no single sense: one is missing, light is short, air is thick,
//! warmth is faint, depth ends early. Conditions that are not learnt from stay out: these are changes to single planes, drawn
//! evenly, and no model of any weather.

use dataset::draw::uniform;
use perception::letterbox::{HEIGHT, WIDTH};
use rand_chacha::ChaCha8Rng;
use rand_core::RngCore;

/// Pixels of a plane.
const PIXELS: usize = HEIGHT * WIDTH;
/// Share of frames in which a change is made, for each kind of change.
const SHARE: f32 = 0.3;
/// Share of frames in which one of the senses is missing.
const MISSING: f32 = 0.25;

/// Changes the planes of one frame: three of colour, three of warmth, one of nearness.
pub(crate) fn worsen(planes: &mut [f32], rng: &mut ChaCha8Rng) {
    let (colour, rest) = planes.split_at_mut(3 * PIXELS);
    let (warmth, near) = rest.split_at_mut(3 * PIXELS);
    let mut happens = |share: f32| uniform(rng) < share;
    let (noisy, hazy, faint, short) = (happens(SHARE), happens(SHARE), happens(SHARE), happens(SHARE));
    let missing = happens(MISSING);
    if hazy {
        let (left, grey) = (0.05 + 0.95 * uniform(rng), 0.3 + 0.6 * uniform(rng));
        colour.iter_mut().for_each(|value| *value = *value * left + grey * (1.0 - left));
    }
    if noisy {
        let (light, spread) = (0.15 + 0.85 * uniform(rng), 0.3 * uniform(rng));
        colour.iter_mut().for_each(|value| *value = (*value * light + spread * (uniform(rng) - 0.5)).clamp(0.0, 1.0));
    }
    if faint {
        let left = 0.25 + 0.75 * uniform(rng);
        for plane in warmth.chunks_exact_mut(PIXELS) {
            let ground = median(plane);
            plane.iter_mut().for_each(|value| *value = ground + (*value - ground) * left);
        }
    }
    if short {
        // The nearer, the greater.
        let least = 0.2 + 0.5 * uniform(rng);
        near.iter_mut().filter(|value| **value < least).for_each(|value| *value = 0.0);
    }
    if missing {
        match rng.next_u32() % 3 {
            0 => colour.fill(0.0),
            1 => warmth.fill(0.0),
            _ => near.fill(0.0),
        }
    }
}

/// Median of the lower half, where there is ground rather than sky.
fn median(plane: &[f32]) -> f32 {
    let mut lower = plane[PIXELS / 2..].to_vec();
    let middle = lower.len() / 2;
    *lower.select_nth_unstable_by(middle, f32::total_cmp).1
}
