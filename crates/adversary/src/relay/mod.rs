//! Relays: in a path between two services that do not know of them, and without any key.
//!
//! `datagram` is in the telemetry path, `stream` in the command path, `passing` applies the plan to one
//! datagram, `forge` makes and damages bytes. Both keep
//! an account that balances at every instant: in + added = out + dropped + held, for each direction.

mod datagram;
mod forge;
mod passing;
mod stream;
#[cfg(test)]
mod tests;

use wire::core::Side;
use wire::event::{Account, Event};
use wire::time::Instant;

use crate::outbox::Outbox;

pub use datagram::DatagramRelay;
pub use stream::StreamRelay;

/// Both sides, in the order in which accounts are written.
const SIDES: [Side; 2] = [Side::Client, Side::Server];

/// Counts of arrivals, departures and losses, in datagrams or pieces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Tally {
    /// Came from a side.
    came: [u64; 2],
    /// Emitted towards a side.
    out: [u64; 2],
    /// Datagrams of each side that were dropped.
    dropped: [u64; 2],
    /// Made by the relay, towards a side.
    added: [u64; 2],
    /// Sent from an address of the relay's own.
    unknown_peers: u64,
}

impl Tally {
    /// Writes the closing account.
    fn write(&self, now: Instant, outbox: &mut Outbox) {
        for side in SIDES {
            let i = side as usize;
            let lines = [
                (Account::RelayIn(side), self.came[i]),
                (Account::RelayOut(side), self.out[i]),
                (Account::RelayDropped(side), self.dropped[i]),
                (Account::RelayAdded(side), self.added[i]),
            ];
            for (account, n) in lines {
                outbox.write(now, Event::Count { account, n });
            }
        }
        if self.unknown_peers > 0 {
            outbox.write(now, Event::Count { account: Account::RelayStranger, n: self.unknown_peers });
        }
    }
}
