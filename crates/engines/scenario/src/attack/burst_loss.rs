//! `[[burst_loss]]`: the relay without a key loses telemetry datagrams in bursts.

use adversary::plan::DatagramAction;
use evidence::{Planned, Takes};
use ground_truth::Action;

use super::{Act, Attack, Injection, attacks, during};
use crate::Share;

attacks! {
    /// Loses datagrams in bursts (Gilbert-Elliott): two states, one of which loses.
    BurstLoss {
        /// Probability to enter the losing state, at each datagram.
        enter: Share,
        /// Probability to leave it.
        leave: Share,
        /// Probability of loss while in it.
        share: Share,
    }
}

impl Attack for BurstLoss {
    fn act(&self, phase_ms: u64) -> Option<Act> {
        let action = DatagramAction::BurstLoss {
            enter_permille: self.enter.permille(),
            leave_permille: self.leave.permille(),
            loss_permille: self.share.permille(),
        };
        Some(Act::Datagram(during(self, self.direction, phase_ms, action)))
    }

    fn injection(&self) -> Option<Injection> {
        Some(Injection::new(Planned::Action(Action::Drop)).taking(Takes::Records(self.direction.side())))
    }
}
