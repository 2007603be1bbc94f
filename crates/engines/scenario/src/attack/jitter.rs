//! `[[jitter]]`: the relay without a key holds telemetry datagrams back by random times.

use adversary::plan::DatagramAction;
use evidence::{Planned, Takes};
use ground_truth::Action;

use super::{Act, Attack, Injection, attacks, during};
use crate::Millis;

attacks! {
    /// Holds each datagram back by a uniform random time.
    Jitter {
        /// Longest delay.
        up_to_ms: Millis,
    }
}

impl Attack for Jitter {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        let action = DatagramAction::Jitter { ms: self.up_to_ms.unsigned() };
        Some(Act::Datagram(during(self, self.direction, phase_ms, action)))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Action(Action::Delay)).taking(Takes::Records(self.direction.side())))
    }
}
