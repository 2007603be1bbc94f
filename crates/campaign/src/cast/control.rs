//! The same trial with nobody who acts: what a receipt has to tell from the trial in which somebody did.

use super::{Cast, Role, attack};
use crate::scenario::Scenario;

impl Cast {
    /// The same cast with idle hands: relays pass, insiders keep their place and misuse nothing, nothing fails and nobody is
    /// killed or kept from running. The link's own weather stays, and so does what was planned.
    #[must_use]
    pub fn disarmed(mut self, scenario: &Scenario) -> Cast {
        for member in &mut self.members {
            match &mut member.role {
                Role::Sim(config) => config.faults.clear(),
                Role::DatagramRelay(config) => config.actions = attack::conditions(scenario).collect(),
                Role::StreamRelay(config) => config.actions.clear(),
                Role::InsiderTeammate(config) => {
                    config.forward = None;
                    config.malformed.clear();
                    config.resend = None;
                    config.falsehoods.clear();
                    config.confusions.clear();
                }
                Role::InsiderOperator(config) => config.orders.clear(),
                Role::InsiderBroker(config) => config.actions.clear(),
                Role::InsiderGateway(config) => config.actions.clear(),
                Role::Rogue(config) => config.moves.clear(),
                Role::Perception(_) | Role::Autonomy(_) | Role::Gateway(_) | Role::Console(_) | Role::Recorder => {}
            }
        }
        self.ordeals.clear();
        self.cues.clear();
        self
    }
}
