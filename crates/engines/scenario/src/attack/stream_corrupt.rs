//! `[[stream_corrupt]]`: the relay without a key changes command-plane bytes.

use adversary::plan::StreamAction;
use evidence::{Planned, Takes};
use ground_truth::StreamEffect;

use super::{Act, Attack, Injection, attacks, during};
use crate::Share;

attacks! {
    /// Flips one random bit in some pieces.
    StreamCorrupt {
        /// Probability for each piece.
        share: Share,
    }
}

impl Attack for StreamCorrupt {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        Some(Act::Stream(during(
            self,
            self.direction,
            phase_ms,
            StreamAction::Corrupt { permille: self.share.permille() },
        )))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Stream(StreamEffect::Damaged)).taking(Takes::Pieces))
    }
}
