//! Two runs side by side: whether they decided the same, and where each service first decided otherwise.
//!
//! Two runs in the twin are compared with their times. A live run never has the times of another, so that runs are compared by the
//! order of each service's own decisions: refusals, acceptances, modes, authority minted, orders executed. The age of an accepted record
//! belongs to the time and not to the order.

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

use std::collections::{BTreeMap, BTreeSet};

use ground_truth::Any;
use serde::Serialize;
use wire::event::Event;
use wire::id::NodeId;

use crate::log::{decision, hashes, kind_of};
use crate::{Micros, Witnessed};

/// Differences of two runs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// True if every event is the same, at the same time.
    pub same_log: bool,
    /// True if every decision is the same, at the same time.
    pub same_decisions: bool,
    /// True if every service made the same decisions in the same order.
    pub same_order: bool,
    /// The first decision that differs, for each service with one; by time in the first run.
    pub first: Vec<First>,
    /// Kinds of decisions of which there are not equally many.
    pub counts: Vec<Count>,
}

/// Place at which a service first decided otherwise.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct First {
    /// The service.
    pub node: NodeId,
    /// Number of equal decisions before.
    pub after: usize,
    /// Decision in the first run; none where there is no further one.
    pub a: Option<Decided>,
    /// Decision in the second run.
    pub b: Option<Decided>,
}

/// A decision and when it fell, microseconds from the start of its run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Decided {
    /// Time of the decision.
    pub at_us: Micros,
    /// The decision.
    pub event: Any,
}

/// Number of decisions of a kind.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Count {
    /// Service that takes it.
    pub node: NodeId,
    /// The kind, as it is named in the log.
    pub kind: String,
    /// Number in the first run and in the second.
    pub n: [u64; 2],
}

/// Compares two logs.
pub fn diff(a: &[Witnessed], b: &[Witnessed]) -> Difference {
    let ((log_a, decisions_a), (log_b, decisions_b)) = (hashes(a), hashes(b));
    let (by_node_a, by_node_b) = (decisions_by_node(a), decisions_by_node(b));
    let nodes: BTreeSet<NodeId> = by_node_a.keys().chain(by_node_b.keys()).copied().collect();
    let decisions_of = |by_node: &BTreeMap<NodeId, Vec<Decided>>, node| by_node.get(&node).cloned().unwrap_or_default();
    let each = || nodes.iter().map(|&node| (node, decisions_of(&by_node_a, node), decisions_of(&by_node_b, node)));
    let mut first: Vec<First> = each().filter_map(|(node, a, b)| first_difference(node, &a, &b)).collect();
    first.sort_by_key(|f| f.a.as_ref().or(f.b.as_ref()).map(|d| d.at_us));
    let counts = each().flat_map(|(node, a, b)| unequal_counts(node, &a, &b)).collect();
    let (same_log, same_decisions) = (log_a == log_b, decisions_a == decisions_b);
    Difference { same_log, same_decisions, same_order: first.is_empty(), first, counts }
}

/// Each service's decisions in their order, without parts that depend on time.
fn decisions_by_node(log: &[Witnessed]) -> BTreeMap<NodeId, Vec<Decided>> {
    let start = log.iter().map(|w| w.at).min().unwrap_or_default();
    let mut decisions: BTreeMap<NodeId, Vec<Decided>> = BTreeMap::new();
    for w in log {
        let Some(event) = decision(w.entry.event).map(without_age) else { continue };
        decisions.entry(w.entry.node).or_default().push(Decided { at_us: w.at - start, event });
    }
    decisions
}

fn without_age(event: Any) -> Any {
    match event {
        Any::Service(Event::Accepted { at, record, peer, age: _, waived }) => {
            Any::Service(Event::Accepted { at, record, peer, age: None, waived })
        }
        other => other,
    }
}

fn first_difference(node: NodeId, a: &[Decided], b: &[Decided]) -> Option<First> {
    let after = a.iter().zip(b).take_while(|(a, b)| a.event == b.event).count();
    let (a, b) = (a.get(after).cloned(), b.get(after).cloned());
    (a.is_some() || b.is_some()).then_some(First { node, after, a, b })
}

fn unequal_counts(node: NodeId, a: &[Decided], b: &[Decided]) -> Vec<Count> {
    let mut kinds: BTreeMap<String, [u64; 2]> = BTreeMap::new();
    for (i, run) in [a, b].into_iter().enumerate() {
        run.iter().for_each(|d| kinds.entry(kind_of(&d.event)).or_default()[i] += 1);
    }
    let unequal = kinds.into_iter().filter(|(_, [a, b])| a != b);
    unequal.map(|(kind, n)| Count { node, kind, n }).collect()
}

#[cfg(test)]
mod tests {
    use ground_truth::Entry;
    use wire::codec::Text;
    use wire::event::Interface;
    use wire::id::Boot;
    use wire::refusal::Reason;
    use wire::time::Instant;

    use super::*;

    fn refused(time: Micros, node: NodeId, reason: Reason) -> Witnessed {
        let event = Any::Service(Event::Refused { at: Interface::Uplink, peer: None, reason, detail: Text::default() });
        let entry = Entry { node, boot: Boot(1), counter: 1, at: Instant(time), event, previous: [0; 32] };
        Witnessed { at: time, entry }
    }

    #[test]
    fn equal_decisions_at_other_times_are_equal() {
        let a = [refused(5, NodeId::GATEWAY, Reason::Stale), refused(9, NodeId::UNIT_A, Reason::Origin)];
        // The other service came first, and all of it later.
        let b = [refused(70, NodeId::UNIT_A, Reason::Origin), refused(80, NodeId::GATEWAY, Reason::Stale)];
        let found = diff(&a, &b);
        assert_eq!((found.same_decisions, found.same_order), (false, true));
        assert!(found.first.is_empty() && found.counts.is_empty());
        let same = diff(&a, &a);
        assert!(same.same_log && same.same_decisions && same.same_order);
    }

    #[test]
    fn first_differing_decision_is_told_per_service() {
        let a = [refused(5, NodeId::GATEWAY, Reason::Stale), refused(9, NodeId::GATEWAY, Reason::Origin)];
        let b = [refused(5, NodeId::GATEWAY, Reason::Stale)];
        let found = diff(&a, &b);
        let [first] = found.first.as_slice() else { panic!("{found:?}") };
        assert_eq!((first.node, first.after, first.b.is_none()), (NodeId::GATEWAY, 1, true));
        assert_eq!(first.a.as_ref().map(|d| d.at_us), Some(4));
        assert_eq!(found.counts[0].kind, "refused: origin");
        assert_eq!(found.counts[0].n, [1, 0]);
    }
}
