//! Construction of a twin from a topology: the cores are made here from the very setups that a live run hands to
//! processes.

use std::sync::Arc;

use config::setup::Setup;
use topology::{Member, ProcessFault, ProcessFaultKind, Topology};
use wire::id::{NodeId, SessionId, WorldId};
use wire::policy::Requirement;
use wire::sign::Key;
use wire::sign::Secret;

use super::clock::HostClock;
use super::delay::Delays;
use super::holder::Client;
use super::net::Association;
use super::part::Part;
use super::part::baseline::Baseline;
use super::part::make::{AssemblyError, core};
use super::queue::NodeIndex;
use super::verified::Verified;
use super::{Assembly, Node};

/// Makes every core of `topology`, but for those that go along with `baseline`. `seed` drives the delays.
pub fn assemble(
    topology: &Topology,
    seed: u64,
    guard: Requirement,
    journals: bool,
    baseline: Option<&Arc<Baseline>>,
) -> Result<Assembly, AssemblyError> {
    let clocks: Vec<HostClock> = topology.clocks.iter().copied().map(HostClock::from).collect();
    let verified = baseline.map_or_else(Verified::default, |baseline| baseline.verified());
    let made = topology.members.iter().map(|member| {
        let along = baseline.and_then(|baseline| baseline.follow(member, WorldId(0)));
        let core =
            along.map_or_else(|| fresh(member, &clocks, &verified), |along| Ok(Part::Following(Box::new(along))))?;
        Ok(node(member, core))
    });
    let nodes = made.collect::<Result<Vec<_>, _>>()?;
    let index = |id: NodeId| nodes.iter().position(|n: &Node| n.id == id).map(|n| n as NodeIndex);
    let relay = index(NodeId::RELAY_TELEMETRY);
    let mut associations = Vec::new();
    for (i, link) in topology.links.iter().enumerate() {
        let end = |id: NodeId| {
            let member = topology.members.iter().find(|m| m.node() == id);
            let missing = || AssemblyError { node: id, why: "no such member with a certificate".into() };
            let peer = member.and_then(|m| m.peer).ok_or_else(missing)?;
            Ok((index(id).ok_or_else(missing)?, SessionId(i as u32 + 1), peer))
        };
        let secret =
            blake3::derive_key("holdsafe twin association v1", &[&seed.to_le_bytes()[..], &[i as u8]].concat());
        let between = relay.filter(|_| link.relayed);
        associations.push(Association::new(end(link.client)?, end(link.server)?, between, guard, secret));
    }
    let secret = blake3::derive_key("holdsafe twin command stream v1", &seed.to_le_bytes());
    let commands = index(NodeId::UNIT_A).zip(index(NodeId::RELAY_COMMAND)).map(|(unit, relay)| (unit, relay, secret));
    Ok(Assembly {
        commands,
        rights: topology.rights(),
        nodes,
        clocks,
        associations,
        delays: Delays::new(seed, topology.varied_delays),
        spare: topology.members.iter().filter(|m| restarts(topology, m.node())).cloned().collect(),
        process_faults: topology.process_faults.clone(),
        watched: topology.watched(),
        fills: topology.fills(),
        cues: topology.cues.clone(),
        journals,
        witnesses: topology.witnesses.iter().map(|(node, secret)| (*node, witness(secret, &verified))).collect(),
        verified,
        guest: None,
        bus_orders: topology.bus_orders.clone(),
    })
}

fn witness(secret: &Secret, verified: &Verified) -> Key {
    Key::from_bytes(&secret.0).told_to(verified.shared())
}

fn fresh(member: &Member, clocks: &[HostClock], verified: &Verified) -> Result<Part, AssemblyError> {
    let setup = Setup { verifier: Some(verified.shared()), ..member.setup.clone() };
    core(&member.role, setup, clocks[member.host as usize].read(0))
}

fn node(member: &Member, core: Part) -> Node {
    let mut node = Node::new(member.node(), core, member.host as u8);
    node.subscribes.clone_from(&member.subscribes);
    node.endpoint = member.endpoint;
    // The unit under test has its session over the modelled stream.
    let from_start = member.node() != NodeId::UNIT_A && !member.role.joins_later();
    node.commands = member.peer.filter(|_| member.commands).map(|peer| Client::new(peer, from_start));
    node.takes_cues = member.role.takes_cues();
    node
}

/// True if a killed `node` is started again.
fn restarts(topology: &Topology, node: NodeId) -> bool {
    let repeat = |o: &ProcessFault| o.node == node && matches!(o.kind, ProcessFaultKind::Kill { restart: Some(_) });
    topology.process_faults.iter().any(repeat)
}
