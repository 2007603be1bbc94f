//! The supervision lease: for how long the unit may take itself to be supervised.
//!
//! The gateway grants it over the session, for so long from the moment it wrote the grant. The unit knows that moment
//! only through the grant's age bound, and takes the earliest it can have been: a delayed grant is worth less, never
//! more. Only another grant extends a lease, so a stop never has to cross a failed link.

use wire::mode::Because;
use wire::time::{Age, Instant, Span};

/// The lease as it stands.
#[derive(Clone, Debug, Default)]
pub struct Lease {
    until: Option<Instant>,
    granted: Option<Instant>,
}

impl Lease {
    /// Takes a grant of `length`, at most `longest`, received at `received` and at most `age` old then; with no bound
    /// of its age (freshness waived) it is taken to be new.
    pub fn grant(&mut self, length: Span, longest: Span, received: Instant, age: Option<Age>) {
        let age = age.map_or(Span::ZERO, Age::upper);
        let until = received + Span(length.0.min(longest.0)) - age;
        self.until = Some(self.until.map_or(until, |standing| standing.max(until)));
        self.granted = Some(received);
    }

    /// Age that the grant in force can have, were it for `longest`; none before the first.
    pub fn age(&self, longest: Span, now: Instant) -> Option<Span> {
        self.until.map(|until| (now + longest).since(until))
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
}
