//! Approach of a log to each limit, in millionths of the way: the gradient of a guided search.

use ground_truth::{FaultKind, Note, Sensor};
use oracle::{AT_LIMIT, Approaches, Limit};
use wire::bounds::Bounds;
use wire::id::{FrameId, NodeId};
use wire::mode::{Cause, Mode};
use wire::sensor::Class;

use super::log::{BOUNDS, Log};

/// A share of a limit, in millionths.
fn millionths(value: u64, limit: u64) -> Option<u32> {
    Some((value * u64::from(AT_LIMIT) / limit) as u32)
}

fn approach_to(approaches: &Approaches, limit: Limit) -> Option<u32> {
    approaches.get(&limit).copied()
}

/// Latencies of records and orders.
#[test]
fn quiet_run_approaches_by_its_latencies() {
    let Bounds { freshness_ms, telemetry_period_ms, command_limit_ms, .. } = BOUNDS;
    let quiet = Log::whole().approaches();
    for (limit, way) in [
        (Limit::Age, millionths(1, freshness_ms)),
        (Limit::Display, millionths(5, freshness_ms + telemetry_period_ms)),
        (Limit::Order, millionths(10, command_limit_ms)),
        (Limit::Fence, Some(0)),
        (Limit::Authority, Some(AT_LIMIT)),
        (Limit::Confirmation, None),
        (Limit::Object, None),
        (Limit::Loss, None),
        (Limit::Blindness, None),
        (Limit::Recovery, None),
    ] {
        assert_eq!(approach_to(&quiet, limit), way, "{limit:?}");
    }
}

#[test]
fn outdated_mode_display_counts_from_the_change() {
    let mut log = Log::whole();
    log.cut_display(4900).transition(5000, Mode::PrepareToAct, Mode::Ready, Cause::Expired);
    log.displayed(5080, Mode::PrepareToAct, 5000);
    let limit = BOUNDS.freshness_ms + BOUNDS.telemetry_period_ms;
    assert_eq!(approach_to(&log.approaches(), Limit::Display), millionths(80, limit));
    assert_eq!(approach_to(&log.approaches(), Limit::Authority), millionths(3000, BOUNDS.authority_ms));
}

#[test]
fn act_approaches_by_distance_and_confirmation_age() {
    let mut log = Log::whole();
    log.confirm_and_act(5000, Class::Vehicle, 700);
    let approaches = log.approaches();
    assert_eq!(approach_to(&approaches, Limit::Object), millionths(700, BOUNDS.designation_mm.into()));
    assert_eq!(approach_to(&approaches, Limit::Confirmation), millionths(10, BOUNDS.command_limit_ms));
}

#[test]
fn used_fence_distance_counts() {
    let margin = BOUNDS.fence_margin_mm as i32;
    let mut log = Log::whole();
    log.truth(5000, 100, margin / 4).truth(5010, 100, margin / 2);
    assert_eq!(approach_to(&log.approaches(), Limit::Fence), millionths((margin - margin / 4) as u64, margin as u64));
    log.truth(5020, 100, -1);
    assert_eq!(approach_to(&log.approaches(), Limit::Fence), Some(AT_LIMIT), "beyond it is no further");
}

#[test]
fn loss_counts_while_nominal_recovery_by_speed() {
    let mut log = Log::whole();
    log.thermal_fault(4000, 4200);
    assert_eq!(approach_to(&log.approaches(), Limit::Loss), millionths(200, BOUNDS.to_degraded_ms));
    let mut log = Log::whole();
    log.thermal_fault(4000, 9000);
    log.transition(4150, Mode::PrepareToAct, Mode::Degraded, Cause::Lost(wire::mode::Guard::Thermal));
    log.transition(4150 + 2 * BOUNDS.hysteresis_ms, Mode::Degraded, Mode::Ready, Cause::Recovered);
    assert_eq!(approach_to(&log.approaches(), Limit::Loss), millionths(150, BOUNDS.to_degraded_ms));
    assert_eq!(approach_to(&log.approaches(), Limit::Recovery), Some(AT_LIMIT / 2));
}

#[test]
fn blindness_counts_while_the_unit_continues() {
    let mut log = Log::whole();
    let fault =
        |active| Note::Fault { sensor: Sensor::Localisation, kind: FaultKind::Dropout, active, frame: FrameId(1) };
    log.add(4000, NodeId::SIM, fault(true)).add(6000, NodeId::SIM, fault(false));
    log.altered(4000, Sensor::Localisation, FaultKind::Dropout, NodeId::UNIT_A);
    log.transition(4300, Mode::PrepareToAct, Mode::Degraded, Cause::Lost(wire::mode::Guard::Localisation));
    log.transition(4700, Mode::Degraded, Mode::HoldSafe, Cause::Unrecovered(wire::mode::Guard::Localisation));
    assert_eq!(approach_to(&log.approaches(), Limit::Blindness), millionths(700, BOUNDS.to_hold_safe_ms));
}

#[test]
fn link_silence_counts_while_the_unit_continues() {
    for (node, limit, other) in
        [(NodeId::GATEWAY, Limit::Uplink, Limit::Downlink), (NodeId::UNIT_A, Limit::Downlink, Limit::Uplink)]
    {
        let mut log = Log::whole();
        log.entries.retain(|w| !(w.at > 5_000_000 && w.at < 5_600_000 && Some(w.entry.node) == node.guard()));
        let approaches = log.approaches();
        let (first, second) = (approach_to(&approaches, limit), approach_to(&approaches, other));
        assert!(first > second, "{node}: {first:?}, {second:?}");
        log.transition(5300, Mode::PrepareToAct, Mode::HoldSafe, Cause::Lost(wire::mode::Guard::Lease));
        assert!(approach_to(&log.approaches(), limit) < first, "{node}: it stopped");
    }
}
