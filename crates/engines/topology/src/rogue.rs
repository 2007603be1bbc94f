//! Conversion of a scenario's tables on shared memory to the rogue that carries them out: its host, its keys, its
//! actions.

use adversary::plan::RogueConfig;
use scenario::{Act, Holder, Scenario};
use wire::core::Topic;
use wire::id::NodeId;

use super::{Host, attack};

/// A rogue and its place on a host.
pub(super) struct Casting {
    /// Host.
    pub(super) host: Host,
    /// Identity in the log.
    pub(super) node: NodeId,
    /// Node of the keys it holds.
    pub(super) holder: Option<NodeId>,
    /// The channels it hears and writes.
    pub(super) topics: Vec<Topic>,
    /// Its actions.
    pub(super) config: RogueConfig,
}

/// The rogue of a scenario, when it has one. All its tables agree on host and holder (`scenario::check`).
pub(super) fn casting(s: &Scenario, phase: u64) -> Option<Casting> {
    let acts = attack::acts(s, phase).filter_map(|act| {
        let Act::Rogue { channel, holder, plan } = act else { return None };
        Some((channel, holder, plan))
    });
    let all: Vec<_> = acts.collect();
    let (first, holder, _) = all.first()?;
    let mut topics: Vec<Topic> = all.iter().map(|(channel, ..)| *channel).collect();
    topics.sort();
    topics.dedup();
    Some(Casting {
        host: if scenario::on_control(*first) { Host::Control } else { Host::VehicleA },
        node: if *holder == Some(Holder::Perception) { NodeId::INSIDER_PERCEPTION } else { NodeId::IMPOSTOR },
        holder: holder.map(Holder::node),
        topics,
        config: RogueConfig { moves: all.into_iter().map(|(_, _, plan)| plan).collect() },
    })
}
