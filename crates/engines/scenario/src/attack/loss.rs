//! `[[loss]]`: the relay without a key loses telemetry datagrams, each by itself.

use adversary::plan::DatagramAction;
use evidence::{Planned, Takes};
use ground_truth::Action;

use super::{Act, Attack, Injection, attacks, during};
use crate::Share;

attacks! {
    /// Loses each datagram with the same probability.
    Loss {
        /// Probability.
        share: Share,
    }
}

impl Attack for Loss {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        let action = DatagramAction::Loss { permille: self.share.permille() };
        Some(Act::Datagram(during(self, self.direction, phase_ms, action)))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Action(Action::Drop)).taking(Takes::Records(self.direction.side())))
    }
}
