//! One core from the setup that a live run hands to its process.

use adversary::Adversary;
use autonomy::Autonomy;
use config::setup::Setup;
use console::Console;
use gateway::Gateway;
use perception::Perception;
use sim::Sim;
use topology::{Member, MemberRole, sim_keys};
use wire::audit::Recorder;
use wire::id::NodeId;
use wire::time::Instant;

use super::Part;

/// A core could not be made from its setup.
#[derive(Debug, thiserror::Error)]
#[error("{node}: {why}")]
pub struct AssemblyError {
    pub(crate) node: NodeId,
    pub(crate) why: String,
}

/// A core as it starts at `now` on its host's clock. The core shares no state with another and verifies every signature
/// itself.
pub fn part(member: &Member, now: Instant) -> Result<Part, AssemblyError> {
    core(&member.role, member.setup.clone(), now)
}

/// The core of `role`, made from `setup` at `now`.
pub(crate) fn core(role: &MemberRole, setup: Setup, now: Instant) -> Result<Part, AssemblyError> {
    let node = setup.node;
    let failed = |why: String| AssemblyError { node, why };
    Ok(match role {
        MemberRole::Sim(config) => {
            let keys = sim_keys(&setup);
            Part::Sim(Box::new(Sim::new(config, keys, Some(setup.key()), now).map_err(|e| failed(e.to_string()))?))
        }
        MemberRole::Perception(config) => {
            let core = Perception::new(setup, config.clone(), now).map_err(|e| failed(e.to_string()))?;
            Part::Perception { core: Box::new(core), rendered: config.rendered }
        }
        MemberRole::Autonomy(config) => {
            Part::Autonomy(Box::new(Autonomy::new(setup, config.clone(), now).map_err(|e| failed(e.to_string()))?))
        }
        MemberRole::Gateway(config) => {
            Part::Gateway(Box::new(Gateway::new(setup, config.clone(), now).map_err(|e| failed(e.to_string()))?))
        }
        MemberRole::Console(config) => {
            Part::Console(Box::new(Console::new(setup, config.clone(), now).map_err(|e| failed(e.to_string()))?))
        }
        MemberRole::Recorder => {
            let seals = setup.channels.first().ok_or_else(|| failed("no channel for seals".into()))?.key.clone();
            Part::Recorder(Box::new(Recorder::new(setup.boot, setup.key(), seals, now)))
        }
        MemberRole::Adversary(config) => {
            Part::Adversary(Adversary::new(setup, config.clone(), now).map_err(|e| failed(e.to_string()))?)
        }
    })
}
