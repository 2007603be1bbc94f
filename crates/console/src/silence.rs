//! Silence: which one is planned, which is ordered, and which is the gateway's. What follows from one that is none of
//! these is left to `causes`.

use wire::event::Freshness;
use wire::id::PeerId;
use wire::report::ReportedContact;
use wire::time::Span;

use crate::shown::{Shown, ShownUnit};

/// Time by which a planned contact may be late before that asks for an act.
pub const CONTACT_LATE: Span = Span::s(1);

/// Silence of a unit against its plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plan {
    /// The unit is to be heard.
    Contact,
    /// It is not: until the next contact in this time, if the plan has another.
    Between(Option<Span>),
    /// It is to be heard again since this time.
    Due(Span),
}

impl Plan {
    /// The plan for a unit that was last heard `age` ago.
    pub fn new(contact: Option<ReportedContact>, age: Span) -> Self {
        match contact {
            Some(ReportedContact { left, next }) if left <= age => match next {
                Some(next) if next <= age => Plan::Due(Span(age.0 - next.0)),
                next => Plan::Between(next.map(|next| Span(next.0 - age.0))),
            },
            Some(_) | None => Plan::Contact,
        }
    }

    /// Time until silence by this plan asks for an act, if it will by time alone.
    pub(crate) fn alarm_in(self) -> Option<Span> {
        let left = match self {
            Plan::Contact | Plan::Between(None) => None,
            Plan::Between(Some(next)) => Some(next + CONTACT_LATE),
            Plan::Due(late) => (late <= CONTACT_LATE).then(|| Span(CONTACT_LATE.0 - late.0)),
        };
        left.map(|left| left + Span(1))
    }
}

/// The plan for the unit at this age of its report.
pub(crate) fn plan(unit: &ShownUnit) -> Plan {
    Plan::new(unit.state.get().0.contact, unit.state.age())
}

/// True if the peer's identity was revoked here: its silence is ordered.
pub(crate) fn revoked(shown: &Shown, peer: PeerId) -> bool {
    shown.revocable.iter().any(|(node, asked)| *asked && peer.to_string() == node.name())
}

/// True if the gateway is not heard, nor any of several units that their plans let be heard: one cause, not as many as
/// there are units. Of one unit alone the console cannot tell.
pub(crate) fn gateway_silent(shown: &Shown) -> bool {
    let mut expected = shown.units.iter().filter(|unit| plan(unit) == Plan::Contact);
    let several = expected.clone().nth(1).is_some();
    let gone = !shown.links.is_empty() && shown.links.iter().all(|link| link.open.freshness() >= Freshness::Stale);
    several && gone && expected.all(|unit| unit.state.freshness() >= Freshness::Stale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn silence_is_told_by_the_plan() {
        let contact = |left, next: Option<u64>| Some(ReportedContact { left: Span::s(left), next: next.map(Span::s) });
        assert_eq!(Plan::new(None, Span::s(60)), Plan::Contact);
        assert_eq!(Plan::new(contact(12, Some(42)), Span::s(2)), Plan::Contact);
        assert_eq!(Plan::new(contact(12, Some(42)), Span::s(15)), Plan::Between(Some(Span::s(27))));
        assert_eq!(Plan::new(contact(12, Some(42)), Span::s(43)), Plan::Due(Span::s(1)));
        assert_eq!(Plan::new(contact(0, None), Span::s(43)), Plan::Between(None));
        assert_eq!(Plan::new(contact(12, Some(42)), Span(u64::MAX)), Plan::Due(Span(u64::MAX - 42_000_000)));
    }
}
