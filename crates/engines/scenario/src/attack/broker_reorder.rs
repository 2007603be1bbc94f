//! `[[broker_reorder]]`: the hostile broker lets publications overtake each other.

use adversary::plan::BrokerAction;
use evidence::Planned;
use ground_truth::Action;

use super::{Act, Attack, Injection, attacks, during, publications};
use crate::Whole;

attacks! {
    /// Each publication is held until the next of its direction has passed.
    BrokerReorder needs Insider {
        /// Longest hold.
        hold_ms: Whole<1, 60_000>,
    }
}

impl Attack for BrokerReorder {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        let action = BrokerAction::Reorder { hold_ms: self.hold_ms.unsigned() };
        Some(Act::Broker(during(self, self.direction, phase_ms, action)))
    }

    fn injection(&self) -> Option<Injection> {
        Some(
            Injection::new(Planned::Broker(Action::Reorder))
                .longer_by(self.hold_ms.unsigned())
                .taking(publications(self.direction, None)),
        )
    }
}
