//! `[[duplicate]]`: the relay without a key sends telemetry datagrams more than once.

use adversary::plan::DatagramAction;
use evidence::{Planned, Takes};
use ground_truth::Action;

use super::{Act, Attack, Injection, attacks, during};
use crate::{Millis, Whole};

attacks! {
    /// Sends each datagram again.
    Duplicate {
        /// Copies beside the original.
        copies: Whole<1, 64>,
        /// Time between copies.
        #[serde(default)]
        every_ms: Millis,
    }
}

impl Attack for Duplicate {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        let (copies, every_ms) = (self.copies.unsigned() as u32, self.every_ms.unsigned());
        let action = DatagramAction::Duplicate { copies, every_ms, permille: 1000 };
        Some(Act::Datagram(during(self, self.direction, phase_ms, action)))
    }

    fn injection(&self) -> Option<Injection> {
        Some(
            Injection::new(Planned::Action(Action::Duplicate))
                .longer_by(self.copies.unsigned() * self.every_ms.unsigned())
                .taking(Takes::Records(self.direction.side())),
        )
    }
}
