//! `[[broker_drop]]`: the hostile broker does not pass publications on.

use adversary::plan::BrokerAction;
use evidence::Planned;
use ground_truth::Action;
use wire::command::OrderKind;

use super::{Act, Attack, Injection, attacks, during, publications};

attacks! {
    /// Publications are not passed on.
    BrokerDrop needs Insider {
        /// Only those about an order that asks this.
        #[serde(default)]
        only: Option<OrderKind>,
    }
}

impl Attack for BrokerDrop {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        Some(Act::Broker(during(self, self.direction, phase_ms, BrokerAction::Drop { only: self.only })))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Broker(Action::Drop)).taking(publications(self.direction, self.only)))
    }
}
