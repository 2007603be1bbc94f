//! Approach of a trial to each limit that a property states: the guide of a search, and the result of one without a
//! finding.
//!
//! A million is at the limit as the platform's bounds state it, without the slack that the properties allow for clocks and periods. An
//! approach is no verdict: an event that is not approached (an order executed twice) has no limit here, and a broken property is
//! `properties`' to find.

use std::collections::BTreeMap;

use evidence::Evidence;

use crate::facts::Facts;
use crate::properties::{Limit, limits};

/// Closest approach to each limit, in millionths of the limit.
pub type Approaches = BTreeMap<Limit, u32>;

/// Approaches of a trial.
pub fn approaches(evidence: &Evidence) -> Approaches {
    let facts = Facts::new(evidence);
    limits().filter_map(|(_, row)| Some((row.limit, row.closest(&facts)?))).collect()
}
