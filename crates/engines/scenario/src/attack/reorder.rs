//! `[[reorder]]`: the relay without a key lets telemetry datagrams overtake each other.

use adversary::plan::DatagramAction;
use evidence::{Planned, Takes};
use ground_truth::Action;

use super::{Act, Attack, Injection, attacks, during};
use crate::{Millis, Share};

attacks! {
    /// Holds some datagrams back so that later ones overtake them.
    Reorder {
        /// Probability for each datagram.
        share: Share,
        /// Time for which those are held.
        hold_ms: Millis,
    }
}

impl Attack for Reorder {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        let (permille, hold_ms) = (self.share.permille(), self.hold_ms.unsigned());
        let action = DatagramAction::Reorder { permille, hold_ms };
        Some(Act::Datagram(during(self, self.direction, phase_ms, action)))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Action(Action::Reorder)).taking(Takes::Records(self.direction.side())))
    }
}
