//! Everything that a seed varies in a topology, drawn once and in a fixed order.

use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use scenario::Scenario;

use super::{ClockDraw, Host};

/// Draws of one seed.
pub(super) struct Draw {
    pub(super) phase_ms: u64,
    pub(super) shift_m: (f64, f64),
    pub(super) clocks: Vec<ClockDraw>,
    pub(super) noise: u64,
    /// Share of observers who identify better than this trial's operator, millionths.
    pub(super) better_ppm: u32,
}

impl Draw {
    pub(super) fn from_scenario(scenario: &Scenario, seed: u64) -> Draw {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut unit = || f64::from(rng.next_u32()) / f64::from(u32::MAX);
        let (from, to) = scenario.varies.phase_s();
        let phase_ms = ((from + (to - from) * unit()) * 1000.0) as u64;
        let reach = scenario.varies.object_shift_m.get();
        let shift_m = ((2.0 * unit() - 1.0) * reach, (2.0 * unit() - 1.0) * reach);
        let varied = scenario.varies.clocks;
        let clocks = Host::ALL.map(|_| {
            // Drawn also where clocks do not vary: the draws that follow stay the same.
            let (zero, drift) = (unit(), unit());
            let zero_us = 1_000_000_000 + if varied { (zero * 3.0e9) as u64 } else { 0 };
            ClockDraw { zero_us, drift_ppm: if varied { (drift * 100.0) as i64 - 50 } else { 0 } }
        });
        let noise = if scenario.varies.noise { seed } else { 0 };
        let better_ppm = (unit() * 1e6) as u32;
        Draw { phase_ms, shift_m, clocks: clocks.to_vec(), noise, better_ppm }
    }
}
