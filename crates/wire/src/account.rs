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

/// Counters by account.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Accounts(BTreeMap<Account, u64>);

impl Accounts {
    /// Adds one.
    pub fn count(&mut self, account: Account) {
        *self.0.entry(account).or_default() += 1;
    }

    /// The count so far.
    pub fn of(&self, account: Account) -> u64 {
        self.0.get(&account).copied().unwrap_or_default()
    }

    /// A record was delivered to `at` and accepted there.
    pub fn accepted(&mut self, at: Interface) {
        self.count(Account::Received(at));
        self.count(Account::Accepted(at));
    }

    /// A record was delivered to `at` and refused there; gives the event that says so.
    pub fn refused(&mut self, at: Interface, peer: Option<PeerId>, refusal: &Refusal) -> Event {
        let reason = refusal.reason();
        self.count(Account::Received(at));
        self.count(Account::Refused(at, reason));
        Event::Refused { at, peer, reason, detail: Text::new(&refusal.to_string()) }
    }

    /// Writes the closing account, in the order of [`Account`].
    pub fn close(&self, now: Instant, journal: &mut Journal, out: &mut VecDeque<Output>) {
        for (account, n) in &self.0 {
            journal.write(now, Event::Count { account: *account, n: *n }, out);
        }
    }
}
