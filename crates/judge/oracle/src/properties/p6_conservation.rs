//! P6: records sent, added and dropped add up with those that arrived, were refused and were accepted, from separate
//! processes' accounts.
//!
//! Datagrams from outside of the run are in none of them: each end counts those apart. The kernel drops datagrams at a socket
//! unread, so that their sender is not known; a sum that does not add up beside both is INVALID, with a remark on the two numbers.

use std::collections::BTreeMap;

use evidence::Evidence;
use ground_truth::Any;
use wire::core::Side;
use wire::event::{Account, Event, Interface};
use wire::id::NodeId;

use super::{Finding, Property, finding};
use crate::facts::Facts;

type Accounts = BTreeMap<(NodeId, Account), u64>;

/// Adds up the closing accounts. A killed process closes none, and its path is left out.
pub(super) fn check(facts: &Facts) -> Vec<Finding> {
    let evidence = facts.evidence;
    let accounts = closing_accounts(evidence);
    let end = evidence.duration;
    let mut found = Vec::new();
    let mut equal = |balance: &str, left: i128, right: i128| {
        if left != right {
            found.push(finding(Property::P6, end, format!("{balance}: {left} on one side, {right} on the other")));
        }
    };
    let alive = |nodes: &[NodeId]| nodes.iter().all(|n| !evidence.killed.contains(n));
    let n = |node: NodeId, account: Account| i128::from(*accounts.get(&(node, account)).unwrap_or(&0));
    let ends = [
        (evidence.under.node(), NodeId::GATEWAY, Side::Client, Interface::Uplink),
        (NodeId::GATEWAY, evidence.under.node(), Side::Server, Interface::Downlink),
    ];
    for (from, to, side, interface) in ends {
        if !alive(&[from, to, NodeId::RELAY_TELEMETRY]) {
            continue;
        }
        let relay = NodeId::RELAY_TELEMETRY;
        let forwarded = n(relay, Account::RelayIn(side)) + n(relay, Account::RelayAdded(side.opposite()))
            - n(relay, Account::RelayDropped(side));
        equal(&format!("relay, {from} to {to}"), forwarded, n(relay, Account::RelayOut(side.opposite())));
        let delivered = n(to, Account::Received(interface));
        equal(&format!("{to} delivered and judged"), delivered, judged_records(&accounts, to, interface));
    }
    // Each of these sends to the gateway: without the account of one the sum has no sense.
    if alive(&[NodeId::RELAY_TELEMETRY, NodeId::INSIDER_B, NodeId::UNIT_C]) {
        for (from, to, side, _) in ends.into_iter().filter(|(from, to, ..)| alive(&[*from, *to])) {
            let (left, arrived) = crossed_datagrams(&accounts, to, side.opposite());
            let remark = outsiders_remark(&accounts, to);
            equal(&format!("datagrams of relay and others, {from} to {to}{remark}"), left, arrived);
        }
    }
    for (node, guard) in [evidence.under.node(), NodeId::GATEWAY].into_iter().filter_map(|x| Some((x, x.guard()?))) {
        if !alive(&[node]) {
            continue;
        }
        let left = n(guard, Account::GuardIn) - n(guard, Account::GuardRefused) - n(guard, Account::Delivered);
        let right = n(guard, Account::Discarded) + n(guard, Account::Handshake);
        equal(&format!("guard of {node}"), left, right);
        let interface = if node == NodeId::GATEWAY { Interface::Uplink } else { Interface::Downlink };
        let received = n(node, Account::Received(interface));
        equal(&format!("{node} out of the session and into the core"), n(guard, Account::Delivered), received);
    }
    found
}

/// Number of datagrams that left for `to`, on `side` of the relay, and of those that came there: each was before its guard, or is
/// counted where it was lost. Handshakes and unknown peers included; datagrams that others sent directly come in at the gateway.
fn crossed_datagrams(accounts: &Accounts, to: NodeId, side: Side) -> (i128, i128) {
    let n = |node: NodeId, account: Account| i128::from(*accounts.get(&(node, account)).unwrap_or(&0));
    let relay = NodeId::RELAY_TELEMETRY;
    let mut left = n(relay, Account::RelayOut(side)) - n(NodeId::CAMPAIGN, Account::RelayUnsent(side));
    if to == NodeId::GATEWAY {
        let direct = accounts.iter().filter(|((_, account), _)| *account == Account::SentDirect);
        left += n(relay, Account::RelayStranger) + direct.map(|(_, n)| i128::from(*n)).sum::<i128>();
    }
    let guard = to.guard().unwrap_or(to);
    let arrived = [Account::Datagrams, Account::Unguarded, Account::KernelDropped].map(|account| n(guard, account));
    (left, arrived.into_iter().sum())
}

/// Remark on a sum in which the kernel may have dropped datagrams of outsiders.
fn outsiders_remark(accounts: &Accounts, to: NodeId) -> String {
    let n = |account| *accounts.get(&(to.guard().unwrap_or(to), account)).unwrap_or(&0);
    match (n(Account::Outsiders), n(Account::KernelDropped)) {
        (0, _) | (_, 0) => String::new(),
        (outsiders, dropped) => format!(
            " ({outsiders} of outsiders are counted apart; of {dropped} that the kernel dropped nobody knows whose they were)"
        ),
    }
}

fn closing_accounts(evidence: &Evidence) -> Accounts {
    let mut accounts = Accounts::new();
    for w in &evidence.entries {
        if let Any::Service(Event::Count { account, n }) = w.entry.event {
            accounts.insert((w.entry.node, account), n);
        }
    }
    accounts
}

fn judged_records(accounts: &Accounts, node: NodeId, interface: Interface) -> i128 {
    let of_interface = |account: &Account| match *account {
        Account::Accepted(i) | Account::Refused(i, _) => i == interface,
        Account::Sent
        | Account::Received(_)
        | Account::RelayIn(_)
        | Account::RelayOut(_)
        | Account::RelayDropped(_)
        | Account::RelayAdded(_)
        | Account::RelayStranger
        | Account::GuardIn
        | Account::GuardRefused
        | Account::Delivered
        | Account::Discarded
        | Account::Handshake
        | Account::KernelDropped
        | Account::RelayUnsent(_)
        | Account::SentDirect
        | Account::Datagrams
        | Account::Unguarded
        | Account::Outsiders => false,
    };
    accounts.iter().filter(|((n, a), _)| *n == node && of_interface(a)).map(|(_, n)| i128::from(*n)).sum()
}
