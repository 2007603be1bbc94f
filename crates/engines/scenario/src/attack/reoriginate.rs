//! `[[reoriginate]]`: telemetry sent on from the relay's own socket, without a credential.

use adversary::plan::DatagramAction;
use evidence::{Planned, Takes};
use ground_truth::Action;

use super::{Act, Attack, Injection, attacks, during};
use crate::{Count, Direction, Millis, Name};

attacks! {
    /// Sends captured telemetry from the relay's own socket, claiming to be a peer, without a credential.
    Reoriginate needs OnPath {
        /// The unit it claims to be.
        claim: Name,
        /// Count of the datagrams.
        count: Count,
        /// Time between them.
        every_ms: Millis,
    }
}

impl Attack for Reoriginate {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        let (count, every_ms) = (self.count.unsigned() as u32, self.every_ms.unsigned());
        let action = DatagramAction::Reoriginate { count, every_ms };
        Some(Act::Datagram(during(self, self.direction, phase_ms, action)))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Action(Action::Reoriginate)).taking(Takes::Records(Direction::Up.side())))
    }
}
