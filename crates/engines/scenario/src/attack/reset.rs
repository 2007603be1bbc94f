//! `[[reset]]`: the relay without a key resets command-plane connections.

use adversary::plan::StreamAction;
use evidence::Planned;
use ground_truth::StreamEffect;

use super::{Act, Attack, Injection, attacks, during};

attacks! {
    /// Resets connections at the start of the window.
    Reset {}
}

impl Attack for Reset {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        Some(Act::Stream(during(self, self.direction, phase_ms, StreamAction::Reset)))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Stream(StreamEffect::Reset)))
    }
}
