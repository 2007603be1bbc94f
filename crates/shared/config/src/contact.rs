//! Contacts of a link: the times at which it carries, known to both of its ends beforehand.
//!
//! A contact plan follows from an orbit and from the places of ground stations. It is public and proves nothing about a
//! peer; no message is believed because of it. It bounds a supervision lease that spans the time between two contacts.
//! Carrying the messages is left to the link, the computation of a plan to `topology`.

use serde::{Deserialize, Serialize};

use wire::time::Span;

/// Most contacts of a plan.
pub const MAX_CONTACTS: usize = 16;

/// Time before and after the end of a contact in which a lease may span the gap. Clocks of two ends that started a
/// second apart still agree, and a grant every tenth of a second is given ten times at least.
pub const NEAR: Span = Span::s(2);

/// Time that a spanning lease lasts into the next contact: a dialler's longest pause (0.8 s), the repeat of a lost
/// flight (0.25 s), the handshake, and the periods of a report and of a grant (0.1 s each) take less.
pub const ACQUISITION: Span = Span::s(2);

/// A time at which the link carries, from the start of the run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Contact {
    /// Beginning of the contact.
    pub from: Span,
    /// End of the contact.
    pub until: Span,
}

/// A contact plan: contacts in order, at most [`MAX_CONTACTS`]. Without any, the link always carries.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Vec<Contact>", into = "Vec<Contact>")]
pub struct Contacts(Vec<Contact>);

/// Reason for which contacts are no plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ContactsError {
    /// There are too many.
    #[error("at most {MAX_CONTACTS} contacts expected, got {0}")]
    Many(usize),
    /// A contact ends before it begins, or begins before the end of the contact before.
    #[error("contact {0} is out of order")]
    Order(usize),
}

impl Contacts {
    /// # Errors
    /// Too many contacts, or contacts out of order.
    pub fn new(contacts: Vec<Contact>) -> Result<Self, ContactsError> {
        if contacts.len() > MAX_CONTACTS {
            return Err(ContactsError::Many(contacts.len()));
        }
        let ordered = |i: usize| {
            let after = i.checked_sub(1).map_or(Span::ZERO, |before| contacts[before].until);
            contacts[i].from < contacts[i].until && (i == 0 || after < contacts[i].from)
        };
        match (0..contacts.len()).find(|i| !ordered(*i)) {
            Some(i) => Err(ContactsError::Order(i)),
            None => Ok(Self(contacts)),
        }
    }

    /// True if the link always carries.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The contacts in order.
    pub fn iter(&self) -> impl Iterator<Item = &Contact> {
        self.0.iter()
    }

    /// Time left in the present contact at `since` after the start of the run, zero between contacts, and time to the
    /// next contact; absent without a plan.
    pub fn time_left(&self, since: Span) -> Option<(Span, Option<Span>)> {
        let left = self.0.iter().find(|contact| (contact.from..contact.until).contains(&since));
        let next = self.0.iter().find(|contact| contact.from > since);
        let to = |time: Span| Span(time.0 - since.0);
        (!self.is_empty()).then(|| (left.map_or(Span::ZERO, |c| to(c.until)), next.map(|c| to(c.from))))
    }

    /// Longest lease that may be granted at `since` after the start of the run. Near the end of a contact with a
    /// successor the lease may last until [`ACQUISITION`] into the next contact; at any other time, for `usual`.
    pub fn lease(&self, since: Span, usual: Span) -> Span {
        // Also after the end: the clocks of the two ends need not agree on its moment.
        let near = |contact: &Contact| since.0.abs_diff(contact.until.0) <= NEAR.0;
        let next = self.0.windows(2).find(|pair| near(&pair[0]) && since < pair[1].from).map(|pair| pair[1].from);
        next.map_or(usual, |from| usual.max(Span(from.0 - since.0) + ACQUISITION))
    }
}

impl TryFrom<Vec<Contact>> for Contacts {
    type Error = ContactsError;

    fn try_from(contacts: Vec<Contact>) -> Result<Self, ContactsError> {
        Self::new(contacts)
    }
}

impl From<Contacts> for Vec<Contact> {
    fn from(contacts: Contacts) -> Self {
        contacts.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(times: &[(u64, u64)]) -> Result<Contacts, ContactsError> {
        Contacts::new(
            times.iter().map(|(from, until)| Contact { from: Span::s(*from), until: Span::s(*until) }).collect(),
        )
    }

    #[test]
    fn lease_spans_the_gap_only_near_the_end_of_a_contact_that_another_follows() {
        let contacts = plan(&[(0, 20), (50, 90)]).unwrap();
        let lease = |ms: u64| contacts.lease(Span::ms(ms), Span::ms(500));
        assert_eq!(lease(17_999), Span::ms(500), "the contact has not ended yet");
        assert_eq!(lease(18_000), Span::s(34), "two seconds into the next contact, at 52 s");
        assert_eq!(lease(22_000), Span::s(30), "the other end's clock may be behind");
        assert_eq!(lease(22_001), Span::ms(500), "in the gap no grant can come");
        assert_eq!(lease(50_500), Span::ms(500), "the next contact has begun");
        assert_eq!(lease(89_900), Span::ms(500), "no other contact follows");
    }

    #[test]
    fn plan_tells_the_time_left_and_the_time_to_the_next_contact() {
        let contacts = plan(&[(0, 20), (50, 90)]).unwrap();
        assert_eq!(contacts.time_left(Span::s(5)), Some((Span::s(15), Some(Span::s(45)))));
        assert_eq!(contacts.time_left(Span::s(20)), Some((Span::ZERO, Some(Span::s(30)))));
        assert_eq!(contacts.time_left(Span::s(60)), Some((Span::s(30), None)));
        assert_eq!(contacts.time_left(Span::s(91)), Some((Span::ZERO, None)));
        assert_eq!(Contacts::default().time_left(Span::s(5)), None);
    }

    #[test]
    fn lease_is_the_usual_one_without_a_plan() {
        assert_eq!(Contacts::default().lease(Span::s(20), Span::ms(500)), Span::ms(500));
    }

    #[test]
    fn contacts_out_of_order_or_beyond_the_bound_are_no_plan() {
        assert_eq!(plan(&[(5, 5)]), Err(ContactsError::Order(0)));
        assert_eq!(plan(&[(0, 9), (9, 12)]), Err(ContactsError::Order(1)));
        assert_eq!(plan(&[(10, 20), (0, 5)]), Err(ContactsError::Order(1)));
        let many: Vec<(u64, u64)> = (0..17).map(|i| (2 * i, 2 * i + 1)).collect();
        assert_eq!(plan(&many), Err(ContactsError::Many(17)));
        assert!(plan(&many[..16]).is_ok());
    }
}
