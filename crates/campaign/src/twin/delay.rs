//! How long things take in the twin: stages, hops over shared memory and over loopback.
//!
//! Uniform over ranges that were fitted by hand to the 5th percentile and the median of live runs (`holdsafe bench stages
//! --runs 6`, rendered, release build, 2 otherwise idle cores); that command prints the gap that is left. Left out are the
//! live tails: a reader that waits for a core which the renderer has. A stage's delay is drawn once for each input that
//! makes it speak.

use std::collections::VecDeque;

use adversary::Adversary;
use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use wire::core::{Output, Topic};

use super::part::Part;
use super::queue::Micros;

/// From and to, microseconds.
type Range = (u64, u64);

/// One hop over shared memory, with the wake-up of its reader.
const BUS: Range = (20, 120);
/// One datagram over loopback, with the wake-up of its reader.
const DATAGRAM: Range = (70, 270);
/// A handshake with mutual certificates over loopback, relay in between.
const HANDSHAKE: Range = (2_000, 6_000);
/// A publication through the broker, both legs.
const COMMAND: Range = (300, 900);
/// An entry on its way to the recorder.
pub const INSTRUMENT: Micros = 100;

/// Seeded delays.
#[derive(Clone, Debug)]
pub struct Delays {
    rng: ChaCha8Rng,
    varied: bool,
}

impl Delays {
    /// With `varied` off every delay is the middle of its range.
    pub fn new(seed: u64, varied: bool) -> Self {
        Self { rng: ChaCha8Rng::seed_from_u64(seed), varied }
    }

    /// Draws from `seed` from now on.
    pub fn reseed(&mut self, seed: u64) {
        self.rng = ChaCha8Rng::seed_from_u64(seed);
    }

    /// Between a part's input and `outputs`.
    pub fn stage(&mut self, part: &Part, outputs: &VecDeque<Output>) -> Micros {
        let renders = |output: &Output| matches!(output, Output::Bus { topic: Topic::Frames, .. });
        self.draw(match part {
            Part::Sim(_) if outputs.iter().any(renders) => (4_500, 8_200),
            Part::Sim(_) => (30, 200),
            Part::Perception { rendered: true, .. } => (1_900, 3_400),
            Part::Perception { rendered: false, .. } => (60, 300),
            Part::Autonomy(_) | Part::Gateway(_) | Part::Console(_) => (40, 250),
            Part::Recorder(_) => (60, 260),
            Part::Adversary(Adversary::DatagramRelay(_) | Adversary::StreamRelay(_)) => (10, 60),
            Part::Adversary(_) => (40, 250),
        })
    }

    /// Over shared memory.
    pub fn bus(&mut self) -> Micros {
        self.draw(BUS)
    }

    /// Over loopback UDP.
    pub fn datagram(&mut self) -> Micros {
        self.draw(DATAGRAM)
    }

    /// From a dialler's first flight to the end of its handshake.
    pub fn handshake(&mut self) -> Micros {
        self.draw(HANDSHAKE)
    }

    /// Through the broker.
    pub fn command(&mut self) -> Micros {
        self.draw(COMMAND)
    }

    fn draw(&mut self, (from, to): Range) -> Micros {
        if self.varied { from + u64::from(self.rng.next_u32()) % (to - from + 1) } else { (from + to) / 2 }
    }
}
