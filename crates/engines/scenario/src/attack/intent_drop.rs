//! `[[intent_drop]]`: the gateway insider keeps requests of the operator from the gateway.

use adversary::plan::FeedAction;
use evidence::{Planned, Takes};
use wire::command::OrderKind;

use super::{Act, Attack, Injection, during};
use crate::timed::timed;
use crate::{Direction, Seconds};

timed! {
    /// Requests of the operator do not reach the gateway.
    IntentDrop lasts duration_s needs Insider {
        /// Length of the window.
        duration_s: Seconds,
        /// Only this.
        #[serde(default)]
        only: Option<OrderKind>,
    }
}

impl Attack for IntentDrop {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        let action = FeedAction::Swallow { only: self.only };
        Some(Act::Feed(during(self, Direction::Both, phase_ms, action)))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Swallowed).taking(Takes::Orders(self.only.map(OrderKind::name))))
    }
}
