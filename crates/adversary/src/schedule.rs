//! Times of an action that is done a counted number of times, and the seeded draws that go with an action.

use rand_chacha::ChaCha8Rng;
use rand_core::{RngCore, SeedableRng};
use wire::time::{Instant, Span};

/// A given number of steps from a start, evenly spaced, none at or after the end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Steps {
    next: Instant,
    every: Span,
    left: u32,
    end: Option<Instant>,
}

impl Steps {
    /// `count` steps from `start`; `end` cuts them short.
    pub(crate) fn new(start: Instant, every_ms: u64, count: u32, end: Option<Instant>) -> Self {
        Self { next: start, every: Span::ms(every_ms), left: count, end }
    }

    /// Time at which the next step is due; `None` when there is none left.
    pub(crate) fn due(&self) -> Option<Instant> {
        let open = self.left > 0 && self.end.is_none_or(|end| self.next < end);
        open.then_some(self.next)
    }

    /// Takes one step if it is due at `now`.
    pub(crate) fn take(&mut self, now: Instant) -> bool {
        let due = self.due().is_some_and(|time| time <= now);
        if due {
            self.left -= 1;
            self.next += self.every;
        }
        due
    }
}

/// Random stream of one action of a plan. Each action has its own: adding an action changes no other's draws.
pub(crate) fn stream(seed: u64, action: usize) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(action as u64);
    rng
}

/// True with a probability in permille.
pub(crate) fn chance(rng: &mut ChaCha8Rng, permille: u16) -> bool {
    uniform_below(rng, 1000) < u64::from(permille)
}

/// Uniform number below `n`, zero when `n` is. By multiplication: the bias is below 2⁻³² for the sizes drawn here.
pub(crate) fn uniform_below(rng: &mut ChaCha8Rng, n: u64) -> u64 {
    ((u128::from(rng.next_u64()) * u128::from(n)) >> 64) as u64
}

/// A given number of random bytes.
pub(crate) fn noise(rng: &mut ChaCha8Rng, length: usize) -> Vec<u8> {
    let mut bytes = vec![0; length];
    rng.fill_bytes(&mut bytes);
    bytes
}
