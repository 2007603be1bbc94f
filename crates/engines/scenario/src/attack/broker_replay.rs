//! `[[broker_replay]]`: the hostile broker delivers captured publications again.

use adversary::plan::BrokerAction;
use evidence::Planned;
use ground_truth::Action;

use super::{Act, Attack, Injection, captured, during};
use crate::timed::timed;
use crate::{Count, Direction, Millis};

timed! {
    /// Captured publications are delivered again, the newest first and then back in turn.
    BrokerReplay needs Insider sees OnPath {
        /// Direction.
        #[serde(default)]
        direction: Direction,
        /// Count of the publications.
        count: Count,
        /// Time between them.
        every_ms: Millis,
    }
}

impl Attack for BrokerReplay {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        let (count, every_ms) = (self.count.unsigned() as u32, self.every_ms.unsigned());
        Some(Act::Broker(during(self, self.direction, phase_ms, BrokerAction::Replay { count, every_ms })))
    }

    fn injection(&self) -> Option<Injection> {
        Some(
            Injection::new(Planned::Broker(Action::Replay))
                .longer_by(self.count.unsigned() * self.every_ms.unsigned())
                .taking(captured(self.direction)),
        )
    }
}
