//! The rogue station, and how long operators and teammates are admitted.
//!
//! A rogue holds somebody's signing key and gives orders with it: through a station of its own at the gateway, or under
//! a certificate at the broker. A thief holds a certificate and takes its session there. They are identities of their own;
//! no service knows them for what they are.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::operator::Values;
use super::timed::timed;
use super::value::{Count, Located, Millis, Name, Seconds, Whole};

timed! {
    /// A run of orders of the rogue station. All tables of a scenario are one rogue's: one key, one way, one certificate.
    Rogue needs Insider {
        /// Whose signing key it holds.
        holds: Located<Name>,
        /// By which way its orders go.
        way: Way,
        /// Under whose certificate it publishes at the broker; that of whose key it holds where nothing is said.
        #[serde(default)]
        certificate: Option<Located<Name>>,
        /// In whose name it orders; of whose key it holds where nothing is said.
        #[serde(default)]
        claims: Option<Located<Name>>,
        /// What it orders.
        order: Order,
        /// How many times.
        count: Count,
        /// Time between them.
        every_ms: Millis,
        /// How far the counter is run ahead with each.
        #[serde(default)]
        ahead: Whole<0, 9_000_000_000_000_000_000>,
        /// Under which id.
        #[serde(default)]
        id: OrderId,
        /// On which track, to arm or to confirm.
        #[serde(default)]
        track: OrderTrack,
        /// The values, where it orders to configure.
        #[serde(default)]
        values: Option<Values>,
    }
}

timed! {
    /// A thief holds a copy of somebody's certificate and takes that one's session at the broker. All tables of a scenario are
    /// one thief's.
    Takeover lasts duration_s needs Insider {
        /// For how long it has the session, or fights for it with whom it belongs to.
        duration_s: Seconds,
        /// Whose certificate it holds: the unit under test or the gateway.
        certificate: Located<Name>,
    }
}

/// By which way a rogue's orders go.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Way {
    /// Requests of the gateway, over a channel that is its own.
    Station,
    /// Publications at the broker, past the gateway.
    Broker,
}

/// Under which id a rogue orders.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum OrderId {
    /// The next.
    #[default]
    Next,
    /// The one that the unit counted last, of another order.
    Last,
    /// The next number in a boot before the operator's.
    OlderBoot,
}

/// On which track a rogue orders.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum OrderTrack {
    /// To arm the most confident vehicle, to confirm the one that authority is held on.
    #[default]
    Seen,
    /// The most confident vehicle on which no authority is held.
    Other,
}

/// What somebody orders who is no operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// To stop.
    Hold,
    /// To give up authority.
    Disarm,
    /// To begin.
    Enable,
    /// To go on after a stop.
    Resume,
    /// To take authority on the most confident vehicle.
    Arm,
    /// To use the authority that is held.
    Confirm,
    /// To set values.
    Configure,
}

/// An identity is admitted for a time only.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Mandate {
    /// Who: an operator or a teammate.
    pub who: Located<Name>,
    /// Until when, on the clock of whoever judges it, from its start.
    pub until_s: Seconds,
}
