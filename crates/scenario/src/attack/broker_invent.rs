//! `[[broker_invent]]`: the hostile broker publishes orders that it made itself.

use adversary::plan::{self, BrokerAction};
use evidence::Planned;
use instrument::Action;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Act, Attack, Injection, captured, during};
use crate::timed::timed;
use crate::{Count, Direction, Millis, Order};

timed! {
    /// Orders of the broker's own making.
    BrokerInvent needs Insider sees OnPath {
        /// The order.
        #[serde(rename = "do")]
        verb: Order,
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
        let forgery = match self.forgery {
            OrderForgery::OwnKey => plan::OrderForgery::OwnKey,
            OrderForgery::Altered => plan::OrderForgery::Altered,
            OrderForgery::Spliced => plan::OrderForgery::Spliced,
        };
        let (count, every_ms) = (self.count.unsigned() as u32, self.every_ms.unsigned());
        let action = BrokerAction::Invent { kind: self.verb.kind(), forgery, count, every_ms };
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

/// Kind of an invented order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum OrderForgery {
    /// A new intent in the operator's name, with the newest nonce seen, both steps under the broker's own key.
    OwnKey,
    /// The newest captured intent, asking something else under a later id, with the signature it had.
    Altered,
    /// The newest captured intent with the confirmation of another.
    Spliced,
}
