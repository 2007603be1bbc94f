//! Supervision over the time between two contacts: how long a unit in silence may go on by the contact plan.
//!
//! The plan is of the run, not of a service: neither the gateway's word on a grant's length nor the unit's own reading of its plan is taken.

use evidence::{Evidence, Micros};
use ground_truth::Any;
use wire::event::Event;
use wire::id::NodeId;

use super::{SLACK, Span};

/// Time before the end of a contact in which supervision may be given for the time until the next one.
const NEAR: Micros = 2_000_000;
/// Time into the next contact by which it has to be given again.
const ACQUISITION: Micros = 2_000_000;

/// The planned contacts, at times of the run.
fn planned_contacts(evidence: &Evidence) -> Vec<Span> {
    let started = evidence
        .entries
        .iter()
        .find(|w| w.entry.node == NodeId::RELAY_TELEMETRY && matches!(w.entry.event, Any::Service(Event::Started)));
    // The plan counts from the start of the relays, which are the medium of the link.
    let zero = started.map_or(0, |w| w.at);
    evidence.contacts.iter().map(|contact| (zero + contact.from.0, zero + contact.until.0)).collect()
}

/// The times without a planned contact: before the first, between two, after the last. None without a plan.
pub(crate) fn contact_gaps(evidence: &Evidence) -> Vec<Span> {
    let contacts = planned_contacts(evidence);
    let begins = std::iter::once(0).chain(contacts.iter().map(|contact| contact.1));
    let ends = contacts.iter().map(|contact| contact.0).chain([evidence.duration]);
    if contacts.is_empty() { Vec::new() } else { begins.zip(ends).filter(|(from, to)| from < to).collect() }
}

/// Time until which a unit may go on, last heard or led at `last`, where that is near the end of a planned contact; none elsewhere.
pub(crate) fn may_go_on_until(evidence: &Evidence, last: Micros) -> Option<Micros> {
    let heard = evidence.bounds.freshness_ms * 1000;
    let contacts = planned_contacts(evidence);
    // After the last contact there is no next one to wait for: the lease limits the unit as on any link.
    let pairs = contacts.windows(2).map(|pair| (pair[0].1, pair[1].0));
    let is_near = |end: Micros| last + NEAR + heard + SLACK >= end;
    let mut gaps = pairs.filter(|(end, next)| is_near(*end) && last < *next);
    gaps.next().map(|(_, next)| next + ACQUISITION + evidence.bounds.control_period_ms * 1000 + SLACK)
}
