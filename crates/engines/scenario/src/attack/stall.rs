//! `[[stall]]`: the relay without a key keeps command-plane bytes until the end of the window.

use adversary::plan::StreamAction;
use evidence::{Planned, Takes};
use ground_truth::StreamEffect;

use super::{Act, Attack, Injection, attacks, during};

attacks! {
    /// Keeps all bytes until the window ends; the connection stays open.
    Stall {}
}

impl Attack for Stall {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        Some(Act::Stream(during(self, self.direction, phase_ms, StreamAction::Stall)))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Stream(StreamEffect::Held)).taking(Takes::Pieces))
    }
}
