//! `[[cut]]`: the relay without a key resets command-plane connections and keeps them from coming back.

use adversary::plan::StreamAction;
use evidence::Planned;
use ground_truth::StreamEffect;

use super::{Act, Attack, Injection, attacks, during};

attacks! {
    /// Resets connections and refuses new ones until the window ends.
    Cut {}
}

impl Attack for Cut {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        Some(Act::Stream(during(self, self.direction, phase_ms, StreamAction::Cut)))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Stream(StreamEffect::Reset)))
    }
}
