//! Sensors and localisation that fail or lie.

use std::collections::BTreeSet;

use evidence::trial::Outcome;
use evidence::{Fate, Witnessed};
use explain::{Explanation, FaultSite, explain};
use ground_truth::{Any, Note, Sensor};
use holdsafe_tests::{Ready, rendered, shipped, variations};
use oracle::{Property, judge};
use scenario::Settings;
use twin::trial::Run;
use wire::bounds::Bounds;
use wire::event::Event;
use wire::id::ObjectId;
use wire::mode::Guard;
use wire::policy::{Check, Requirement};
use wire::sensor::Class;

use crate::SEEDS;

#[test]
fn thermal_loss_degrades_and_revokes_authority() {
    for run in shipped("thermal_loss").expect(SEEDS) {
        assert!(run.verdict.latency.to_authority_revoked.is_some(), "{:?}", run.verdict.transitions);
    }
}

#[test]
fn colour_loss_degrades_and_revokes_authority() {
    for run in shipped("rgb_loss").expect(SEEDS) {
        assert!(run.verdict.latency.to_authority_revoked.is_some(), "{:?}", run.verdict.transitions);
    }
}

#[test]
fn degraded_unit_at_full_speed_is_late() {
    let mut ready = shipped("thermal_loss");
    let bounds = ready.setup.bounds;
    ready.setup.misset = Some(Bounds { degraded_speed_mm_s: bounds.max_speed_mm_s, ..bounds });
    for seed in SEEDS {
        let verdict = ready.run(seed).verdict;
        assert!(verdict.transitions.iter().any(|t| t.to == "DEGRADED"), "{:?}", verdict.transitions);
        assert_eq!(verdict.outcome, Outcome::Late, "seed {seed}: {:?}", verdict.findings);
        let by_the_plant = |name: &str| name.starts_with("DEGRADED, and the plant");
        assert!(
            verdict.findings.iter().all(|f| f.property == Property::P2 && by_the_plant(&f.message)),
            "{:?}",
            verdict.findings
        );
    }
}

/// The run with one check of the policy waived.
fn unchecked(name: &str, check: Check, seed: u64) -> Run {
    let mut ready = shipped(name);
    ready.setup.policy.boundary.insert(check, Requirement::Waived);
    ready.run(seed)
}

/// Without the check the frozen camera is not noticed in time.
#[test]
fn frozen_camera_is_lost_by_content_check() {
    for (name, cause) in [("rgb_freeze", "lost:rgb"), ("thermal_freeze", "lost:thermal")] {
        for run in shipped(name).expect(SEEDS) {
            assert!(run.verdict.latency.to_authority_revoked.is_some(), "{:?}", run.verdict.transitions);
            assert!(run.verdict.transitions.iter().any(|t| t.cause == cause), "{:?}", run.verdict.transitions);
        }
        let run = unchecked(name, Check::Content, 1);
        assert!(run.verdict.receipt, "{name}: it arrived all the same");
        assert_eq!(run.verdict.outcome, Outcome::Late, "{name}: {:?}", run.verdict.transitions);
    }
}

/// The delay is four frames, or as many as perception remembers.
#[test]
fn delayed_camera_is_lost_for_good() {
    for (name, cause) in [("rgb_skew", "lost:rgb"), ("thermal_skew", "lost:thermal")] {
        for cell in variations(name) {
            for run in cell.expect(SEEDS) {
                let last = run.verdict.transitions.last().map(|t| (t.to.as_str(), t.cause.as_str()));
                assert_eq!(last, Some(("DEGRADED", cause)), "{name} {:?}: {:?}", cell.cell, run.verdict.transitions);
            }
        }
    }
}

/// The act still takes place, on the vehicle.
#[test]
fn chaff_takes_neither_table_nor_track() {
    for run in shipped("chaff").expect(SEEDS) {
        let events = || run.evidence.entries.iter().map(|w| w.entry.event);
        let acts: Vec<_> = events()
            .filter_map(|event| match event {
                Any::Instrument(Note::PlantAct { class, distance_mm, .. }) => Some((class, distance_mm)),
                _ => None,
            })
            .collect();
        let near = run.evidence.bounds.designation_mm;
        assert!(matches!(acts[..], [(Some(Class::Vehicle), mm)] if mm <= near), "{acts:?}");
        let minted = events().filter(|event| matches!(event, Any::Service(Event::Minted { .. }))).count();
        assert_eq!(minted, 1, "the operator's, before the chaff came");
        let believed = events().filter_map(|event| match event {
            Any::Service(Event::Judged { tracks, .. }) => Some(tracks),
            _ => None,
        });
        let objects: BTreeSet<ObjectId> = events()
            .filter_map(|event| match event {
                Any::Instrument(Note::Object { object, .. }) => Some(object),
                _ => None,
            })
            .collect();
        assert!(believed.max().is_some_and(|most| usize::from(most) <= objects.len()), "more tracks than objects");
    }
}

#[test]
#[ignore = "long: rendered missions"]
fn painted_chaff_crowds_the_detectors_list() {
    for run in rendered("chaff").expect(1..3) {
        let mut events = run.evidence.entries.iter().map(|w| w.entry.event);
        assert!(events.any(|event| matches!(
            event,
            Any::Service(Event::Crowded { detections, .. }) if usize::from(detections) >= perception::CROWD
        )));
    }
}

#[test]
fn starved_tracks_degrade() {
    shipped("track_starvation").expect(SEEDS);
}

#[test]
fn loss_of_localisation_holds() {
    shipped("localisation_loss").expect(SEEDS);
}

/// Every trial holds by itself within *Th* of the fault.
fn holds_within_th(name: &str) {
    let ready = shipped(name);
    let th = ready.setup.bounds.to_hold_safe_ms as f64;
    for run in ready.expect(SEEDS) {
        let held = run.verdict.latency.to_hold_safe;
        assert!(held.is_some_and(|ms| ms <= th), "{name}: {held:?} of {th}");
    }
}

/// The jump comes with and without a single revealing fix.
#[test]
fn localisation_jump_holds_in_time() {
    holds_within_th("localisation_jump");
    holds_within_th("localisation_jump_small");
}

#[test]
fn a_frozen_or_noisy_localisation_holds_in_time() {
    holds_within_th("localisation_freeze");
    holds_within_th("localisation_noise");
}

/// The cause is odometry's, and once it is true again the unit goes on by consent.
#[test]
fn frozen_odometry_holds_in_time_and_is_named() {
    holds_within_th("odometry_freeze");
    for run in shipped("odometry_freeze").expect(SEEDS) {
        let seen = seen(&run);
        assert!(seen.starts_with(&[(true, true), (true, false)]), "{seen:?}");
    }
}

/// Presence of a fix and of odometry, at each change of it.
fn seen(run: &Run) -> Vec<(bool, bool)> {
    let seen = |w: &Witnessed| match w.entry.event {
        Any::Service(Event::NavigationSeen { fix, odometry }) => Some((fix, odometry)),
        _ => None,
    };
    run.evidence.entries.iter().filter_map(seen).collect()
}

/// The first loss of a run, explained.
fn loss(run: &Run) -> Explanation {
    let explanations = explain(&run.evidence.entries, &run.evidence.bounds);
    explanations.into_iter().find(Explanation::restricts).unwrap_or_else(|| panic!("{:?}", run.verdict.transitions))
}

/// One receiver and one odometer: either may be wrong.
#[test]
fn wrong_odometry_holds_and_neither_source_is_blamed() {
    for name in ["odometry_drift", "odometry_scale"] {
        for run in shipped(name).expect(SEEDS) {
            let Explanation { origin, cause, .. } = loss(&run);
            let places = (origin.place, &origin.or[..]);
            let either = (FaultSite::Sensor(Sensor::Localisation), &[FaultSite::Sensor(Sensor::Odometry)][..]);
            assert_eq!((places, cause.label().as_str()), (either, "lost:drift"), "{name}: {}", origin.what);
            assert!(origin.what.starts_with("fix and odometry disagree"), "{name}: {}", origin.what);
        }
    }
}

/// The scenario with another size of its fault.
fn sized(name: &str, magnitude: f64) -> Ready {
    let mut ready = shipped(name);
    let set = Settings::one("fault.0.magnitude.0", serde_json::json!(magnitude));
    ready.scenario = set.applied_to(&ready.scenario).expect("a number of the scenario");
    ready
}

/// Odometry repeatedly claims twice the largest speed.
#[test]
fn odometry_that_cannot_be_holds_and_is_named() {
    for run in sized("odometry_scale", 2.0).expect(SEEDS) {
        let origin = loss(&run).origin;
        assert_eq!((origin.place, &origin.or[..]), (FaultSite::Sensor(Sensor::Odometry), &[][..]), "{}", origin.what);
    }
}

/// The unit continues, and its stated place is the true one.
#[test]
fn single_impossible_odometry_costs_nothing_and_is_named() {
    for run in shipped("odometry_jump").expect(SEEDS) {
        assert_eq!(seen(&run), [(true, true), (true, false), (true, true)]);
        let zero = run.verdict.zero.expect("a receipt");
        let astray = run.evidence.entries.iter().filter(|w| w.at > zero).filter_map(|w| match w.entry.event {
            Any::Service(Event::Located { x_mm, pose_x_mm, distrusted, .. }) => {
                Some((distrusted, x_mm.abs_diff(pose_x_mm)))
            }
            _ => None,
        });
        let astray = astray.max().expect("the unit says where it is");
        assert!(astray < (false, 300), "flagged, and by how many millimetres: {astray:?}");
    }
}

/// A jump along a way that wheels could have turned.
#[test]
fn small_odometry_jump_holds_in_time() {
    holds_within_th("odometry_jump_small");
}

#[test]
fn jamming_with_fixes_degrades_without_flicker() {
    for run in shipped("localisation_jam").expect(SEEDS) {
        let modes: Vec<&str> = run.verdict.transitions.iter().map(|t| t.to.as_str()).collect();
        assert_eq!(modes.iter().filter(|mode| **mode == "DEGRADED").count(), 1, "{modes:?}");
    }
}

/// The run with one guard of the policy waived.
fn run_waiving(name: &str, guard: Guard, seed: u64) -> Run {
    let mut ready = shipped(name);
    ready.setup.policy.guards.insert(guard, Requirement::Waived);
    ready.run(seed)
}

/// Without the drift test the unit leaves the fence.
#[test]
fn slow_drift_is_found_before_the_fence() {
    for run in shipped("localisation_drift").expect(SEEDS) {
        let lost = run.verdict.transitions.iter().any(|t| t.cause == "lost:drift");
        assert!(lost, "{:?}", run.verdict.transitions);
    }
    let run = run_waiving("localisation_drift", Guard::Drift, 1);
    assert_eq!(run.verdict.outcome, Outcome::Unsafe, "{:?}", run.verdict.transitions);
    assert!(run.verdict.findings.iter().any(|f| f.property == Property::P4), "{:?}", run.verdict.findings);
}

/// The floor of detection, from below: a fault too small to be noticed arrived all the same, and is reported so.
#[test]
fn tiny_fault_is_undetected_not_invalid() {
    for (name, sets, undetected) in [
        ("localisation_jump", [("fault.0.magnitude.1", 0.1), ("fault.0.duration_s", 1.0)].as_slice(), true),
        ("rgb_freeze", &[("fault.0.duration_s", 0.3)], true),
        // Driving, a fix that stands still for a few readings may be noticed.
        ("localisation_freeze", &[("fault.0.duration_s", 0.1)], false),
        ("localisation_freeze", &[("fault.0.duration_s", 0.3)], false),
    ] {
        let mut ready = shipped(name);
        for (path, value) in sets {
            let set = Settings::one(path, serde_json::json!(value));
            ready.scenario = set.applied_to(&ready.scenario).expect("a number of the scenario");
        }
        for seed in SEEDS {
            let verdict = ready.run(seed).verdict;
            let noticed = verdict.outcome != Outcome::Undetected;
            assert!(verdict.receipt && verdict.outcome != Outcome::Invalid, "{name} {sets:?}: {:?}", verdict.findings);
            assert!(!(undetected && noticed), "{name} {sets:?}: {:?}", verdict.transitions);
            let fates: Vec<Fate> = verdict.injections.iter().map(|injection| injection.fate).collect();
            assert!(matches!(fates[..], [Fate::Delivered { noticed: told, .. }] if told == noticed), "{fates:?}");
        }
    }
}

/// The sim's claims of a fault, put into the log of a run without it: no other party saw anything of the kind.
#[test]
fn claimed_sensor_fault_has_no_receipt() {
    for name in [
        "localisation_jump",
        "localisation_freeze",
        "localisation_noise",
        "odometry_jump",
        "odometry_jump_small",
        "time_step",
        "rgb_freeze",
        "thermal_freeze",
        "rgb_skew",
        "thermal_skew",
        "chaff",
    ] {
        let mut ready = shipped(name);
        let attacked = ready.run(1);
        assert!(attacked.verdict.receipt, "{name}");
        ready.scenario.fault = Default::default();
        let mut quiet = ready.run(1);
        let claimed =
            |e: &Any| matches!(e, Any::Instrument(Note::Fault { .. } | Note::Imposed { .. } | Note::Altered { .. }));
        let claims = attacked.evidence.entries.iter().filter(|w| claimed(&w.entry.event));
        quiet.evidence.entries.extend(claims.copied());
        quiet.evidence.entries.sort_by_key(|w| w.at);
        quiet.evidence.planned = attacked.evidence.planned;
        let verdict = judge(&quiet.evidence);
        assert_eq!((verdict.receipt, verdict.outcome), (false, Outcome::Invalid), "{name}: {:?}", verdict.findings);
    }
}

#[test]
fn flagged_but_used_fixes_are_a_finding() {
    let run = shipped("localisation_jump").run(1);
    let mut evidence = run.evidence;
    for w in &mut evidence.entries {
        if let Any::Service(Event::Located { x_mm, y_mm, pose_x_mm, pose_y_mm, distrusted: true, .. }) =
            &mut w.entry.event
        {
            // As if the pose followed the fixes from the second flagged one on.
            (*pose_x_mm, *pose_y_mm) = ((*pose_x_mm + *x_mm) / 2, (*pose_y_mm + *y_mm) / 2);
        }
    }
    let first = evidence
        .entries
        .iter()
        .position(|w| matches!(w.entry.event, Any::Service(Event::Located { distrusted: true, .. })));
    let first = first.expect("the jump was flagged");
    if let Any::Service(Event::Located { pose_x_mm, pose_y_mm, x_mm, y_mm, .. }) =
        &mut evidence.entries[first].entry.event
    {
        (*pose_x_mm, *pose_y_mm) = (2 * *pose_x_mm - *x_mm, 2 * *pose_y_mm - *y_mm);
    }
    let verdict = judge(&evidence);
    assert!(verdict.findings.iter().any(|f| f.property == Property::P5), "{:?}", verdict.findings);
}
