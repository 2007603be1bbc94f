//! The real guard and DTLS library, between two ends in memory (`link::memory`), in paused time.

use std::time::Duration;

use link::guard::GuardMode;
use link::memory::{Pair, Party, clear};
use link::pki::{Authority, Role};
use wire::core::Side;
use wire::id::PeerId;
use wire::policy::Requirement;

use super::Association;

pub(super) struct Stack {
    parties: [Party; 2],
    pair: Pair,
    /// Output of each end in its handshake and after it.
    said: [Vec<Vec<u8>>; 2],
}

impl Association for Stack {
    fn open(guard: Requirement) -> Self {
        let authority = Authority::new().expect("an authority");
        let party = |peer, role| Party {
            guard: match guard {
                Requirement::Required => GuardMode::Required,
                Requirement::Waived => GuardMode::Waived,
            },
            ..Party::honest(authority.issue(peer, role).expect("a credential"))
        };
        let parties = [party(PeerId::UNIT_A, Role::Dials), party(PeerId::GATEWAY, Role::Listens)];
        let pair = handshake(&parties);
        Self { parties, pair, said: Default::default() }
    }

    fn reopen(&mut self) {
        self.pair = handshake(&self.parties);
        self.said = Default::default();
    }

    fn flights(&mut self, from: Side) -> Vec<Vec<u8>> {
        let buffers = self.pair.take(from);
        self.said[from as usize].extend(buffers);
        self.said[from as usize].clone()
    }

    fn send(&mut self, from: Side, record: &[u8]) -> Option<Vec<u8>> {
        self.pair.send(from, record)
    }

    fn put(&mut self, side: Side, datagram: &[u8]) -> Vec<Vec<u8>> {
        self.pair.put(side, datagram)
    }

    fn guard(&self, side: Side) -> (u64, u64) {
        let stats = self.pair.guard(side);
        (stats.records, stats.refused())
    }

    fn wait(&mut self) {
        self.pair.wait(Duration::from_secs(60));
    }
}

fn handshake(parties: &[Party; 2]) -> Pair {
    let [unit, gateway] = parties;
    let pair = Pair::open([unit, gateway], PeerId::GATEWAY, clear()).expect("a runtime");
    assert_eq!(pair.peer(Side::Server).expect("a handshake"), Some(PeerId::UNIT_A));
    pair
}
