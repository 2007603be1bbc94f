//! Claims of teammates, and the cases in which they cannot all be true.

use config::setup::Ablation;
use wire::command::CommandKind;
use wire::event::{Event, Inconsistency};
use wire::id::{PeerId, UnitId};
use wire::mode::{Cause, Guard, Mode};
use wire::policy::{Check, Policy, Requirement};
use wire::refusal::Reason;

use crate::bench::Bench;

const B: (UnitId, PeerId) = (UnitId::B, PeerId::UNIT_B);
const C: (UnitId, PeerId) = (UnitId::C, PeerId::UNIT_C);

/// A policy under which any holder of a session may speak for anyone.
fn session_only() -> Bench {
    let mut policy = Policy::default();
    policy.boundary.insert(Check::Origin, Requirement::Waived);
    policy.boundary.insert(Check::Signature, Requirement::Waived);
    let mut bench = Bench::with_policy(policy, Some(Ablation { scenario: "session-only".into() }));
    bench.reach(Mode::Ready);
    bench
}

fn found(bench: &Bench) -> Vec<Inconsistency> {
    let entry = |e: &Event| match e {
        Event::Inconsistent { finding, .. } => Some(*finding),
        _ => None,
    };
    bench.events.iter().filter_map(entry).collect()
}

fn refused(bench: &Bench, peer: PeerId) -> Vec<Reason> {
    let entry = |e: &Event| match e {
        Event::Refused { peer: Some(by), reason, .. } if *by == peer => Some(*reason),
        _ => None,
    };
    bench.events.iter().filter_map(entry).collect()
}

/// The wire has a number for it, the run no key.
#[test]
fn claim_of_a_stranger_is_refused_by_name() {
    let mut bench = Bench::in_mode(Mode::Ready);
    let stranger = UnitId::from_name("unit-64").unwrap();
    bench.claim(stranger, stranger.peer(), 1, (0, 15_000));
    assert_eq!(refused(&bench, stranger.peer()), [Reason::Signer]);
    let text = bench.events.iter().find_map(|event| match event {
        Event::Refused { reason: Reason::Signer, detail, .. } => Some(detail.as_str()),
        _ => None,
    });
    assert_eq!(text, Some("signer: a known signer expected, got unit-64"));
    assert_eq!((found(&bench), bench.core.mode()), (vec![], Mode::Ready));
}

#[test]
fn claims_that_agree_change_nothing() {
    let mut bench = Bench::in_mode(Mode::Ready);
    for n in 1..20 {
        bench.moving(B.0, B.1, n, (100 * n as i32, 12_000), (1000, 0));
        bench.moving(C.0, C.1, n, (-100 * n as i32, -12_000), (1000, 3141));
        bench.run(100);
    }
    assert_eq!((found(&bench), bench.core.mode()), (vec![], Mode::Ready));
}

#[test]
fn jumping_teammate_holds_until_operator_consents() {
    let mut bench = Bench::in_mode(Mode::Ready);
    bench.claim(B.0, B.1, 1, (0, 15_000));
    bench.claim(B.0, B.1, 2, (0, 9000));
    assert_eq!(found(&bench), [Inconsistency::Kinematics]);
    assert_eq!(bench.transitions().last().unwrap().2, Cause::Lost(Guard::Teammates));
    bench.run(3000);
    assert_eq!(bench.core.mode(), Mode::HoldSafe, "the finding stays");
    assert_eq!(bench.order(CommandKind::Resume), None);
    assert_eq!(bench.core.mode(), Mode::Ready);
}

#[test]
#[allow(clippy::disallowed_methods, reason = "the world of a test, not a core")]
fn teammate_moving_as_claimed_is_consistent() {
    let mut bench = Bench::in_mode(Mode::Ready);
    // A circle of 10 m about (0, 30) at 3 m/s, said to be half a percent faster, with 60 mm of noise to and fro.
    for n in 1..200_u64 {
        let angle = 0.03 * n as f64;
        let noise = if n % 2 == 0 { 60.0 } else { -60.0 };
        let place = ((10_000.0 * angle.sin() + noise) as i32, (30_000.0 - 10_000.0 * angle.cos()) as i32);
        let heading = (angle * 1000.0 + 3142.0) as i32 % 6283 - 3142;
        bench.moving(B.0, B.1, n, place, (3015, heading as i16));
        bench.run(100);
    }
    assert_eq!((found(&bench), bench.core.mode()), (vec![], Mode::Ready));
}

/// The teammate claims to stand while it drifts.
#[test]
fn drifting_teammate_is_found_at_the_slack() {
    let mut bench = Bench::in_mode(Mode::Ready);
    for n in 1..40 {
        bench.claim(B.0, B.1, n, (0, 12_000 + 50 * n as i32));
        bench.run(100);
        if let [finding] = found(&bench)[..] {
            // 0.5 m/s: 8 s · -ln(1 - 1.5/4) = 3.76 s.
            assert_eq!((finding, n), (Inconsistency::Residual, 39));
        }
    }
    assert_eq!((found(&bench).len(), bench.core.mode()), (1, Mode::HoldSafe));
}

/// A gap accuses no unit that could have driven to the claimed place.
#[test]
fn gap_between_claims_hides_no_drift() {
    let mut bench = Bench::in_mode(Mode::Ready);
    bench.claim(B.0, B.1, 1, (0, 12_000));
    bench.claim(B.0, B.1, 13, (0, 13_000));
    assert_eq!(found(&bench), []);
    bench.claim(B.0, B.1, 25, (0, 14_000));
    assert_eq!(found(&bench), [Inconsistency::Residual], "a metre at a time");
    let mut bench = Bench::in_mode(Mode::Ready);
    bench.moving(B.0, B.1, 1, (0, 12_000), (3000, 0));
    bench.moving(B.0, B.1, 31, (0, 20_900), (3000, 0));
    assert_eq!(found(&bench), [], "it may have turned");
}

/// Other guards do not allow the unit to go on.
#[test]
fn disallowed_consent_leaves_the_finding() {
    let mut bench = Bench::in_mode(Mode::Ready);
    bench.claim(B.0, B.1, 1, (0, 15_000));
    bench.claim(B.0, B.1, 2, (0, 9000));
    bench.no_seals = true;
    bench.run(1500);
    assert_eq!(bench.order(CommandKind::Resume), Some(Reason::Interlock));
    bench.run(100);
    assert!(bench.report.as_ref().unwrap().failing.contains(Guard::Teammates));
}

/// So is one in the unit's own place.
#[test]
fn two_units_in_one_place_are_inconsistent() {
    let mut bench = Bench::in_mode(Mode::Ready);
    bench.claim(B.0, B.1, 1, (0, 12_000));
    bench.claim(C.0, C.1, 1, (500, 12_500));
    assert_eq!(found(&bench), [Inconsistency::Exclusion]);
    let mut bench = Bench::in_mode(Mode::Ready);
    bench.claim(B.0, B.1, 1, (-9500, 300));
    assert_eq!((found(&bench), bench.core.mode()), (vec![Inconsistency::Exclusion], Mode::HoldSafe));
}

#[test]
fn forwarded_report_is_refused_by_origin_without_trace() {
    let mut bench = Bench::in_mode(Mode::Ready);
    bench.claim(C.0, B.1, 1, (0, 12_000));
    assert_eq!(refused(&bench, PeerId::UNIT_B), [Reason::Origin]);
    bench.claim(B.0, B.1, 1, (0, 12_000));
    assert_eq!((found(&bench), bench.core.mode()), (vec![], Mode::Ready), "the refused claim excludes nobody");
}

/// Consistency finds the second source.
#[test]
fn session_only_passes_forwarding_consistency_finds_it() {
    let mut bench = session_only();
    bench.claim(C.0, C.1, 1, (0, 12_000));
    bench.claim(C.0, B.1, 1, (0, 12_000));
    assert_eq!(refused(&bench, PeerId::UNIT_B), []);
    assert_eq!((found(&bench), bench.core.mode()), (vec![Inconsistency::TimeBase], Mode::HoldSafe));
}

#[test]
fn session_only_forwards_silent_unit_unnoticed() {
    let mut bench = session_only();
    for n in 1..20 {
        bench.claim(C.0, B.1, n, (0, 12_000));
        bench.run(100);
    }
    assert_eq!((found(&bench), bench.core.mode()), (vec![], Mode::Ready));
}

#[test]
fn a_replayed_claim_is_refused_and_no_inconsistency() {
    let mut bench = Bench::in_mode(Mode::Ready);
    bench.claim(B.0, B.1, 5, (0, 12_000));
    bench.claim(B.0, B.1, 4, (0, 12_000));
    bench.claim(B.0, B.1, 5, (0, 12_000));
    assert_eq!(refused(&bench, PeerId::UNIT_B), [Reason::Replayed]);
    assert_eq!((found(&bench), bench.core.mode()), (vec![], Mode::Ready), "overtaking is no lie");
}
