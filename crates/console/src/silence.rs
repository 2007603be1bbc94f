//! Silence: which one is planned, which is ordered, and which is the gateway's. The consequence of one that is none of
//! these is left to `causes`.

use wire::event::Freshness;
use wire::id::PeerId;
use wire::report::ReportedContact;
use wire::time::Span;

use crate::shown::{Shown, ShownUnit};

/// Time by which a planned contact may be late before that asks for an act.
pub const CONTACT_LATE: Span = Span::s(1);

/// Contact of a unit by its own plan, which goes on in silence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plan {
    /// No plan: silence is never planned.
    None,
    /// In contact, for so long.
    Contact(Span),
    /// Between contacts; the next begins after so long, if another is planned.
    Silence(Option<Span>),
    /// A contact should have begun so long ago.
    Due(Span),
}

impl Plan {
    /// The plan for a unit that was last heard `age` ago.
    pub fn new(contact: Option<ReportedContact>, age: Span) -> Self {
        match contact {
            Some(ReportedContact { left, next }) if left <= age => match next {
                Some(next) if next <= age => Plan::Due(Span(age.0 - next.0)),
                next => Plan::Silence(next.map(|next| Span(next.0 - age.0))),
            },
            Some(ReportedContact { left, .. }) => Plan::Contact(Span(left.0 - age.0)),
            None => Plan::None,
        }
    }

    /// True if the unit is to be heard.
    pub fn asks_for_reports(self) -> bool {
        matches!(self, Plan::None | Plan::Contact(_))
    }

    /// Time until silence by this plan asks for an act, if it will by time alone.
    pub(crate) fn alarm_in(self) -> Option<Span> {
        let left = match self {
            Plan::None | Plan::Contact(_) | Plan::Silence(None) => None,
            Plan::Silence(Some(next)) => Some(next + CONTACT_LATE),
            Plan::Due(late) => (late <= CONTACT_LATE).then(|| Span(CONTACT_LATE.0 - late.0)),
        };
        left.map(|left| left + Span(1))
    }
}

impl ShownUnit {
    /// Contact by its plan, at the age of its state.
    pub fn plan(&self) -> Plan {
        Plan::new(self.state.get().0.contact, self.state.age())
    }

    /// True if it is silent because it is out of contact as planned, up to [`CONTACT_LATE`] after contact was due.
    pub fn is_out_of_contact(&self) -> bool {
        let silent = self.state.freshness() > Freshness::Fresh;
        match self.plan() {
            Plan::Silence(_) => silent,
            Plan::Due(ago) => silent && ago <= CONTACT_LATE,
            Plan::None | Plan::Contact(_) => false,
        }
    }
}

/// True if the peer's identity was revoked here: its silence is ordered.
pub(crate) fn revoked(shown: &Shown, peer: PeerId) -> bool {
    shown.revocable.iter().any(|(node, asked)| *asked && peer.to_string() == node.name())
}

/// True if the gateway is not heard, nor any of several units that their plans let be heard: one cause, not as many as
/// there are units. Of one unit alone the console cannot tell.
pub(crate) fn gateway_silent(shown: &Shown) -> bool {
    let mut expected = shown.units.iter().filter(|unit| unit.plan().asks_for_reports());
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
        assert_eq!(Plan::new(None, Span::s(60)), Plan::None);
        assert_eq!(Plan::new(contact(12, Some(42)), Span::s(2)), Plan::Contact(Span::s(10)));
        assert_eq!(Plan::new(contact(12, Some(42)), Span::s(15)), Plan::Silence(Some(Span::s(27))));
        assert_eq!(Plan::new(contact(12, Some(42)), Span::s(43)), Plan::Due(Span::s(1)));
        assert_eq!(Plan::new(contact(0, None), Span::s(43)), Plan::Silence(None));
        assert_eq!(Plan::new(contact(12, Some(42)), Span(u64::MAX)), Plan::Due(Span(u64::MAX - 42_000_000)));
    }
}
