//! The sealed log: without a recorder that seals this unit's decisions, there is no authority.
//!
//! A seal counts while it is recent and reaches as far as the unit's own log did one limit ago: a recorder that lives
//! but leaves this unit's entries out is as good as none.

use std::collections::VecDeque;

use wire::audit::Seal;
use wire::id::{Boot, NodeId};
use wire::mode::Because;
use wire::time::{Instant, Span};

/// Marks kept; at one each control period they reach back further than any seal limit.
const MARKS: usize = 64;

/// Length of the log, and the extent to which it is sealed.
#[derive(Clone, Debug)]
pub struct Seals {
    node: NodeId,
    boot: Boot,
    limit: Span,
    /// Length of the own log at past moments, oldest first.
    marks: VecDeque<(Instant, u64)>,
    sealed: Option<(Instant, u64)>,
    /// The oldest mark that no seal covers, where it is no longer among `marks`.
    behind: Option<(Instant, u64)>,
}

impl Seals {
    /// Seals over the log of `node` in `boot`; a seal may be at most `limit` old.
    pub fn new(node: NodeId, boot: Boot, limit: Span) -> Self {
        Seals { node, boot, limit, marks: VecDeque::with_capacity(MARKS), sealed: None, behind: None }
    }

    /// Notes how long the own log is now.
    pub fn mark(&mut self, now: Instant, entries: u64) {
        if self.marks.len() == MARKS {
            let (_, sealed) = self.sealed.unwrap_or_default();
            let uncovered = self.marks.pop_front().filter(|(_, entries)| *entries > sealed);
            self.behind = self.behind.or(uncovered);
        }
        self.marks.push_back((now, entries));
    }

    /// Takes an accepted seal.
    pub fn take(&mut self, received: Instant, seal: &Seal) {
        // A head of an earlier boot does not count: its counter belongs to another log.
        let our_head = seal.heads.iter().find(|head| head.node == self.node && head.boot == self.boot);
        if let Some(head) = our_head {
            self.sealed = Some((received, head.counter));
            self.behind = self.behind.filter(|(_, entries)| *entries > head.counter);
        }
    }

    /// Time for which the own log has been without a seal over all of it, at least since the newest came; none before
    /// the first. An entry without one for just the limit is so for too long.
    pub fn age(&self, now: Instant) -> Option<Span> {
        let (time, sealed) = self.sealed?;
        let marks = self.behind.iter().chain(&self.marks);
        let uncovered = marks.clone().find(|(_, entries)| *entries > sealed);
        let uncovered = uncovered.map_or(Span::ZERO, |(then, _)| now.since(*then) + Span(1));
        Some(now.since(time).max(uncovered))
    }

    /// Reason that the log does not count as sealed, if it does not: silence of the recorder.
    pub fn missing(&self, now: Instant) -> Option<Because> {
        let (time, sealed) = self.sealed.unwrap_or_default();
        let due = self.marks.iter().rev().find(|(then, _)| now.since(*then) >= self.limit);
        let covered = due.is_none_or(|(_, entries)| sealed >= *entries);
        let recent = self.sealed.is_some() && now.since(time) <= self.limit;
        (!(covered && recent)).then_some(Because::Silence(time))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wire::audit::SealedHead;

    fn seal(counter: u64) -> Seal {
        let heads = [SealedHead { node: NodeId::UNIT_A, boot: Boot(1), counter }].into_iter().collect();
        Seal { entries: counter, head: [0; 32], heads }
    }

    #[test]
    fn old_or_short_seals_do_not_count() {
        let mut seals = Seals::new(NodeId::UNIT_A, Boot(1), Span::s(1));
        assert!(seals.missing(Instant(0)).is_some());
        seals.mark(Instant(0), 5);
        seals.take(Instant(900_000), &seal(5));
        assert_eq!(seals.missing(Instant(1_000_000)), None);
        assert!(seals.missing(Instant(1_900_001)).is_some(), "old");
        assert_eq!(seals.age(Instant(1_900_001)), Some(Span(1_000_001)));
        seals.mark(Instant(1_000_000), 9);
        seals.take(Instant(2_000_000), &seal(8));
        assert!(seals.missing(Instant(2_000_000)).is_some(), "stops short");
        assert_eq!(seals.age(Instant(2_000_000)), Some(Span(1_000_001)), "just the limit is too long");
        for n in 1..200 {
            seals.mark(Instant(2_000_000 + n * 50_000), 9 + n);
            seals.take(Instant(2_000_000 + n * 50_000), &seal(8));
        }
        assert_eq!(seals.age(Instant(12_000_000)), Some(Span(11_000_001)), "however many marks ago");
        seals.take(Instant(12_000_000), &seal(300));
        assert_eq!(seals.age(Instant(12_000_000)), Some(Span::ZERO));
    }
}
