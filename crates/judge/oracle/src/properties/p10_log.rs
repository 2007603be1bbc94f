//! P10: the log verifies, and the cores of a live run are functions of their input journals.
//!
//! A host that overslept breaks it too. `outcome` adds that finding last, since it concerns the whole run.

use super::{BareGuest, Finding, Property, finding, process_fault};
use crate::facts::Facts;

pub(super) const BARE_GUEST: BareGuest = BareGuest { check: log_flaws, not_judged: None };

pub(super) fn check(facts: &Facts) -> Vec<Finding> {
    let mut found = log_flaws(facts);
    found.extend(process_fault::findings(facts, Property::P10));
    found
}

fn log_flaws(facts: &Facts) -> Vec<Finding> {
    let evidence = facts.evidence;
    let flaws = evidence.log_flaws.iter().map(ToString::to_string);
    let differences = evidence.differences.iter().chain(&evidence.broken_log).cloned();
    flaws.chain(differences).map(|message| finding(Property::P10, evidence.duration, message)).collect()
}
