//! C's telemetry on its way through B: heard while a forwarding is open, held for its lag, then due.
//!
//! In which form it goes up, and in which session, is `teammate`'s.

use std::collections::VecDeque;

use wire::time::{Instant, Span};

use crate::opening::Opening;
use crate::plan::{Direction, Form, Forward};

/// Most reports of C held for their lag; further ones are passed over.
const MAX_WAITING: usize = 1024;

/// One forwarding of the plan, with the reports held for it.
#[derive(Clone, Debug)]
pub(super) struct Forwarding {
    plan: Forward,
    pub(super) opening: Opening,
    waiting: VecDeque<(Instant, Vec<u8>)>,
}

impl Forwarding {
    /// A forwarding of an insider that started at `origin`.
    pub(super) fn new(plan: &Forward, origin: Instant) -> Self {
        let opening = Opening::new(plan.step, Direction::Up, origin, plan.at_ms, Span::ms(plan.duration_ms));
        Self { plan: *plan, opening, waiting: VecDeque::new() }
    }

    pub(super) fn form(&self) -> Form {
        self.plan.form
    }

    pub(super) fn lag(&self) -> Span {
        Span::ms(self.plan.lag_ms)
    }

    /// Holds a report of C while the forwarding is open.
    pub(super) fn hear(&mut self, now: Instant, report: &[u8]) {
        if self.opening.is_open(now) && self.waiting.len() < MAX_WAITING {
            self.waiting.push_back((now + self.lag(), report.to_vec()));
        }
    }

    /// The next report that has waited long enough.
    pub(super) fn take(&mut self, now: Instant) -> Option<Vec<u8>> {
        self.waiting.pop_front_if(|(due, _)| *due <= now).map(|(_, report)| report)
    }

    /// Time at which the next report has waited long enough.
    pub(super) fn due(&self) -> Option<Instant> {
        self.waiting.front().map(|(due, _)| *due)
    }

    /// True if B does not send its own report now.
    pub(super) fn replaces(&self, now: Instant) -> bool {
        !self.plan.own_reports && self.opening.is_open(now)
    }
}
