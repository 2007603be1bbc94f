//! Supervision leases: who may have one now.
//!
//! A unit drives only while it is supervised, and it is supervised only while we hear it: no grant before its first
//! accepted report, none while its newest one may be older than *Tf*, and none while a HOLD for it is unacknowledged.
//! So a stop never has to cross the failed link: silence is enough. Where the link carries in planned contacts only, a
//! grant near the end of one spans the time to the next (`config::contact`). Keeping the lease's time is left to the
//! unit.

use config::contact::Contacts;
use wire::bounds::Bounds;
use wire::command::IntentHash;
use wire::id::UnitId;
use wire::session::SessionBody;
use wire::time::{Instant, Span};

use crate::session::Session;

/// HOLDs that are remembered for one unit; beyond this number the one that is due last is forgotten.
const MAX_HOLDS: usize = 4;

/// Conditions of grants beyond the sessions.
#[derive(Clone, Debug)]
pub struct Leases {
    length: Span,
    freshness: Span,
    started: Instant,
    /// Contact plans of units whose links have one.
    contacts: Vec<(UnitId, Contacts)>,
    /// Intents of the HOLDs sent and not yet acknowledged as executed, and when each is due.
    holds: Vec<(UnitId, IntentHash, Instant)>,
}

impl Leases {
    /// Leases under these bounds, and under contact plans that begin at `started`.
    pub fn new(bounds: &Bounds, contacts: Vec<(UnitId, Contacts)>, started: Instant) -> Self {
        let (length, freshness) = (Span::ms(bounds.lease_ms), bounds.freshness());
        Self { length, freshness, started, contacts, holds: Vec::new() }
    }

    /// A HOLD went out that is due at `due`: from that time on no grants until the unit acknowledges a HOLD as
    /// executed.
    pub fn hold(&mut self, unit: UnitId, intent: IntentHash, due: Instant) {
        self.holds.push((unit, intent, due));
        let of_unit = || self.holds.iter().enumerate().filter(|(_, (u, ..))| *u == unit);
        // Bounded against a sender of many HOLDs. The one that is due last goes: were it the oldest, HOLDs with far time
        // tags would push out the one that is due, and grants would resume.
        if of_unit().count() > MAX_HOLDS
            && let Some((last, _)) = of_unit().max_by_key(|(_, (.., due))| *due)
        {
            self.holds.remove(last);
        }
    }

    /// The unit has executed the order with this intent. If the order was a HOLD, the unit is holding, and every HOLD
    /// that was due by then is done; one for later still comes. A HOLD that the unit *refused* stays: grants resume only when a HOLD has been executed. The
    /// intent identifies the order, not the id: a holder of the key can have another order executed under the same id.
    pub fn executed(&mut self, unit: UnitId, intent: IntentHash) {
        let executed = self.holds.iter().find(|(u, hash, _)| (*u, *hash) == (unit, intent));
        if let Some((.., executed_due)) = executed.copied() {
            self.holds.retain(|(u, _, due)| *u != unit || *due > executed_due);
        }
    }

    /// True if a HOLD for `unit` is due and unacknowledged.
    pub fn holding(&self, unit: UnitId, now: Instant) -> bool {
        self.holds.iter().any(|(u, _, due)| *u == unit && now >= *due)
    }

    /// The grant that the unit of `session` may have now.
    pub fn grant(&self, session: &Session, now: Instant) -> Option<SessionBody<'static>> {
        let fresh = session.telemetry_age(now).is_some_and(|age| age <= self.freshness);
        let supervised = session.listens() && fresh && !self.holding(session.unit(), now);
        supervised.then(|| SessionBody::Grant(self.length(session.unit(), now)))
    }

    fn length(&self, unit: UnitId, now: Instant) -> Span {
        let plan = self.contacts.iter().find(|(unit_id, _)| *unit_id == unit);
        plan.map_or(self.length, |(_, contacts)| contacts.lease(now.since(self.started), self.length))
    }
}
