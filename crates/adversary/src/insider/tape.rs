//! Records that B sent in a session, to be sent again in the next.
//!
//! The insider records until it hangs up; then the newest goes first, each record whole and then its report alone.

use std::collections::VecDeque;

use wire::id::RecordId;
use wire::time::{Instant, Span};

use crate::plan::Resend;

/// Most records kept; the oldest goes first.
const MAX_TAPE: usize = 256;

/// A record that was sent, and the signed report in it.
#[derive(Clone, Debug)]
pub(super) struct Taped {
    pub(super) at: Instant,
    pub(super) id: RecordId,
    pub(super) whole: Vec<u8>,
    pub(super) report: Vec<u8>,
}

/// The records kept for sending again.
#[derive(Clone, Debug)]
pub(super) struct Tape {
    plan: Resend,
    ends: Instant,
    hung_up: bool,
    taken: u32,
    next: Instant,
    records: VecDeque<Taped>,
}

impl Tape {
    /// A tape of an insider that started at `origin`.
    pub(super) fn new(plan: Resend, origin: Instant) -> Self {
        let ends = origin + Span::ms(plan.at_ms);
        Self { plan, ends, hung_up: false, taken: 0, next: ends, records: VecDeque::new() }
    }

    /// Notes a record that is being sent.
    pub(super) fn note(&mut self, taped: Taped) {
        if self.hung_up {
            return;
        }
        if self.records.len() == MAX_TAPE {
            self.records.pop_front();
        }
        self.records.push_back(taped);
    }

    /// True if the session is to end now; true once.
    pub(super) fn hangs_up(&mut self, now: Instant) -> bool {
        let due = !self.hung_up && now >= self.ends;
        self.hung_up |= due;
        due
    }

    /// True if B has a later boot once it has hung up.
    pub(super) fn restarts(&self) -> bool {
        self.plan.restart
    }

    /// The next record that is due, and true if it goes whole; `None` when none is due.
    pub(super) fn take(&mut self, now: Instant) -> Option<(Taped, bool)> {
        if !self.hung_up || self.taken >= self.plan.count || now < self.next || self.records.is_empty() {
            return None;
        }
        let back = (self.taken as usize / 2) % self.records.len();
        let taped = self.records.iter().rev().nth(back)?.clone();
        let whole = self.taken.is_multiple_of(2);
        self.taken += 1;
        self.next = now + Span::ms(self.plan.every_ms.max(1));
        Some((taped, whole))
    }

    /// Time at which it wants to act next; `ready` tells of a session to send into.
    pub(super) fn due(&self, ready: bool) -> Option<Instant> {
        if !self.hung_up {
            return Some(self.ends);
        }
        let left = self.taken < self.plan.count && !self.records.is_empty();
        (left && ready).then_some(self.next)
    }
}
