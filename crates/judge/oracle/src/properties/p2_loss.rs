//! P2: after a sensor is lost for longer than *Td*, or shows only the past, no authority and no nominal mode beyond *Td*; and the speed of DEGRADED.

use super::limit::{Limit, LimitRow, longest};
use super::{BareGuest, Finding, Property, finding, process_fault, speed};
use crate::facts::Facts;
use crate::facts::sensor_fault::SensorFault;
use crate::facts::timeline::is_nominal;

pub(super) const BARE_GUEST: BareGuest = BareGuest {
    check: |facts| speed::check(facts, Property::P2),
    not_judged: Some(("P2", "the loss of a subsystem has to show in a mode, and a bare guest has none")),
};

pub(super) const LIMITS: [LimitRow; 1] = [LimitRow {
    limit: Limit::Loss,
    name: "nominal without a sensor",
    length_ms: Some(|bounds| bounds.to_degraded_ms),
    approach: |facts, length_us| longest(nominal_times(facts), length_us),
}];

pub(super) fn check(facts: &Facts) -> Vec<Finding> {
    let mut found = nominal_without_sensor(facts);
    found.extend(speed::check(facts, Property::P2));
    found.extend(process_fault::findings(facts, Property::P2));
    found
}

fn nominal_without_sensor(facts: &Facts) -> Vec<Finding> {
    let Facts { evidence, timeline, .. } = facts;
    let td = evidence.bounds.to_degraded_ms * 1000;
    let losses = facts.sensor_faults.iter().filter(|f| f.is_loss());
    // A sensor that is back within *Td* requires no other mode.
    let due = losses.filter(|f| f.end.saturating_sub(f.start) > td && f.start + td <= evidence.duration);
    let late = due.filter(|f| is_nominal(timeline.mode_at(f.start + td)));
    late.map(|SensorFault { sensor, start, .. }| {
        let mode = timeline.mode_at(start + td).name();
        finding(Property::P2, start + td, format!("{sensor:?} lost for {} ms and still {mode}", td / 1000))
    })
    .collect()
}

fn nominal_times(facts: &Facts) -> impl Iterator<Item = u64> {
    let losses = facts.sensor_faults.iter().filter(|f| f.is_loss());
    losses.map(|f| facts.timeline.stayed((f.start, f.end.min(facts.evidence.duration)), is_nominal))
}
