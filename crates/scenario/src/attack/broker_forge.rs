//! `[[broker_forge]]`: the hostile broker publishes acknowledgements that it made itself.

use adversary::plan::{self, BrokerAction};
use evidence::Planned;
use instrument::Action;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Act, Attack, Injection, during, publications};
use crate::timed::timed;
use crate::{Direction, Seconds};

timed! {
    /// For each order that is seen, an acknowledgement of the broker's own making: it was executed.
    BrokerForge lasts duration_s needs Insider sees OnPath {
        /// Length of the window.
        duration_s: Seconds,
        /// Kind of the forgery.
        forgery: AckForgery,
    }
}

impl Attack for BrokerForge {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        let forgery = match self.forgery {
            AckForgery::OwnKey => plan::AckForgery::OwnKey,
            AckForgery::Altered => plan::AckForgery::Altered,
            AckForgery::Replayed => plan::AckForgery::Replayed,
        };
        Some(Act::Broker(during(self, Direction::Up, phase_ms, BrokerAction::Forge { forgery })))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Broker(Action::Inject)).taking(publications(Direction::Down, None)))
    }
}

/// Kind of a forged acknowledgement.
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
