//! A service's account: how many records each interface received, accepted and refused by reason.
//!
//! Conservation (received = accepted + Σ refused) holds by use: one `received` and one verdict for each record. Adding
//! up the accounts of several services is left to the oracle.

use std::collections::{BTreeMap, VecDeque};

use crate::audit::Journal;
use crate::codec::Text;
use crate::core::Output;
use crate::event::{Account, Event, Interface};
use crate::id::PeerId;
use crate::refusal::Refusal;
use crate::time::Instant;

/// Refusals of one shared-memory interface that are logged one by one; later ones are only counted. A writer to a
/// segment is as fast as memory, with no handshake before it and no key needed to be refused: each entry would be
/// hashed, recorded and signed for. This many show the sender and the content; of more, the count is enough, and the
/// closing account gives it. Other interfaces have a link's pace or their own rate.
pub const WRITTEN_REFUSALS: u64 = 256;

/// Counters by account.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Accounts(BTreeMap<Account, u64>);

impl Accounts {
    /// Counts one more of `account`.
    pub fn count(&mut self, account: Account) {
        *self.0.entry(account).or_default() += 1;
    }

    /// The count so far.
    pub fn total(&self, account: Account) -> u64 {
        self.0.get(&account).copied().unwrap_or_default()
    }

    /// A record was delivered to `interface` and accepted there.
    pub fn accepted(&mut self, interface: Interface) {
        self.count(Account::Received(interface));
        self.count(Account::Accepted(interface));
    }

    /// A record was delivered to `at` and refused there; gives the event that reports it, where it is to be written.
    pub fn refused(&mut self, at: Interface, peer: Option<PeerId>, refusal: &Refusal) -> Option<Event> {
        let reason = refusal.reason();
        self.count(Account::Received(at));
        self.count(Account::Refused(at, reason));
        let refused = self.total(Account::Received(at)) - self.total(Account::Accepted(at));
        let written = !matches!(at, Interface::Bus(_)) || refused <= WRITTEN_REFUSALS;
        written.then(|| Event::Refused { at, peer, reason, detail: Text::new(&refusal.to_string()) })
    }

    /// Writes the closing account, in the order of [`Account`].
    pub fn close(&self, now: Instant, journal: &mut Journal, out: &mut VecDeque<Output>) {
        for (account, n) in &self.0 {
            journal.write(now, Event::Count { account: *account, n: *n }, out);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Topic;
    use crate::id::NodeId;
    use crate::refusal::Reason;

    /// The bound is one for each interface.
    #[test]
    fn bus_refusals_are_logged_boundedly_then_counted() {
        let mut accounts = Accounts::default();
        let refusal = |n: &u64| {
            if n.is_multiple_of(2) { Refusal::Tag { expected: NodeId::SIM } } else { Refusal::Schema { at: 0 } }
        };
        let mut written =
            |interface, n: u64| (0..n).filter(|n| accounts.refused(interface, None, &refusal(n)).is_some()).count();
        let (seals, tracks) = (Interface::Bus(Topic::Seals), Interface::Bus(Topic::Tracks));
        assert_eq!(written(seals, 1000), 256);
        assert_eq!(written(tracks, 1), 1, "another channel has a bound of its own");
        assert_eq!(written(Interface::Uplink, 1000), 1000);
        accounts.accepted(seals);
        let total_of = |account| accounts.total(account);
        let refused = Reason::ALL.iter().map(|reason| total_of(Account::Refused(seals, *reason))).sum::<u64>();
        assert_eq!((total_of(Account::Received(seals)), total_of(Account::Accepted(seals)), refused), (1001, 1, 1000));
    }
}
