//! Attacks by the holder of the command broker's certificate and key, in the broker's place.
//!
//! *Down* is towards the units (orders), *up* towards the gateway (acknowledgements). It reads what it carries and signs
//! nothing but with its own key. Carrying it out belongs to `adversary`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::attack::{Direction, Windowed, attacks};
use super::operator::Verb;
use super::value::{Count, Located, Millis, Seconds, Whole};

attacks! {
    /// Publications are not passed on.
    BrokerDrop {
        /// Only those about an order that asks this.
        #[serde(default)]
        only: Option<Verb>,
    }

    /// Publications are passed on later.
    BrokerDelay {
        /// By how much.
        by_ms: Millis,
        /// Only those about an order that asks this.
        #[serde(default)]
        only: Option<Verb>,
    }

    /// Each publication is held until the next of its direction has passed.
    BrokerReorder {
        /// Longest hold.
        hold_ms: Whole<1, 60_000>,
    }

    /// Each publication is delivered more than once.
    BrokerDuplicate {
        /// Copies beside the original.
        copies: Whole<1, 64>,
    }

    /// The newest publication of a subject is delivered again to each subscriber that connects.
    BrokerRetain {}
}

/// Captured publications are delivered again, the newest first and then back in turn.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BrokerReplay {
    /// Start on the trial's clock; the trial's phase is added.
    pub at_s: Located<Seconds>,
    /// Which way.
    #[serde(default)]
    pub direction: Direction,
    /// How many.
    pub count: Count,
    /// Time between them.
    pub every_ms: Millis,
}

/// Orders of the broker's own making.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BrokerInvent {
    /// Start on the trial's clock; the trial's phase is added.
    pub at_s: Located<Seconds>,
    /// What they ask.
    #[serde(rename = "do")]
    pub verb: Verb,
    /// What they are made of.
    pub forgery: OrderForgery,
    /// How many.
    pub count: Count,
    /// Time between them.
    pub every_ms: Millis,
}

/// For each order that is seen, an acknowledgement of the broker's own making: it was executed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BrokerForge {
    /// Start on the trial's clock; the trial's phase is added.
    pub at_s: Located<Seconds>,
    /// Length of the window.
    pub duration_s: Seconds,
    /// What it is made of.
    pub forgery: AckForgery,
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

macro_rules! windowed {
    ($($name:ident $length:expr;)+) => {$(
        impl Windowed for $name {
            fn at_s(&self) -> &Located<Seconds> {
                &self.at_s
            }
            fn duration_s(&self) -> Seconds {
                let length: fn(&Self) -> Seconds = $length;
                length(self)
            }
        }
    )+};
}

windowed! {
    BrokerReplay |_| Seconds::default();
    BrokerInvent |_| Seconds::default();
    BrokerForge |x| x.duration_s;
}
