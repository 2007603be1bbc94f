//! A trial without any action: the control from which a receipt has to tell the trial with it.

use adversary::AdversaryConfig;
use scenario::Scenario;
use sim::scene::Disguise;

use super::{MemberRole, Topology, attack};

impl Topology {
    /// The topology without any action. Relays pass traffic on. Insiders keep their place and misuse no credential. No
    /// part fails, no process is killed, suspended or short of disk, no object is disguised or printed on, and the
    /// recording is left alone. The link's own conditions stay, and so do the plans, for which the oracle must then
    /// find no receipt.
    #[must_use]
    pub fn disarmed(mut self, scenario: &Scenario) -> Topology {
        for member in &mut self.members {
            match &mut member.role {
                MemberRole::Sim(config) => {
                    config.faults.clear();
                    for object in &mut config.scene.objects {
                        (object.disguise, object.print) = (Disguise::default(), None);
                    }
                }
                MemberRole::Adversary(config) => idle(config, scenario),
                MemberRole::Perception(_)
                | MemberRole::Autonomy(_)
                | MemberRole::Gateway(_)
                | MemberRole::Console(_)
                | MemberRole::Recorder => {}
            }
        }
        self.process_faults.clear();
        self.tampering = None;
        self.cues.clear();
        self
    }
}

fn idle(config: &mut AdversaryConfig, scenario: &Scenario) {
    match config {
        AdversaryConfig::DatagramRelay(config) => config.actions = attack::conditions(scenario).collect(),
        AdversaryConfig::StreamRelay(config) => config.actions.clear(),
        AdversaryConfig::InsiderTeammate(config) => {
            config.forwards.clear();
            config.malformed.clear();
            config.resend = None;
            config.falsehoods.clear();
            config.confusions.clear();
        }
        AdversaryConfig::InsiderOperator(config) => config.orders.clear(),
        AdversaryConfig::InsiderBroker(config) => config.actions.clear(),
        AdversaryConfig::InsiderGateway(config) => config.actions.clear(),
        AdversaryConfig::Rogue(config) => config.moves.clear(),
        AdversaryConfig::SessionThief(config) => config.takeovers.clear(),
    }
}
