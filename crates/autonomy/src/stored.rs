//! Time-tagged orders in the core: stored as they come, carried out at their time, void when the unit is no longer as
//! the operator saw it.
//!
//! An order away from safe was given for the mode that the operator saw: any change of mode voids it, and so does a
//! HOLD, or the loss of the session at the broker. One towards safe stays. The table is `command::schedule`'s.

use wire::event::{Event, Interface};
use wire::policy::{Check, Requirement};
use wire::refusal::Refusal;
use wire::time::{Instant, Span};

use crate::Autonomy;
use crate::command::Ordered;
use crate::command::schedule::OrderWindow;

impl Autonomy {
    /// An order with a time tag passed the trust boundary.
    pub(crate) fn store(&mut self, now: Instant, window: OrderWindow, order: Ordered) {
        let (claimed, moved) = (order.claimed(), order.moved());
        match self.schedule.store(now, window, order) {
            Ok(due) => {
                self.logged.accounts.accepted(Interface::Commands);
                self.heard(moved, None);
                self.write(now, Event::Stored { command: claimed.id, kind: claimed.kind, due });
                self.acknowledge(&claimed, None, Some(due));
            }
            Err(refusal) => self.concluded(now, &claimed, moved, Some(refusal)),
        }
    }

    /// Carries out the orders that are due.
    pub(crate) fn carry_out_stored(&mut self, now: Instant) {
        while let Some((order, excess)) = self.schedule.due(now).filter(|_| !self.quiet) {
            let refused = self.unfit(now, &order, excess).or_else(|| self.obey(now, &order));
            self.answer(now, &order.claimed(), refused.as_ref());
        }
    }

    /// Voids the stored orders that lead away from safe.
    pub(crate) fn void_stored(&mut self, now: Instant) {
        for order in self.schedule.void() {
            self.answer(now, &order.claimed(), Some(&Refusal::Voided));
        }
    }

    /// Reason not to carry out a stored order whatever the mode: its window is over, or its operator has been revoked
    /// meanwhile.
    fn unfit(&self, now: Instant, order: &Ordered, excess: Option<Span>) -> Option<Refusal> {
        // The order was admitted before the revocation came; its operator is asked for again now.
        let required = self.identity.policy.check(Check::Revocation) == Requirement::Required;
        let revoked = || self.revoked.check_admitted(order.id().operator, now).err().filter(|_| required);
        excess.map(|over| Refusal::Missed { over }).or_else(revoked)
    }
}
