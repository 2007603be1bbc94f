//! Seeded randomness: one stream for each source, and within it one place for each reading.
//!
//! A reading's noise depends on (seed, stream, reading number) alone. So a fault in one sensor shifts no other, a
//! reading that was never made shifts none that follow, and a fork needs no generator state.

use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};

/// Sources of noise; each has its own stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stream {
    Rgb = 1,
    Depth,
    Thermal,
    Lidar,
    Odometry,
    Localisation,
    RgbCandidates,
    DepthCandidates,
    ThermalCandidates,
    LidarCandidates,
    Wind,
    Spatial,
    Bearings,
    Wander,
}

/// The noise of one source.
#[derive(Clone, Debug)]
pub(crate) struct Noise(ChaCha8Rng);

impl Noise {
    pub(crate) fn new(seed: u64, stream: Stream) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(stream as u64);
        Noise(rng)
    }

    /// Every reading from now on draws from `seed`.
    pub(crate) fn reseed(&mut self, seed: u64) {
        let stream = self.0.get_stream();
        self.0 = ChaCha8Rng::seed_from_u64(seed);
        self.0.set_stream(stream);
    }

    /// Goes to the place of reading `n`; each has room for 2^20 words.
    pub(crate) fn seek(&mut self, n: u64) {
        self.0.set_word_pos(u128::from(n) << 20);
    }

    /// A number of which every value is as likely.
    pub(crate) fn word(&mut self) -> u32 {
        self.0.next_u32()
    }

    /// Uniform in 0..1.
    pub(crate) fn uniform(&mut self) -> f32 {
        (self.0.next_u32() >> 8) as f32 / 16_777_216.0
    }

    /// Approximately normal with unit variance: the sum of twelve uniforms, so within ±6.
    pub(crate) fn normal(&mut self) -> f32 {
        let mut bytes = [0u8; 24];
        self.0.fill_bytes(&mut bytes);
        let sum: u32 = bytes.chunks_exact(2).map(|b| u32::from(u16::from_le_bytes([b[0], b[1]]))).sum();
        sum as f32 / 65_536.0 - 6.0
    }

    /// True with this probability.
    pub(crate) fn chance(&mut self, probability: f32) -> bool {
        self.uniform() < probability
    }

    /// Raw bytes, for noise by the pixel.
    pub(crate) fn fill(&mut self, bytes: &mut [u8]) {
        self.0.fill_bytes(bytes);
    }
}
