//! `[[broker_invent]]`: the hostile broker publishes orders that it made itself.

use adversary::plan::{BrokerAction, Direction, OrderForgery};
use evidence::Planned;
use ground_truth::Action;
use wire::command::OrderKind;

use super::{Act, Attack, Injection, captured, during};
use crate::timed::timed;
use crate::{Count, Millis};

timed! {
    /// Orders of the broker's own making.
    BrokerInvent needs Insider sees OnPath {
        /// The order.
        #[serde(rename = "do")]
        verb: OrderKind,
        /// Kind of the forgery.
        forgery: OrderForgery,
        /// Count of the orders.
        count: Count,
        /// Time between them.
        every_ms: Millis,
    }
}

impl Attack for BrokerInvent {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        let (count, every_ms) = (self.count.unsigned() as u32, self.every_ms.unsigned());
        let action = BrokerAction::Invent { kind: self.verb, forgery: self.forgery, count, every_ms };
        Some(Act::Broker(during(self, Direction::Down, phase_ms, action)))
    }

    fn injection(&self) -> Option<Injection> {
        let injection = Injection::new(Planned::Broker(Action::Inject));
        let injection = injection.longer_by(self.count.unsigned() * self.every_ms.unsigned());
        match self.forgery {
            OrderForgery::OwnKey => Some(injection),
            OrderForgery::Altered | OrderForgery::Spliced => Some(injection.taking(captured(Direction::Down))),
        }
    }
}
