//! `[[broker_forge]]`: the hostile broker publishes acknowledgements that it made itself.

use adversary::plan::{AckForgery, BrokerAction, Direction};
use evidence::Planned;
use ground_truth::Action;

use super::{Act, Attack, Injection, during, publications};
use crate::Seconds;
use crate::timed::timed;

timed! {
    /// For each order that is seen, an acknowledgement of the broker's own making: it was executed.
    BrokerForge lasts duration_s needs Insider sees OnPath {
        /// Length of the window.
        duration_s: Seconds,
        /// Kind of the forgery.
        forgery: AckForgery,
    }
}

impl Attack for BrokerForge {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        Some(Act::Broker(during(self, Direction::Up, phase_ms, BrokerAction::Forge { forgery: self.forgery })))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Broker(Action::Inject)).taking(publications(Direction::Down, None)))
    }
}
