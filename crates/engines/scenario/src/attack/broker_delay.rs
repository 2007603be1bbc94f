//! `[[broker_delay]]`: the hostile broker passes publications on later.

use adversary::plan::BrokerAction;
use evidence::Planned;
use ground_truth::Action;
use wire::command::OrderKind;

use super::{Act, Attack, Injection, attacks, during, publications};
use crate::Millis;

attacks! {
    /// Publications are passed on later.
    BrokerDelay needs Insider {
        /// The delay.
        by_ms: Millis,
        /// Only those about an order that asks this.
        #[serde(default)]
        only: Option<OrderKind>,
    }
}

impl Attack for BrokerDelay {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        let action = BrokerAction::Delay { ms: self.by_ms.unsigned(), only: self.only };
        Some(Act::Broker(during(self, self.direction, phase_ms, action)))
    }

    fn injection(&self) -> Option<Injection> {
        Some(
            Injection::new(Planned::Broker(Action::Delay))
                .longer_by(self.by_ms.unsigned())
                .taking(publications(self.direction, self.only)),
        )
    }
}
