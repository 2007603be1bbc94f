//! The twin's association, as trials use it.

use twin::net::{Arrival, Association as Modelled};
use wire::core::Side;
use wire::id::{PeerId, SessionId};
use wire::policy::Requirement;

use super::Association;

pub(super) struct Model {
    association: Modelled,
    /// Seen and refused, by end.
    guards: [(u64, u64); 2],
    /// Output of each end in its handshake and after it.
    said: [Vec<Vec<u8>>; 2],
}

impl Association for Model {
    fn open(guard: Requirement) -> Self {
        let (client, server) = ((0, SessionId(1), PeerId::UNIT_A), (1, SessionId(1), PeerId::GATEWAY));
        let mut model = Self {
            association: Modelled::new(client, server, None, guard, [7; 32]),
            guards: [(0, 0); 2],
            said: Default::default(),
        };
        model.reopen();
        model
    }

    fn reopen(&mut self) {
        self.said = [vec![self.association.begin().bytes], Vec::new()];
        let mut index = 1;
        while let Some(datagram) = self.said[1 - index].last().cloned() {
            let known = self.said[index].len();
            self.arrive(index, &datagram);
            if self.said[index].len() == known {
                break;
            }
            index = 1 - index;
        }
    }

    fn flights(&mut self, from: Side) -> Vec<Vec<u8>> {
        self.said[from as usize].clone()
    }

    fn send(&mut self, from: Side, record: &[u8]) -> Option<Vec<u8>> {
        self.association.seal(from as usize, record)
    }

    fn put(&mut self, side: Side, datagram: &[u8]) -> Vec<Vec<u8>> {
        self.arrive(side as usize, datagram)
    }

    fn guard(&self, side: Side) -> (u64, u64) {
        self.guards[side as usize]
    }

    fn wait(&mut self) {}
}

impl Model {
    fn arrive(&mut self, at: usize, datagram: &[u8]) -> Vec<Vec<u8>> {
        let come = self.association.arrive(at, datagram, 0);
        let mut delivered = Vec::new();
        for seen in come.seen {
            let guard = &mut self.guards[at];
            guard.0 += 1;
            match seen.arrival {
                Arrival::Delivered(record) => delivered.push(record),
                Arrival::Refused(_) => guard.1 += 1,
                Arrival::Ended => self.association.forget(at),
                Arrival::Discarded | Arrival::Handshake => {}
            }
        }
        self.said[at].extend(come.answer.map(|answer| answer.bytes));
        delivered
    }
}
