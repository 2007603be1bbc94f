//! The twin's association, as trials use it.

use campaign::twin::net::{Arrival, Association as Modelled};
use wire::core::Side;
use wire::id::{PeerId, SessionId};
use wire::policy::Requirement;

use super::Association;

pub(super) struct Model {
    association: Modelled,
    /// Seen and refused, by end.
    guards: [(u64, u64); 2],
}

impl Association for Model {
    fn open(guard: Requirement) -> Self {
        let (client, server) = ((0, SessionId(1), PeerId::UNIT_A), (1, SessionId(1), PeerId::GATEWAY));
        let mut model = Self { association: Modelled::new(client, server, None, guard, [7; 32]), guards: [(0, 0); 2] };
        model.reopen();
        model
    }

    fn reopen(&mut self) {
        let number = self.association.begin();
        assert!(self.association.complete(number));
    }

    fn send(&mut self, from: Side, record: &[u8]) -> Option<Vec<u8>> {
        self.association.seal(from as usize, record)
    }

    fn put(&mut self, at: Side, datagram: &[u8]) -> Vec<Vec<u8>> {
        let mut delivered = Vec::new();
        for seen in self.association.arrive(at as usize, datagram) {
            let guard = &mut self.guards[at as usize];
            guard.0 += 1;
            match seen.arrival {
                Arrival::Delivered(record) => delivered.push(record),
                Arrival::Refused(_) => guard.1 += 1,
                Arrival::Discarded | Arrival::Handshake | Arrival::Ended => {}
            }
        }
        delivered
    }

    fn guard(&self, at: Side) -> (u64, u64) {
        self.guards[at as usize]
    }

    fn wait(&mut self) {}
}
