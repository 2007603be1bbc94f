//! Fan-out by interest: an accepted report of one unit goes to the sessions of the units that are to hear it.
//!
//! A unit hears the teammates of its interest set, at most [`MAX_TEAMMATES`], however many units there are: the cost of
//! the fan-out grows with the number of units and not with its square. The sets are configured and checked when the
//! gateway is made; no record changes them.
//!
//! The report travels verbatim, under its origin's signature, in an envelope that names the session peer that brought
//! it and bounds its age by now. The gateway vouches for no more: the receiving unit judges origin, signature, order
//! and consistency itself.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};
use wire::id::UnitId;
use wire::session::{MAX_TEAMMATES, SessionBody, Teammate};
use wire::time::{Instant, Span};
use wire::trust::{Accepted, SignedReport};

use crate::session::Session;

/// The interest set of one unit.
#[derive(Clone, Debug, Serialize, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Interest {
    /// Unit that is informed.
    pub unit: UnitId,
    /// Teammates whose reports it gets, at most [`MAX_TEAMMATES`].
    pub hears: Vec<UnitId>,
}

/// Reason that interest sets cannot be followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InterestError {
    /// Two sets for one unit.
    #[error("interests: one set for each unit expected, got a second one of `{0}`")]
    Again(UnitId),
    /// A set above its bound.
    #[error("interests: at most {MAX_TEAMMATES} teammates expected, `{unit}` has {got}")]
    TooMany {
        /// Unit of the set.
        unit: UnitId,
        /// Teammates in it.
        got: usize,
    },
    /// A unit that may hold no session.
    #[error("interests: one of the gateway's units expected, got `{0}`")]
    Stranger(UnitId),
    /// A unit that is to hear itself.
    #[error("interests: teammates expected, `{0}` is to hear itself")]
    Itself(UnitId),
}

/// The interest sets the other way round: the units that hear a unit.
#[derive(Clone, Debug, Default)]
pub(crate) struct Hearers(BTreeMap<UnitId, BTreeSet<UnitId>>);

impl Hearers {
    /// Hearers for interest sets over `units`.
    pub(crate) fn from_interests(interests: &[Interest], units: &[UnitId]) -> Result<Self, InterestError> {
        let (mut hearers, mut seen) = (BTreeMap::<UnitId, BTreeSet<UnitId>>::new(), BTreeSet::new());
        for Interest { unit, hears } in interests {
            if !seen.insert(*unit) {
                return Err(InterestError::Again(*unit));
            }
            if hears.len() > MAX_TEAMMATES {
                return Err(InterestError::TooMany { unit: *unit, got: hears.len() });
            }
            if let Some(stranger) = core::iter::once(unit).chain(hears).find(|named| !units.contains(named)) {
                return Err(InterestError::Stranger(*stranger));
            }
            if hears.contains(unit) {
                return Err(InterestError::Itself(*unit));
            }
            for origin in hears {
                hearers.entry(*origin).or_default().insert(*unit);
            }
        }
        Ok(Self(hearers))
    }

    /// The units that hear `origin`, but for the one that brought the report.
    fn told_of(&self, origin: UnitId, brought_by: UnitId) -> impl Iterator<Item = UnitId> {
        self.0.get(&origin).into_iter().flatten().copied().filter(move |unit| *unit != brought_by)
    }
}

/// An accepted report on its way to other units.
#[derive(Debug)]
pub(crate) struct Envelope<'b> {
    origin: UnitId,
    teammate: Teammate<'b>,
    brought_by: UnitId,
}

impl<'b> Envelope<'b> {
    /// An envelope around `report` of `origin`, which `session` brought.
    pub(crate) fn new(session: &Session, origin: UnitId, report: &Accepted<SignedReport<'b>>, now: Instant) -> Self {
        let evidence = report.evidence();
        // Without a bound (freshness waived, no echo) it counts as older than any limit.
        let age = evidence.age.map_or(Span(u64::MAX), |age| age.plus(now.since(evidence.received)).upper());
        let teammate = Teammate { via: session.peer(), age, report: report.message().bytes.into() };
        Self { origin, teammate, brought_by: session.unit() }
    }

    /// The units that are to have it: those that hear the unit reported on, and not the one that brought the report.
    pub(crate) fn addressees(&self, hearers: &Hearers) -> Vec<UnitId> {
        hearers.told_of(self.origin, self.brought_by).collect()
    }

    /// The record for `session`, once its peer listens.
    pub(crate) fn record_for(&self, session: &Session) -> Option<SessionBody<'b>> {
        session.listens().then_some(SessionBody::Teammate(self.teammate))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [UnitId; 3] = [UnitId::A, UnitId::B, UnitId::C];

    fn refused(unit: UnitId, hears: &[UnitId]) -> Option<InterestError> {
        Hearers::from_interests(&[Interest { unit, hears: hears.to_vec() }], &ALL).err()
    }

    #[test]
    fn unsound_interest_set_is_refused_by_name() {
        let far = UnitId::from_name("unit-64").expect("a unit");
        assert_eq!(refused(UnitId::A, &[UnitId::B, UnitId::C]), None);
        assert_eq!(refused(UnitId::A, &[far]), Some(InterestError::Stranger(far)));
        assert_eq!(refused(far, &[UnitId::A]), Some(InterestError::Stranger(far)));
        assert_eq!(refused(UnitId::A, &[UnitId::A]), Some(InterestError::Itself(UnitId::A)));
        let many = InterestError::TooMany { unit: UnitId::A, got: MAX_TEAMMATES + 1 };
        assert_eq!(refused(UnitId::A, &[UnitId::B; MAX_TEAMMATES + 1]), Some(many));
        let set = Interest { unit: UnitId::B, hears: vec![] };
        assert_eq!(Hearers::from_interests(&[set.clone(), set], &ALL).err(), Some(InterestError::Again(UnitId::B)));
    }
}
