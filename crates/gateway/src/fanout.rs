//! Fan-out: an accepted report of one unit goes to the sessions of the others.
//!
//! The report travels verbatim, under its origin's signature, in an envelope that names the session peer that brought it and
//! bounds its age by now. The gateway vouches for no more: the receiving unit judges origin, signature, order
//! and consistency itself.

use wire::id::UnitId;
use wire::session::{SessionBody, Teammate};
use wire::time::{Instant, Span};
use wire::trust::{Accepted, SignedReport};

use crate::session::Session;

/// An accepted report on its way to other units.
#[derive(Debug)]
pub struct Envelope<'b> {
    origin: Option<UnitId>,
    teammate: Teammate<'b>,
    brought_by: UnitId,
}

impl<'b> Envelope<'b> {
    /// An envelope around `report`, which `session` brought.
    pub fn new(session: &Session, report: &Accepted<SignedReport<'b>>, now: Instant) -> Self {
        let signed = report.message();
        let evidence = report.evidence();
        // Without a bound (freshness waived, no echo) it counts as older than any limit.
        let age = evidence.age.map_or(Span(u64::MAX), |age| age.after(now.since(evidence.received)).upper());
        Self {
            origin: signed.report.origin.unit(),
            teammate: Teammate { via: session.peer(), age, report: signed.bytes.into() },
            brought_by: session.unit(),
        }
    }

    /// The record for `session`, if it is to have one: a teammate, not the unit reported on and not the one that
    /// brought the report, and one that already listens.
    pub fn addressed_to(&self, session: &Session, fanout: &[UnitId]) -> Option<SessionBody<'b>> {
        let unit = session.unit();
        let other = Some(unit) != self.origin && unit != self.brought_by;
        let wanted = other && session.listens() && fanout.contains(&unit);
        wanted.then_some(SessionBody::Teammate(self.teammate))
    }
}
