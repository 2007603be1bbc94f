//! `[[replay]]`: the relay without a key sends captured telemetry datagrams again. The relay itself is `adversary::relay::datagram`.

use adversary::plan::DatagramAction;
use evidence::{Planned, Takes};
use ground_truth::Action;

use super::{Act, Attack, Injection, attacks, during};
use crate::{Count, Millis};

attacks! {
    /// Captures datagrams and sends them again later.
    Replay needs OnPath {
        /// Age of the captured datagram when it is sent again.
        lag_ms: Millis,
        /// Number of datagrams sent again.
        count: Count,
        /// Time between them.
        every_ms: Millis,
    }
}

impl Attack for Replay {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        let (lag_ms, count) = (self.lag_ms.unsigned(), self.count.unsigned() as u32);
        let action = DatagramAction::Replay { lag_ms, count, every_ms: self.every_ms.unsigned() };
        Some(Act::Datagram(during(self, self.direction, phase_ms, action)))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Action(Action::Replay)).taking(Takes::Records(self.direction.side())))
    }
}
