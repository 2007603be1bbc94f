//! The supervision lease: for how long the unit may take itself to be supervised.
//!
//! The gateway grants it over the session, for so long from the moment it wrote the grant. The unit knows that moment
//! only through the grant's age bound, and takes the earliest it can have been: a delayed grant is worth less, never
//! more. Only another grant extends a lease, so a stop never has to cross a failed link. Near the end of a planned
//! contact a lease may span the time to the next one: by the unit's own plan, whatever the grant says.

use config::contact::Contacts;
use wire::mode::Because;
use wire::report::ReportedContact;
use wire::time::{Age, Instant, Span};

/// The lease as it stands.
#[derive(Clone, Debug, Default)]
pub struct Lease {
    contacts: Contacts,
    started: Instant,
    until: Option<Instant>,
    granted: Option<Instant>,
}

impl Lease {
    /// No lease yet, under a contact plan that begins at `started`.
    pub fn new(contacts: Contacts, started: Instant) -> Self {
        Self { contacts, started, until: None, granted: None }
    }

    /// Takes a grant of `length`, at most `usual` or as long as the contact plan allows, received at `received` and at
    /// most `age` old then; with no bound of its age (freshness waived) it is taken to be new.
    pub fn grant(&mut self, length: Span, usual: Span, received: Instant, age: Option<Age>) {
        let age = age.map_or(Span::ZERO, Age::upper);
        let longest = self.contacts.lease(received.since(self.started), usual);
        let until = received + Span(length.0.min(longest.0)) - age;
        // The later end stays: a grant that a relay delayed and that arrives behind a newer one must not shorten the
        // lease.
        self.until = Some(self.until.map_or(until, |standing| standing.max(until)));
        self.granted = Some(received);
    }

    /// Age that the grant in force can have, were it for `longest`; none before the first.
    pub fn age(&self, longest: Span, now: Instant) -> Option<Span> {
        self.until.map(|until| (now + longest).since(until))
    }

    /// Contact by the plan at `now`; none without a plan.
    pub fn contact(&self, now: Instant) -> Option<ReportedContact> {
        self.contacts.time_left(now.since(self.started)).map(|(left, next)| ReportedContact { left, next })
    }

    /// Reason that there is no lease at `now`, if there is none: silence since the last grant.
    pub fn lapsed(&self, now: Instant) -> Option<Because> {
        match self.until {
            Some(until) if now < until => None,
            Some(_) | None => Some(Because::Silence(self.granted.unwrap_or_default())),
        }
    }
}

#[cfg(test)]
mod tests {
    use config::contact::Contact;

    use super::*;

    const LONGEST: Span = Span::ms(500);

    #[test]
    fn grant_counts_from_its_earliest_possible_writing() {
        let mut lease = Lease::default();
        let received = Instant(1_000_000);
        let age = Age::on_one_host(received - Span::ms(120), received);
        lease.grant(LONGEST, LONGEST, received, Some(age));
        assert_eq!(lease.lapsed(received + Span::ms(379)), None);
        assert_eq!(lease.lapsed(received + Span::ms(380)), Some(Because::Silence(received)));
        assert_eq!(lease.age(LONGEST, received + Span::ms(50)), Some(Span::ms(170)));
        assert_eq!(Lease::default().age(LONGEST, received), None);
    }

    #[test]
    fn grants_are_bounded_and_never_shorten_another() {
        let mut lease = Lease::default();
        lease.grant(Span::s(60), LONGEST, Instant(0), None);
        lease.grant(Span::ms(1), LONGEST, Instant(1), None);
        assert_eq!(lease.lapsed(Instant(499_999)), None);
        assert!(lease.lapsed(Instant(500_000)).is_some());
    }

    #[test]
    fn lease_spans_a_gap_by_the_units_own_plan() {
        let contact = |from, until| Contact { from: Span::s(from), until: Span::s(until) };
        let plan = Contacts::new(vec![contact(0, 20), contact(50, 90)]).unwrap();
        let started = Instant(7_000_000);
        let mut lease = Lease::new(plan, started);
        lease.grant(Span::s(3600), LONGEST, started + Span::s(10), None);
        assert!(lease.lapsed(started + Span::ms(10_500)).is_some(), "an hour is granted far from the end of a contact");
        lease.grant(Span::s(3600), LONGEST, started + Span::s(19), None);
        assert_eq!(lease.lapsed(started + Span::ms(51_999)), None);
        assert!(lease.lapsed(started + Span::s(52)).is_some(), "and the next contact brought none");
    }
}
