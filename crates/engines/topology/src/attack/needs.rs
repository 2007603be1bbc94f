//! Conditions for an injection to arrive: processes that run, and a message to take hold of.

use evidence::{Needs, Planned, Takes};
use ground_truth::Action;
use sim::fault::is_imaging;
use wire::id::NodeId;

/// Both ends of the telemetry link and the relay between them.
const LINK: &[NodeId] = &[NodeId::RELAY_TELEMETRY, NodeId::GATEWAY, NodeId::UNIT_A];
/// Members of the command plane.
const PLANE: &[NodeId] = &[NodeId::BROKER, NodeId::GATEWAY, NodeId::UNIT_A];
/// Processes that are killed or stopped.
static PROCESSES: [NodeId; 8] = [
    NodeId::SIM,
    NodeId::PERCEPTION,
    NodeId::UNIT_A,
    NodeId::GATEWAY,
    NodeId::BROKER,
    NodeId::CONSOLE,
    NodeId::RECORDER,
    NodeId::RELAY_TELEMETRY,
];
/// Publications that a stopped broker would have passed on.
const ANYTHING: Takes = Takes::Publications { to: None, asks: None, ever: false };

/// Needs of a planned injection, without the takes of its table.
pub(super) fn needs_of(planned: Planned) -> Needs {
    let (running, takes): (&[NodeId], _) = match planned {
        // An injection brings its bytes along, and either end may take them.
        Planned::Action(Action::Inject) => (&[NodeId::RELAY_TELEMETRY], None),
        Planned::Action(Action::Forward | Action::Resend | Action::Lie | Action::Confuse) | Planned::Malformed => {
            (&[NodeId::GATEWAY], None)
        }
        // The readers depend on the channel: the table of the attack names them.
        Planned::Action(Action::Forge | Action::Republish) => (&[], None),
        Planned::Action(_) => (LINK, None),
        Planned::Stream(_) | Planned::Broker(_) => (PLANE, None),
        Planned::Feed(_) | Planned::Late(_) => (&[NodeId::GATEWAY, NodeId::CONSOLE, NodeId::UNIT_A], None),
        Planned::Swallowed => (&[NodeId::GATEWAY, NodeId::CONSOLE], None),
        Planned::Fault(sensor, _) if is_imaging(sensor) => (&[NodeId::SIM, NodeId::PERCEPTION], None),
        Planned::Fault(..) => (&[NodeId::SIM, NodeId::UNIT_A], None),
        // Perception without the sim's input does the same whether it runs or not.
        Planned::Suspend(NodeId::PERCEPTION) => (&[NodeId::PERCEPTION, NodeId::SIM], None),
        Planned::Suspend(NodeId::BROKER) => (itself(NodeId::BROKER), Some(ANYTHING)),
        Planned::Kill(node) | Planned::Suspend(node) | Planned::Fill(node) => (itself(node), None),
        Planned::Takeover(_) => (PLANE, None),
        Planned::Disguise(..) | Planned::Print(..) | Planned::Perturbation(_) => (&[], None),
        // The guest's adapter needs no service. The needs depend on the way of the rogue's orders.
        Planned::GuestBus(_) | Planned::Rogue | Planned::Step(_) => (&[], None),
    };
    Needs { running, takes }
}

fn itself(node: NodeId) -> &'static [NodeId] {
    PROCESSES.iter().find(|node_id| **node_id == node).map(std::slice::from_ref).unwrap_or_default()
}
