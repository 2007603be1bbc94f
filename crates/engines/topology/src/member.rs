//! A participant: its host, its role, its reads and writes.

use adversary::plan::AdversaryConfig;
use autonomy::AutonomyConfig;
use config::setup::Setup;
use console::ConsoleConfig;
use gateway::GatewayConfig;
use perception::PerceptionConfig;
use sim::SimConfig;
use wire::core::Topic;
use wire::id::{NodeId, PeerId};

/// A host: its nodes share a clock and shared memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Host {
    /// Unit A with its sim and perception, and the recorder.
    VehicleA,
    /// Gateway, broker and console.
    Control,
    /// The insider who holds unit B's credentials.
    Insider,
    /// Unit C.
    VehicleC,
    /// The relays.
    Adversary,
}

impl Host {
    /// Every host, in the order of the clock table.
    pub const ALL: [Host; 5] = [Host::VehicleA, Host::Control, Host::Insider, Host::VehicleC, Host::Adversary];
}

/// Role of a participant.
#[derive(Clone, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "a run has one of each role, made where it begins")]
pub enum MemberRole {
    /// World, plant and sensors.
    Sim(SimConfig),
    /// Detector stages, corroboration, tracks.
    Perception(PerceptionConfig),
    /// The state machine of a unit.
    Autonomy(AutonomyConfig),
    /// The trust boundary of the control domain.
    Gateway(GatewayConfig),
    /// Display model and scripted operator.
    Console(ConsoleConfig),
    /// Follows and seals every chain.
    Recorder,
    /// An adversary in one of its roles.
    Adversary(AdversaryConfig),
}

/// Endpoint of a participant on the shared memory of its host. With a gateway insider, messages from the gateway and
/// messages for it are on channels *inside*, which the insider alone joins to those that everybody else uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BusEndpoint {
    /// Keys of the channels that all members use.
    #[default]
    Outside,
    /// Keys of the inner channels: of the honest half of a gateway.
    Inside,
    /// On both: it takes the feed from inside and brings intents there.
    Between,
}

impl BusEndpoint {
    /// True if it reads `topic` inside.
    pub fn reads_inside(self, topic: Topic) -> bool {
        self == BusEndpoint::Inside || (self == BusEndpoint::Between && topic == Topic::Feed)
    }

    /// True if it writes `topic` inside.
    pub fn writes_inside(self, topic: Topic) -> bool {
        self == BusEndpoint::Inside || (self == BusEndpoint::Between && topic == Topic::Intents)
    }
}

/// One process or core.
#[derive(Clone, Debug)]
pub struct Member {
    /// Host that it runs on.
    pub host: Host,
    /// Its role.
    pub role: MemberRole,
    /// Setup that every core is made from.
    pub setup: Setup,
    /// Channels it reads.
    pub subscribes: Vec<Topic>,
    /// Channels it writes.
    pub publishes: Vec<Topic>,
    /// Its certificate.
    pub peer: Option<PeerId>,
    /// True if it is connected to the broker.
    pub commands: bool,
    /// Endpoint on its host's shared memory.
    pub endpoint: BusEndpoint,
}

impl Member {
    /// Identity.
    pub fn node(&self) -> NodeId {
        self.setup.node
    }

    /// The member started again when the run has lasted for `ran` microseconds. Validity is judged from the start of its judge;
    /// it does not begin again with a restart.
    #[must_use]
    pub fn restarted(&self, ran: u64) -> Member {
        let mut member = self.clone();
        let mandates = match &mut member.role {
            MemberRole::Autonomy(config) => &mut config.mandates,
            MemberRole::Gateway(config) => &mut config.mandates,
            MemberRole::Sim(_)
            | MemberRole::Perception(_)
            | MemberRole::Console(_)
            | MemberRole::Recorder
            | MemberRole::Adversary(_) => {
                return member;
            }
        };
        mandates.iter_mut().for_each(|mandate| mandate.until_ms = mandate.until_ms.saturating_sub(ran.div_ceil(1000)));
        member
    }
}

impl MemberRole {
    /// True if it connects to the broker only when its core asks for it.
    pub fn joins_later(&self) -> bool {
        matches!(self, MemberRole::Adversary(AdversaryConfig::SessionThief(_)))
    }

    /// True if its core has steps that can be called: the adversaries', and the sensor faults of the sim.
    pub fn takes_cues(&self) -> bool {
        match self {
            MemberRole::Sim(config) => config.faults.iter().any(|fault| fault.waits_ms.is_some()),
            MemberRole::Adversary(config) => !matches!(config, AdversaryConfig::Rogue(_)),
            MemberRole::Perception(_)
            | MemberRole::Autonomy(_)
            | MemberRole::Gateway(_)
            | MemberRole::Console(_)
            | MemberRole::Recorder => false,
        }
    }
}
