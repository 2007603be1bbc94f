//! What does not change while a core lives: who it is, whose keys it knows, and the rules in force.

use wire::bounds::Bounds;
use wire::id::{Boot, NodeId, PeerId, UnitId};
use wire::mode::Guards;
use wire::policy::Policy;
use wire::setup::Setup;
use wire::sign::{Key, Keyring};

use crate::config::AutonomyConfig;

/// Shared by every part of a core, and by its forks.
#[derive(Debug)]
pub struct Identity {
    /// The unit.
    pub unit: UnitId,
    /// Its node.
    pub node: NodeId,
    /// How often it has started.
    pub boot: Boot,
    /// Its own key.
    pub key: Key,
    /// Everybody's public keys.
    pub keys: Keyring,
    /// Policy in force.
    pub policy: Policy,
    /// Guards that the policy waives.
    pub waived_guards: Guards,
    /// Bounds in force.
    pub bounds: Bounds,
    /// Who may grant leases.
    pub supervisor: PeerId,
    /// Whose claims are heard.
    pub teammates: Vec<UnitId>,
}

impl Identity {
    /// From the setup and configuration of a core.
    pub fn new(setup: &Setup, config: &AutonomyConfig) -> Self {
        Identity {
            unit: config.unit,
            node: setup.node,
            boot: setup.boot,
            key: setup.key(),
            keys: setup.keyring(),
            policy: setup.policy.clone(),
            waived_guards: setup.policy.waived_guards(),
            bounds: setup.bounds,
            supervisor: config.supervisor,
            teammates: config.teammates.clone(),
        }
    }
}
