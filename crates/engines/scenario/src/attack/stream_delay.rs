//! `[[stream_delay]]`: the relay without a key holds command-plane bytes back.

use adversary::plan::StreamAction;
use evidence::{Planned, Takes};
use ground_truth::StreamEffect;

use super::{Act, Attack, Injection, attacks, during};
use crate::Millis;

attacks! {
    /// Holds bytes back by a fixed time.
    StreamDelay {
        /// The time.
        by_ms: Millis,
    }
}

impl Attack for StreamDelay {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        Some(Act::Stream(during(self, self.direction, phase_ms, StreamAction::Delay { ms: self.by_ms.unsigned() })))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Stream(StreamEffect::Held)).taking(Takes::Pieces))
    }
}
