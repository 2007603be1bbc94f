//! `[[throttle]]`: the relay without a key lets command-plane bytes through at a rate.

use adversary::plan::StreamAction;
use evidence::{Planned, Takes};
use ground_truth::StreamEffect;

use super::{Act, Attack, Injection, attacks, during};
use crate::Whole;

attacks! {
    /// Lets bytes through at a rate.
    Throttle {
        /// The rate.
        bytes_per_s: Whole<1, 10_000_000>,
    }
}

impl Attack for Throttle {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        Some(Act::Stream(during(
            self,
            self.direction,
            phase_ms,
            StreamAction::Throttle { bytes_per_s: self.bytes_per_s.unsigned() },
        )))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Stream(StreamEffect::Held)).taking(Takes::Pieces))
    }
}
