//! `[[broker_retain]]`: the hostile broker delivers the newest publications again to each subscriber that connects.

use adversary::plan::BrokerAction;
use evidence::Planned;
use ground_truth::Action;

use super::{Act, Attack, Injection, attacks, captured, during};

attacks! {
    /// The newest publication of a subject is delivered again to each subscriber that connects.
    BrokerRetain needs Insider {}
}

impl Attack for BrokerRetain {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        Some(Act::Broker(during(self, self.direction, phase_ms, BrokerAction::Retain)))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Broker(Action::Replay)).taking(captured(self.direction)))
    }
}
