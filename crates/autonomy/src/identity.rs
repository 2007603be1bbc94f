//! Constants of a core's life: its identity, the keys it knows, and the rules in force.

use config::platform::Limits;
use config::setup::Setup;
use wire::bounds::Bounds;
use wire::id::{Boot, NodeId, PeerId, UnitId};
use wire::mode::Guards;
use wire::policy::Policy;
use wire::roster::RosterError;
use wire::sign::{Key, Keyring};

use crate::config::AutonomyConfig;

/// Constants that every part of a core shares, its forks included.
#[derive(Debug)]
pub struct Identity {
    /// The unit that this core decides for.
    pub unit: UnitId,
    /// Node of the unit.
    pub node: NodeId,
    /// Number of starts of the node.
    pub boot: Boot,
    /// Signing key of the node.
    pub key: Key,
    /// Public keys of every node of the run.
    pub keys: Keyring,
    /// Policy in force.
    pub policy: Policy,
    /// Guards that the policy waives.
    pub waived_guards: Guards,
    /// Bounds in force.
    pub bounds: Bounds,
    /// The platform's limits of guards and driving.
    pub limits: Limits,
    /// Peer that may grant leases.
    pub supervisor: PeerId,
    /// Units from which claims are heard.
    pub teammates: Vec<UnitId>,
}

impl Identity {
    /// Identity from the setup and configuration of a core.
    ///
    /// # Errors
    /// An unsound table of identities, or a teammate or operator that the table does not name.
    pub fn new(setup: &Setup, config: &AutonomyConfig) -> Result<Self, RosterError> {
        let keys = setup.keyring()?;
        keys.cast("teammates", config.teammates.iter().map(|unit| unit.node()))?;
        keys.cast("operators", config.operators.iter().copied())?;
        Ok(Identity {
            unit: config.unit,
            node: setup.node,
            boot: setup.boot,
            key: setup.key(),
            keys,
            policy: setup.policy.clone(),
            waived_guards: setup.policy.waived_guards(),
            bounds: setup.bounds,
            limits: config.limits,
            supervisor: config.supervisor,
            teammates: config.teammates.clone(),
        })
    }
}
