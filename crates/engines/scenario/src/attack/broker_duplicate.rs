//! `[[broker_duplicate]]`: the hostile broker delivers publications more than once.

use adversary::plan::BrokerAction;
use evidence::Planned;
use ground_truth::Action;

use super::{Act, Attack, Injection, attacks, during, publications};
use crate::Whole;

attacks! {
    /// Each publication is delivered more than once.
    BrokerDuplicate needs Insider {
        /// Copies beside the original.
        copies: Whole<1, 64>,
    }
}

impl Attack for BrokerDuplicate {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        let action = BrokerAction::Duplicate { copies: self.copies.unsigned() as u32 };
        Some(Act::Broker(during(self, self.direction, phase_ms, action)))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Broker(Action::Duplicate)).taking(publications(self.direction, None)))
    }
}
