//! Attacks by an admitted teammate.

use holdsafe_tests::{shipped, variations};
use wire::event::Event;

use crate::SEEDS;

#[test]
fn a_teammate_forwards_a_third_units_telemetry_in_every_form_under_every_policy() {
    for cell in variations("teammate") {
        cell.expect(1..3);
    }
}

#[test]
fn malformed_but_authenticated_records_are_refused_by_name() {
    for run in shipped("malformed").expect(SEEDS) {
        let refused = run.evidence.entries.iter().any(|w| matches!(w.entry.event, Event::Refused { .. }));
        assert!(refused);
    }
}
