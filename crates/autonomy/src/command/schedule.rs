//! Orders that wait for their time: a bounded table of [`Ordered`]s, each until its window closes.
//!
//! A time tag counts from the issue of the nonce that the intent repeats, on the unit's own clock. So neither another
//! clock nor a delay on the way moves a window. The checks before an order is stored are left to the gate; whether the
//! mode lets it be carried out at its time, to `transition`.

use wire::command::{Intent, MAX_AHEAD};
use wire::refusal::Refusal;
use wire::time::{Instant, Span};

use super::Ordered;
use crate::fork::Fork;

/// Orders of one operator that may wait at a time.
pub const MAX_STORED: usize = 4;

/// Window of an order that waits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OrderWindow {
    /// Time from which it is carried out.
    pub due: Instant,
    /// Last time at which it may be carried out.
    pub until: Instant,
}

impl OrderWindow {
    /// The window of an intent with a nonce that was issued at `issued`; none without a time tag.
    pub(super) fn from_intent(intent: &Intent, issued: Instant) -> Option<OrderWindow> {
        let tag = intent.tag?;
        let due = issued + tag.after;
        Some(OrderWindow { due, until: due + tag.within })
    }
}

/// The time tag is on a command that may wait, and not too far ahead.
pub(super) fn tagged(intent: &Intent) -> Result<(), Refusal> {
    let Some(tag) = intent.tag else { return Ok(()) };
    if !intent.kind.may_wait() {
        return Err(Refusal::Untimed { kind: intent.kind.name() });
    }
    let got = tag.after + tag.within;
    if got > MAX_AHEAD { Err(Refusal::AheadTag { limit: MAX_AHEAD, got }) } else { Ok(()) }
}

/// Orders that wait, the next one first; of one time, the one that came first.
#[derive(Debug, Default)]
pub struct Schedule(Vec<(OrderWindow, Ordered)>);

impl Schedule {
    /// Has an order wait until its window. Gives the time that is left.
    pub fn store(&mut self, now: Instant, window: OrderWindow, order: Ordered) -> Result<Span, Refusal> {
        if now > window.until {
            return Err(Refusal::Missed { over: now.since(window.until) });
        }
        if self.0.iter().filter(|(_, other)| other.id().operator == order.id().operator).count() >= MAX_STORED {
            return Err(Refusal::Full { limit: MAX_STORED });
        }
        let place = self.0.partition_point(|(other, _)| other.due <= window.due);
        self.0.insert(place, (window, order));
        Ok(window.due.since(now))
    }

    /// Takes out the next order that is due; of one away from safe with the time for which its window is over, if it
    /// is. That to stop was acknowledged, and is made up for by a unit that was kept from running.
    pub fn due(&mut self, now: Instant) -> Option<(Ordered, Option<Span>)> {
        let (window, _) = self.0.first().filter(|(window, _)| now >= window.due)?;
        let until = window.until;
        let (_, order) = self.0.remove(0);
        let excess = (now > until && !order.kind().towards_safe()).then(|| now.since(until));
        Some((order, excess))
    }

    /// Takes out every order that leads away from safe.
    pub fn void(&mut self) -> Vec<Ordered> {
        let (held, void) = self.0.drain(..).partition(|(_, order)| order.kind().towards_safe());
        self.0 = held;
        let void: Vec<(OrderWindow, Ordered)> = void;
        void.into_iter().map(|(_, order)| order).collect()
    }

    /// Copy of the orders for another world.
    #[must_use]
    pub fn fork(&self, _fork: &Fork) -> Schedule {
        Schedule(self.0.iter().map(|(window, order)| (*window, order.copy())).collect())
    }
}
