//! The unit under test, as a role: whose behaviour a run is judged by, and the services that are its own.
//!
//! A judge asks the role and names no unit. The casting of a run, and so the choice of the unit, is left to the topology.

use wire::id::{NodeId, PeerId, UnitId};

/// The unit under test with its parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Under {
    /// The unit.
    pub unit: UnitId,
    /// Its simulation, which has the plant and the truth.
    pub sim: NodeId,
    /// Its perception.
    pub perception: NodeId,
}

impl Under {
    /// Unit A with the simulation and the perception of its host.
    pub const A: Under = Under { unit: UnitId::A, sim: NodeId::SIM, perception: NodeId::PERCEPTION };

    /// The node that speaks for it.
    pub fn node(self) -> NodeId {
        self.unit.node()
    }

    /// Its certificate.
    pub fn peer(self) -> PeerId {
        self.unit.peer()
    }

    /// Observer at the ingress of its sessions.
    pub fn guard(self) -> Option<NodeId> {
        self.node().guard()
    }
}
