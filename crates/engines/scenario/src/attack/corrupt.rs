//! `[[corrupt]]`: the relay without a key changes telemetry datagrams on the way.

use adversary::plan::{Damage, DatagramAction};
use evidence::{Planned, Takes};
use ground_truth::Action;

use super::{Act, Attack, Injection, attacks, during};
use crate::Share;

attacks! {
    /// Changes datagrams on the way.
    Corrupt {
        /// Probability for each datagram.
        share: Share,
        /// The change.
        damage: Damage,
    }
}

impl Attack for Corrupt {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        let action = DatagramAction::Corrupt { permille: self.share.permille(), damage: self.damage };
        Some(Act::Datagram(during(self, self.direction, phase_ms, action)))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Action(Action::Corrupt)).taking(Takes::Records(self.direction.side())))
    }
}
