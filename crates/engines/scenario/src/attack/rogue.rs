//! `[[rogue]]`: a rogue station gives orders under a key that is not its own.
//!
//! It holds another identity's signing key and gives orders with it: through its own station at the gateway, or under a
//! certificate at the broker. It is its own identity; no service knows that it is a rogue.

use adversary::plan::{OrderId, OrderTrack, RogueOrders};
use evidence::Planned;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use wire::command::OrderKind;
use wire::id::NodeId;

use super::{Act, Attack, Injection};
use crate::finding::{Finding, finding, unknown};
use crate::timed::timed;
use crate::{Count, Located, Millis, Name, Scenario, Values, Whole, Windowed};

timed! {
    /// A run of orders of the rogue station. All tables of a scenario are one rogue's: one key, one way, one certificate.
    Rogue needs Insider {
        /// Identity of the signing key that it holds.
        holds: Located<Name>,
        /// Way of its orders.
        way: Way,
        /// Identity of the certificate that it publishes under at the broker; by default the one of the key that it holds.
        #[serde(default)]
        certificate: Option<Located<Name>>,
        /// Identity that it orders in the name of; by default the one of the key that it holds.
        #[serde(default)]
        claims: Option<Located<Name>>,
        /// The order.
        order: OrderKind,
        /// Count of the orders.
        count: Count,
        /// Time between them.
        every_ms: Millis,
        /// Amount by which the counter is run ahead with each.
        #[serde(default)]
        ahead: Whole<0, 9_000_000_000_000_000_000>,
        /// Id of the order.
        #[serde(default)]
        id: OrderId,
        /// Track of the order, to arm or to confirm.
        #[serde(default)]
        track: OrderTrack,
        /// The values, where it orders to configure.
        #[serde(default)]
        values: Option<Values>,
    }
}

impl Attack for Rogue {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        let claims = self.claims.as_ref().unwrap_or(&self.holds);
        Some(Act::Orders(RogueOrders {
            at_ms: self.start_ms(phase_ms),
            count: self.count.unsigned() as u32,
            every_ms: self.every_ms.unsigned(),
            claim: NodeId::from_name(claims.as_str())?,
            order: self.order,
            values: self.values.map(Values::settings),
            ahead: self.ahead.unsigned(),
            id: self.id,
            track: self.track,
            step: self.actor_step(),
        }))
    }

    fn injection(&self) -> Option<Injection> {
        let injection = Injection::new(Planned::Rogue).longer_by(self.count.unsigned() * self.every_ms.unsigned());
        Some(injection.judged_by(match self.way {
            Way::Station => &[NodeId::GATEWAY],
            Way::Broker => &[NodeId::BROKER],
        }))
    }

    /// Everybody named has a key; and one rogue: one key, one way, one certificate.
    fn check(&self, whole: &Scenario) -> Vec<Finding> {
        let names = [Some(&self.holds), self.claims.as_ref(), self.certificate.as_ref()].into_iter().flatten();
        let mut found: Vec<Finding> = names.filter_map(unknown).collect();
        if self.order == OrderKind::Configure && self.values.is_none() {
            found.push(finding(&self.at_s, "no values to set", "add `values`"));
        }
        if whole.rogue.first().is_some_and(|first| !self.is_one_with(first)) {
            let message = "another key, way or certificate than the table before";
            found.push(finding(&self.holds, message, "a scenario has one rogue station"));
        }
        found
    }
}

impl Rogue {
    fn is_one_with(&self, other: &Rogue) -> bool {
        let certificate = |rogue: &Rogue| rogue.certificate.as_deref().cloned();
        self.way == other.way && *self.holds == *other.holds && certificate(self) == certificate(other)
    }
}

/// Way of a rogue's orders.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Way {
    /// Requests of the gateway, over a channel that is its own.
    Station,
    /// Publications at the broker, past the gateway.
    Broker,
}
