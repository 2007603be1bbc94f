//! Accounts that have to add up; and a trial is the same in every way of running it.

use std::collections::BTreeMap;

use wire::event::{Account, Interface};
use wire::id::NodeId;

use super::{Assertion, Facts, none, trial};

pub(super) const ALL: &[Assertion] = &[
    Assertion {
        name: "whatever_came_in_anywhere_was_accepted_or_refused",
        holds: |facts| none(unaccounted(facts)),
        examples: || (counted(1), counted(2)),
        carried_by: None,
    },
    Assertion {
        name: "forked_half_way_with_journals_kept_a_trial_decides_the_same",
        holds: |facts| {
            let (first, second) = (&facts.decisions, &facts.witness.decisions);
            none(
                (first != second).then(|| format!("decisions {first}, and {second} when it was run again from a fork")),
            )
        },
        examples: || {
            let other = Facts { decisions: "1".to_owned(), ..trial("path", &["cut"]) };
            (trial("path", &["cut"]), other)
        },
        carried_by: None,
    },
];

/// A node and interface at which more or less came in than was judged.
fn unaccounted(facts: &Facts) -> Option<String> {
    let mut sums: BTreeMap<(NodeId, Interface), (u64, u64)> = BTreeMap::new();
    for ((node, account), n) in &facts.witness.accounts {
        if let Account::Received(at) = account {
            sums.entry((*node, *at)).or_default().0 += n;
        }
        if let Account::Accepted(at) | Account::Refused(at, _) = account {
            sums.entry((*node, *at)).or_default().1 += n;
        }
    }
    let (interface, (received, judged)) = sums.into_iter().find(|(_, (received, judged))| received != judged)?;
    Some(format!("{} at {:?}: {received} came in, {judged} were judged", interface.0, interface.1))
}

/// A trial in which a given number of records came in and one was accepted.
fn counted(received: u64) -> Facts {
    let mut facts = trial("path", &["copy"]);
    facts.witness.accounts = BTreeMap::from([
        ((NodeId::GATEWAY, Account::Received(Interface::Requests)), received),
        ((NodeId::GATEWAY, Account::Accepted(Interface::Requests)), 1),
    ]);
    facts
}
