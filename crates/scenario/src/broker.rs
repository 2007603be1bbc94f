//! Attacks by the holder of the command broker's certificate and key, in the broker's place.
//!
//! *Down* is towards the units (orders), *up* towards the gateway (acknowledgements). It reads what it carries and signs
//! nothing but with its own key. Carrying it out belongs to `adversary`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::attack::{Direction, attacks};
use super::rogue::Order;
use super::timed::timed;
use super::value::{Count, Millis, Seconds, Whole};

attacks! {
    /// Publications are not passed on.
    BrokerDrop needs Insider {
        /// Only those about an order that asks this.
        #[serde(default)]
        only: Option<Order>,
    }

    /// Publications are passed on later.
    BrokerDelay needs Insider {
        /// By how much.
        by_ms: Millis,
        /// Only those about an order that asks this.
        #[serde(default)]
        only: Option<Order>,
    }

    /// Each publication is held until the next of its direction has passed.
    BrokerReorder needs Insider {
        /// Longest hold.
        hold_ms: Whole<1, 60_000>,
    }

    /// Each publication is delivered more than once.
    BrokerDuplicate needs Insider {
        /// Copies beside the original.
        copies: Whole<1, 64>,
    }

    /// The newest publication of a subject is delivered again to each subscriber that connects.
    BrokerRetain needs Insider {}
}

timed! {
    /// Captured publications are delivered again, the newest first and then back in turn.
    BrokerReplay needs Insider sees OnPath {
        /// Which way.
        #[serde(default)]
        direction: Direction,
        /// How many.
        count: Count,
        /// Time between them.
        every_ms: Millis,
    }
}

timed! {
    /// Orders of the broker's own making.
    BrokerInvent needs Insider sees OnPath {
        /// What they ask.
        #[serde(rename = "do")]
        verb: Order,
        /// What they are made of.
        forgery: OrderForgery,
        /// How many.
        count: Count,
        /// Time between them.
        every_ms: Millis,
    }
}

timed! {
    /// For each order that is seen, an acknowledgement of the broker's own making: it was executed.
    BrokerForge lasts duration_s needs Insider sees OnPath {
        /// Length of the window.
        duration_s: Seconds,
        /// What it is made of.
        forgery: AckForgery,
    }
}

/// What an invented order is made of.
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

/// What a forged acknowledgement is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum AckForgery {
    /// A new one under the broker's own key.
    OwnKey,
    /// The unit's newest, made to be about this order, with the signature it had.
    Altered,
    /// The unit's newest as it was.
    Replayed,
}
