//! `[[half_close]]`: the relay without a key ends one direction of a command-plane connection.

use adversary::plan::StreamAction;
use evidence::Planned;
use ground_truth::StreamEffect;

use super::{Act, Attack, Injection, attacks, during};

attacks! {
    /// Ends one direction; the other stays open.
    HalfClose {}
}

impl Attack for HalfClose {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        Some(Act::Stream(during(self, self.direction, phase_ms, StreamAction::HalfClose)))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Stream(StreamEffect::HalfClosed)))
    }
}
