//! Attacks by the holder of the command broker's certificate and key, in the broker's place.
//!
//! *Down* is towards the units (orders), *up* towards the gateway (acknowledgements). It reads what it carries and signs
//! nothing but with its own key. Carrying it out belongs to `adversary`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::attack::{Direction, attacks, windowed};
use super::rogue::Order;
use super::step::{Knowledge, Timing, When};
use super::value::{Count, Located, Millis, Name, Seconds, Whole};

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
    /// Name of the step that this is a part of.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step: Option<Located<Name>>,
    /// What it waits for; `at_s` is then the earliest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub when: Option<Located<When>>,
    /// What may be known here, where that is less than the scenario's level.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub knowledge: Option<Located<Knowledge>>,
}

/// Orders of the broker's own making.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BrokerInvent {
    /// Start on the trial's clock; the trial's phase is added.
    pub at_s: Located<Seconds>,
    /// What they ask.
    #[serde(rename = "do")]
    pub verb: Order,
    /// What they are made of.
    pub forgery: OrderForgery,
    /// How many.
    pub count: Count,
    /// Time between them.
    pub every_ms: Millis,
    /// Name of the step that this is a part of.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step: Option<Located<Name>>,
    /// What it waits for; `at_s` is then the earliest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub when: Option<Located<When>>,
    /// What may be known here, where that is less than the scenario's level.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub knowledge: Option<Located<Knowledge>>,
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
    /// Name of the step that this is a part of.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step: Option<Located<Name>>,
    /// What it waits for; `at_s` is then the earliest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub when: Option<Located<When>>,
    /// What may be known here, where that is less than the scenario's level.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub knowledge: Option<Located<Knowledge>>,
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

windowed! {
    BrokerReplay |_| Seconds::default(), Insider, Some(Knowledge::OnPath);
    BrokerInvent |_| Seconds::default(), Insider, Some(Knowledge::OnPath);
    BrokerForge |x| x.duration_s, Insider, Some(Knowledge::OnPath);
}
