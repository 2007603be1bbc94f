//! Seeded draws of a world, the same numbers on every machine.

use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};

/// The stream of one attempt.
pub(crate) struct Chance(ChaCha8Rng);

impl Chance {
    /// The stream of attempt `attempt` at world `seed` of the family with this number: its own key, so that neighbours share no draws.
    pub(crate) fn new(family: u64, seed: u64, attempt: u64) -> Self {
        let mut key = [0; 32];
        for (bytes, part) in key.chunks_exact_mut(8).zip([family, seed, attempt]) {
            bytes.copy_from_slice(&part.to_le_bytes());
        }
        Self(ChaCha8Rng::from_seed(key))
    }

    /// Uniform from `low` to `high`.
    pub(crate) fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.0.next_u64() >> 11) as f64 / 9_007_199_254_740_992.0)
    }

    /// A whole number from `least` to `most`, both included.
    pub(super) fn integer(&mut self, least: usize, most: usize) -> usize {
        let choices = (most.max(least) - least) as u64 + 1;
        least + (self.0.next_u64() % choices) as usize
    }

    /// True with this probability.
    pub(super) fn happens(&mut self, probability: f64) -> bool {
        self.uniform(0.0, 1.0) < probability
    }

    /// One of -1 and 1.
    pub(super) fn side(&mut self) -> f64 {
        if self.happens(0.5) { 1.0 } else { -1.0 }
    }
}
