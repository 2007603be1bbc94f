//! Attacks by an admitted teammate.

use evidence::claims::Claims;
use evidence::trial::Outcome;
use ground_truth::Any;
use holdsafe_tests::{Ready, shipped, variations};
use oracle::peers::claims;
use scenario::Scenario;
use twin::trial::Run;
use wire::event::{Event, Inconsistency, Interface};
use wire::id::{NodeId, PeerId};
use wire::mode::Guard;
use wire::policy::Requirement;
use wire::refusal::Reason;

use crate::SEEDS;

/// A teammate forwards a third unit's telemetry.
#[test]
fn forwarded_telemetry_in_every_form_and_policy() {
    for cell in variations("teammate") {
        cell.expect(1..3);
    }
}

#[test]
fn malformed_but_authenticated_records_are_refused_by_name() {
    for run in shipped("malformed").expect(SEEDS) {
        let refused = run.evidence.entries.iter().any(|w| matches!(w.entry.event, Any::Service(Event::Refused { .. })));
        assert!(refused);
    }
}

#[test]
fn record_is_refused_by_its_one_check() {
    for (name, reason) in
        [("session", Reason::Session), ("version", Reason::Version), ("jump", Reason::Jump), ("origin", Reason::Role)]
    {
        for run in cell("malformed_once", name).expect(SEEDS) {
            let refused = refusals(&run, run.verdict.zero.expect("a receipt"));
            assert!(refused.first() == Some(&reason), "{name}: {refused:?}");
            assert!(refused.iter().all(|other| *other == reason), "{name}: {refused:?}");
        }
    }
}

/// The cell of this name.
fn cell(scenario: &str, name: &str) -> Ready {
    let found = variations(scenario).into_iter().find(|ready| ready.cell.as_deref() == Some(name));
    found.expect("the cell is in its scenario")
}

fn claims_made(run: &Run) -> Claims {
    claims(&run.evidence, None)
}

/// Reasons for which the gateway refused B's records, from `since` on, microseconds.
fn refusals(run: &Run, since: u64) -> Vec<Reason> {
    let forgery = |event: &Any| match event {
        Any::Service(Event::Refused { at: Interface::Uplink, peer: Some(PeerId::UNIT_B), reason, .. }) => Some(*reason),
        _ => None,
    };
    let later = run.evidence.entries.iter().filter(|w| w.at >= since && w.entry.node == NodeId::GATEWAY);
    later.filter_map(|w| forgery(&w.entry.event)).collect()
}

fn findings(run: &Run) -> Vec<Inconsistency> {
    let forgery = |event: &Any| match event {
        Any::Service(Event::Inconsistent { finding, .. }) => Some(*finding),
        _ => None,
    };
    run.evidence.entries.iter().filter_map(|w| forgery(&w.entry.event)).collect()
}

fn all_refused(run: &Run) {
    let claims = claims_made(run);
    assert_eq!((claims.said, claims.accepted), (60, 0));
    assert!(refusals(run, 0).len() >= 60);
}

#[test]
fn earlier_session_records_are_always_refused() {
    for run in cell("session_replay", "full").expect(SEEDS) {
        all_refused(&run);
    }
    for run in cell("session_replay", "freshness-waived").expect(SEEDS) {
        all_refused(&run);
        let refused = refusals(&run, 0);
        assert!(refused.contains(&Reason::Session) && refused.contains(&Reason::Replayed), "{refused:?}");
    }
    for run in cell("session_replay", "order-waived").expect(SEEDS) {
        assert_eq!(claims_made(&run).accepted, 60, "without these checks every one gets in");
        assert_eq!(findings(&run)[0], Inconsistency::TimeBase);
    }
}

#[test]
fn records_before_a_restart_fail_by_boot() {
    for run in cell("restart_replay", "full").expect(SEEDS) {
        all_refused(&run);
    }
    for run in cell("restart_replay", "freshness-waived").expect(SEEDS) {
        all_refused(&run);
        assert!(refusals(&run, 0).contains(&Reason::Epoch));
    }
    for run in cell("restart_replay", "order-waived").expect(SEEDS) {
        assert_eq!(claims_made(&run).accepted, 60);
    }
}

/// Reports that were played back are refused as well.
#[test]
fn synthetic_or_foreign_time_reports_are_refused() {
    let expected = [
        ("synthetic", Reason::Product),
        ("replayed", Reason::Product),
        ("clock-ahead", Reason::NoEcho),
        ("clock-behind", Reason::Stale),
    ];
    for (name, reason) in expected {
        for run in cell("mode_confusion", name).expect(SEEDS) {
            let claims = claims_made(&run);
            assert!(claims.said >= 29 && claims.accepted == 0, "{name}: {claims:?}");
            assert!(refusals(&run, 0).iter().filter(|r| **r == reason).count() as u64 >= claims.said, "{name}");
        }
    }
    for run in cell("mode_confusion", "synthetic/product-waived").expect(SEEDS) {
        let claims = claims_made(&run);
        assert_eq!(claims.accepted, claims.said);
    }
}

#[test]
fn self_contradictory_teammate_claims_are_noticed() {
    use Inconsistency::{Exclusion, Kinematics, Residual};
    let expected = [
        ("hidden/1", Some(Residual)),
        ("hidden/below-floor", None),
        ("owned/away", None),
        ("owned/too-fast", Some(Kinematics)),
        ("owned/approach", Some(Exclusion)),
        ("feigned/2", Some(Residual)),
    ];
    for (name, finding) in expected {
        for run in cell("teammate_lies", name).expect(SEEDS) {
            assert_eq!(findings(&run).first().copied(), finding, "{name}");
        }
    }
}

#[test]
fn unguarded_teammate_falsehood_changes_nothing() {
    let mut ready = cell("teammate_lies", "hidden/1");
    ready.setup.policy.guards.insert(Guard::Teammates, Requirement::Waived);
    let run = ready.run(1);
    assert_eq!((run.verdict.outcome, findings(&run)[0]), (Outcome::Undetected, Inconsistency::Residual));
}

/// The drift scenario with this rate, hidden.
fn drift(rate: f64) -> Ready {
    let ready = cell("teammate_drift", "hidden");
    let settings = scenario::Settings::one("falsehood.0.drift_m_s", serde_json::Value::from(rate));
    let scenario: Scenario = settings.applied_to(&ready.scenario).expect("a rate within its range");
    Ready { scenario, ..ready }
}

/// The drift is noticed before harm, from the rate that the bounds state.
#[test]
fn hidden_drift_is_noticed_above_the_floor() {
    let outcome = |rate: f64| drift(rate).run(1).verdict.outcome;
    assert_eq!([0.18, 0.20].map(outcome), [Outcome::Undetected, Outcome::HoldSafe], "floor: 0.1875 m/s");
    let believed = |rate: f64| {
        let run = drift(rate).run(1);
        let held = run.verdict.zero.zip(run.verdict.latency.to_hold_safe).map(|(zero, ms)| zero + (ms * 1000.0) as u64);
        claims(&run.evidence, held).believed_mm
    };
    assert!(believed(0.24) < 3000 && believed(0.22) > 3000, "harm: 3 m, before it from 0.235 m/s");
}
