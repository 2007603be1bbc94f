//! Changes of mode by input, and their delays.

use config::setup::Ablation;
use wire::bounds::Bounds;
use wire::command::CommandKind;
use wire::core::Input;
use wire::event::{Account, Event, Interface};
use wire::id::WorldId;
use wire::measured::Limit;
use wire::mode::{Because, Cause, Guard, Guards, Mode};
use wire::policy::{Check, Policy, Requirement};
use wire::refusal::Reason;

use crate::bench::{Bench, TRACK, lose};

/// Enabling comes before, and READY again after the act.
#[test]
fn armed_and_confirmed_unit_acts_once() {
    let mut bench = Bench::in_mode(Mode::PrepareToAct);
    bench.run(500);
    assert!(bench.report.as_ref().unwrap().authority.is_some_and(|held| held.track == TRACK));
    assert_eq!(bench.order(CommandKind::Confirm(TRACK)), None);
    assert_eq!((bench.acts.len(), bench.core.mode()), (1, Mode::Ready));
    assert_eq!((bench.acts[0].track, bench.acts[0].world), (TRACK, WorldId(1)));
    assert_eq!(bench.order(CommandKind::Confirm(TRACK)), Some(Reason::Interlock), "authority is used up");
    assert_eq!(bench.acts.len(), 1);
}

#[test]
fn it_stands_until_enabled_and_drives_while_ready() {
    let mut bench = Bench::new();
    bench.run(2000);
    assert_eq!((bench.core.mode(), bench.driven()), (Mode::Idle, 0));
    bench.order(CommandKind::Enable);
    bench.run(100);
    assert!(bench.driven() > 1000);
    bench.order(CommandKind::Hold);
    bench.run(100);
    assert_eq!((bench.core.mode(), bench.driven()), (Mode::HoldSafe, 0));
}

#[test]
fn loss_of_any_guard_ends_authority_in_time() {
    for guard in Guard::ALL {
        let mut bench = Bench::before_loss(guard, Mode::PrepareToAct);
        lose(&mut bench, guard);
        // A log counts as sealed for its own, longer limit; a lease lasts 500 ms; the fence has to be reached.
        let limit = match guard {
            Guard::SealedLog => 1500,
            Guard::Lease => 600,
            Guard::Geofence => 4800,
            _ => 400,
        };
        bench.run(limit);
        let revoked =
            bench.events.iter().any(|e| matches!(e, Event::Revoked { cause, .. } if *cause == Cause::Lost(guard)));
        assert!(revoked, "{guard:?}: {:?}", bench.transitions());
        let expected = match guard {
            Guard::Geofence | Guard::Lease | Guard::Teammates => Mode::HoldSafe,
            Guard::Designation => Mode::Ready,
            _ => Mode::Degraded,
        };
        let (from, to, cause) = bench.transitions()[2];
        assert_eq!((from, to, cause), (Mode::PrepareToAct, expected, Cause::Lost(guard)));
        assert_eq!(bench.order(CommandKind::Confirm(TRACK)), Some(Reason::Interlock), "{guard:?}");
    }
}

/// A report that names a failing guard without the value beyond its limit, or the reverse, would leave its reader
/// without a reason.
#[test]
fn measurement_exceeds_its_limit_exactly_when_guard_fails() {
    let mut broken = Guards::default();
    for guard in Guard::ALL {
        let mut bench = Bench::before_loss(guard, Mode::Ready);
        let bounds = Bounds::GROUND;
        lose(&mut bench, guard);
        for _ in 0..100 {
            bench.run(50);
            let report = bench.report.clone().unwrap();
            for of in Guard::ALL {
                let Some(limit) = Limit::for_guard(of, &bounds) else { continue };
                let exceeded = report.measured.value(of).is_some_and(|value| limit.exceeded(value));
                let fails = report.failing.contains(of);
                // These two fail until they are back further than they had to go.
                let lasts = matches!(of, Guard::Drift | Guard::TimeBase);
                assert!(
                    exceeded == fails || lasts && !exceeded,
                    "{guard:?}: {of:?} {:?} {limit:?}",
                    report.measured.value(of)
                );
                broken = if exceeded { broken.with_guard(of) } else { broken };
            }
            let claimed = report.measured.teammate().is_some();
            assert_eq!(claimed, report.failing.contains(Guard::Teammates));
            broken = if claimed { broken.with_guard(Guard::Teammates) } else { broken };
        }
    }
    let measured = Guard::ALL.into_iter().filter(|guard| *guard != Guard::Designation);
    assert_eq!(broken, measured.fold(Guards::default(), Guards::with_guard), "each was seen beyond its limit");
}

#[test]
fn unused_authority_expires() {
    let mut bench = Bench::in_mode(Mode::PrepareToAct);
    bench.run(5100);
    assert_eq!(bench.transitions().last(), Some(&(Mode::PrepareToAct, Mode::Ready, Cause::Expired)));
}

/// The loss of a stage degrades the unit; authority does not come back.
#[test]
fn lost_stage_recovers_after_hysteresis_without_authority() {
    let mut bench = Bench::in_mode(Mode::PrepareToAct);
    lose(&mut bench, Guard::Thermal);
    bench.run(3000);
    assert_eq!(bench.core.mode(), Mode::Degraded);
    assert!(bench.driven() <= 1000);
    bench.missing.clear();
    bench.run(900);
    assert_eq!(bench.core.mode(), Mode::Degraded, "hysteresis");
    bench.run(300);
    assert_eq!(bench.core.mode(), Mode::Ready);
    assert!(bench.report.unwrap().authority.is_none());
}

/// The unit stops at once and holds within the bound.
#[test]
fn lost_localisation_stops_and_holds_in_time() {
    let mut bench = Bench::in_mode(Mode::Ready);
    bench.no_fix = true;
    bench.run(400);
    assert_eq!((bench.core.mode(), bench.driven()), (Mode::Degraded, 0));
    bench.run(500);
    assert_eq!(
        bench.transitions().last(),
        Some(&(Mode::Degraded, Mode::HoldSafe, Cause::Unrecovered(Guard::Localisation)))
    );
}

#[test]
fn a_fix_that_jumps_is_not_believed() {
    let mut bench = Bench::in_mode(Mode::Ready);
    bench.fix_offset = 3000;
    bench.run(100);
    assert_eq!(bench.core.mode(), Mode::Degraded);
    let believed = bench.report.as_ref().unwrap().pose.y_mm;
    assert!(believed.abs() < 100, "{believed}");
    bench.run(500);
    assert_eq!(bench.core.mode(), Mode::HoldSafe);
}

#[test]
fn lapsed_lease_holds_until_an_operator_resumes() {
    let mut bench = Bench::in_mode(Mode::Ready);
    bench.no_grants = true;
    bench.run(600);
    assert_eq!(bench.transitions().last().unwrap().1, Mode::HoldSafe);
    let silence = bench.events.iter().rev().find_map(|e| match e {
        Event::Transition { because, .. } => Some(*because),
        _ => None,
    });
    assert!(matches!(silence, Some(Because::Silence(_))));
    bench.no_grants = false;
    bench.run(3000);
    assert_eq!(bench.core.mode(), Mode::HoldSafe, "nothing goes on by itself");
    assert_eq!(bench.order(CommandKind::Resume), None);
    assert_eq!(bench.core.mode(), Mode::Ready);
}

#[test]
fn waiving_policy_admits_authority_only_as_ablation() {
    let mut policy = Policy::default();
    policy.boundary.insert(Check::Origin, Requirement::Waived);
    let mut bench = Bench::with_policy(policy.clone(), None);
    bench.reach(Mode::Ready);
    assert_eq!(bench.order(CommandKind::Arm(TRACK)), Some(Reason::Interlock));
    let mut bench = Bench::with_policy(policy, Some(Ablation { scenario: "test".into() }));
    bench.reach(Mode::PrepareToAct);
}

/// Else it goes the same way as the original.
#[test]
fn fork_has_its_own_authority_and_world() {
    let mut original = Bench::in_mode(Mode::PrepareToAct);
    let fork = original.core.fork(WorldId(9));
    let confirm = original.signed_order(CommandKind::Confirm(TRACK));
    original.publish(confirm.clone());
    original.core = fork;
    original.publish(confirm);
    assert_eq!(original.acts.len(), 2);
    let [first, second] = [original.acts[0], original.acts[1]];
    assert_eq!((first.world, second.world), (WorldId(1), WorldId(9)));
    assert_eq!(first, wire::drive::Act { world: WorldId(1), ..second });
}

#[test]
fn quiesced_core_sends_nothing_and_balances() {
    let mut bench = Bench::in_mode(Mode::Ready);
    bench.feed(&Input::Quiesce);
    let (drive, acks) = (bench.drive, bench.acks.len());
    bench.no_grants = true;
    bench.run(1000);
    assert_eq!(bench.core.mode(), Mode::Ready, "the run is over: nothing is decided any more");
    assert_eq!((bench.drive, bench.acks.len()), (drive, acks));
    bench.feed(&Input::Finish);
    let count = |wanted: &dyn Fn(Account) -> bool| -> u64 {
        let entry = |e: &Event| match e {
            Event::Count { account, n } if wanted(*account) => *n,
            _ => 0,
        };
        bench.events.iter().map(entry).sum()
    };
    let interface = Interface::Downlink;
    let received = count(&|a| a == Account::Received(interface));
    let judged =
        count(&|a| a == Account::Accepted(interface) || matches!(a, Account::Refused(place, _) if place == interface));
    assert!(received > 10 && received == judged, "{received} {judged}");
    assert!(matches!(bench.events.last(), Some(Event::Signed { .. })));
}
