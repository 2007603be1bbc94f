//! Heat that fakes bear while the thermal network learns: patterns made against the weights that it has so far, and some at random.
//!
//! Learning from examples that were made against the weights of before (Szegedy et al. 2014, Kurakin et al. 2017). The attack that the
//! network is judged by makes its own, against the weights that come out, on other views.

use std::error::Error;

use dataset::cells::Split;

use crate::joint::{Begins, descend};
use crate::net::Net;
use crate::shifts::MADE_ON;
use crate::views::View;

/// Kelvin above the ground that a field may be, pattern by pattern.
const HEATS: [u8; 4] = [10, 20, 30, 40];
/// Patterns at random for each of these.
const RANDOM: u64 = 3;

/// Patterns at random for each of [`HEATS`] that the fused network learns from, beside that of a vehicle.
const DRAWN: u64 = 6;

/// Patterns that need no network: a vehicle's warmth on each side, and some at random; kelvin above the ground, field by field.
pub(crate) fn drawn() -> Vec<Vec<f32>> {
    let of = |heat: u8| {
        let random = (0..DRAWN).map(move |k| Begins::AtRandom(2_000 * u64::from(heat) + k));
        std::iter::repeat_n(Begins::LikeAVehicle, DRAWN as usize).chain(random).map(move |b| b.heat(f32::from(heat)))
    };
    HEATS.into_iter().flat_map(of).collect()
}

/// The patterns: kelvin above the ground, field by field.
pub(crate) fn pool(net: &Net) -> Result<Vec<Vec<f32>>, Box<dyn Error>> {
    let views = View::some(Split::Training, 0, MADE_ON)?;
    let mut pool = Vec::new();
    for heat in HEATS {
        for begins in [Begins::Even, Begins::LikeAVehicle, Begins::AtRandom(u64::from(heat))] {
            let mut last = Vec::new();
            descend(None, Some((net, heat)), None, &views, begins, |_, suit| {
                last.clone_from(&suit.heat);
                Ok(())
            })?;
            pool.push(last);
        }
        pool.extend((0..RANDOM).map(|k| Begins::AtRandom(1_000 * u64::from(heat) + k).heat(f32::from(heat))));
        eprintln!("{} patterns of heat", pool.len());
    }
    Ok(pool)
}
