//! Seeded draws of a world: SplitMix64 (Steele, Lea and Flood 2014), the same numbers on every machine.

/// The stream of one attempt.
pub(super) struct Chance(u64);

impl Chance {
    /// The stream of attempt `attempt` at world `seed` of the family with this number.
    pub(super) fn new(family: u64, seed: u64, attempt: u64) -> Self {
        // Each part is mixed before the next one joins, so that neighbouring seeds and attempts share no draws.
        let mut state = 0x776f_726c_6473_2d31;
        for part in [family, seed, attempt] {
            state = Self(state ^ part).next();
        }
        Self(state)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// Uniform from `low` to `high`.
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.next() >> 11) as f64 / 9_007_199_254_740_992.0)
    }

    /// A whole number from `least` to `most`, both included.
    pub(super) fn whole(&mut self, least: usize, most: usize) -> usize {
        let choices = (most.max(least) - least) as u64 + 1;
        least + (self.next() % choices) as usize
    }

    /// True with this probability.
    pub(super) fn happens(&mut self, probability: f64) -> bool {
        self.between(0.0, 1.0) < probability
    }

    /// One of -1 and 1.
    pub(super) fn side(&mut self) -> f64 {
        if self.happens(0.5) { 1.0 } else { -1.0 }
    }
}
