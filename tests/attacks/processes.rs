//! Processes that end, hang or are slow.

use campaign::oracle::demise::Fate;
use campaign::oracle::judge;
use campaign::scenario::{DisplayedState, Ending, Process, Settings};
use campaign::trial::Outcome;
use holdsafe_tests::{Ready, shipped, variations};
use wire::event::Event;
use wire::id::NodeId;
use wire::mode::Mode;

use crate::SEEDS;

/// The null attack with one process killed, as `holdsafe bench kill` runs it.
fn killing(process: Process, expected: Outcome) -> Ready {
    let nominal = shipped("nominal");
    Ready { scenario: nominal.scenario.killing(process, &[expected]), ..nominal }
}

#[test]
fn when_autonomy_is_killed_the_plant_brakes_by_its_own_lease() {
    for run in killing(Process::Autonomy, Outcome::HoldSafe).expect(SEEDS) {
        let [response] = &run.verdict.responses[..] else { panic!("{:?}", run.verdict.responses) };
        let plant = response.plant.expect("the world lives on");
        assert!(plant.speed_mm_s > 1000, "it was driving: {plant:?}");
        let lease = plant.lease_ended_ms.expect("the lease ends");
        let asked = run.evidence.bounds.set_point_lease_ms as f64;
        assert!(lease > 0.0 && lease <= asked + 10.0, "one step after the lease at the latest: {plant:?}");
        assert!(plant.standing_ms.expect("it stands") > lease, "{plant:?}");
    }
}

#[test]
fn a_unit_that_asked_for_a_lease_beyond_th_and_is_killed_is_stopped_by_the_plant_within_th() {
    let mut ready = killing(Process::Autonomy, Outcome::HoldSafe);
    ready.setup.bounds.set_point_lease_ms = 5000;
    for run in ready.expect(SEEDS) {
        let lease = run.verdict.responses[0].plant.and_then(|plant| plant.lease_ended_ms);
        assert!(lease.is_some_and(|ms| ms > 900.0), "the plant's own limit ended it: {lease:?}");
    }
}

#[test]
fn every_process_that_is_killed_leaves_the_platform_in_the_mode_that_was_stated() {
    for (process, expected) in [
        (Process::Sim, Outcome::HoldSafe),
        (Process::Perception, Outcome::HoldSafe),
        (Process::Gateway, Outcome::HoldSafe),
        (Process::Adversary, Outcome::HoldSafe),
        (Process::Broker, Outcome::HoldSafe),
        (Process::Recorder, Outcome::Degraded),
        (Process::Console, Outcome::Undetected),
    ] {
        for run in killing(process, expected).expect(SEEDS) {
            let [response] = &run.verdict.responses[..] else { panic!("{:?}", run.verdict.responses) };
            assert!(response.kept, "{:?}", run.verdict.findings);
        }
    }
}

/// The mission of `process_ends` with something else befalling somebody at one change of mode.
fn ending_at(process: Process, ending: Ending, change: (DisplayedState, DisplayedState)) -> Ready {
    let mission = shipped("process_ends");
    Ready { scenario: mission.scenario.ending_at(process, ending, change), ..mission }
}

const ARMING: (DisplayedState, DisplayedState) = (DisplayedState::Ready, DisplayedState::PrepareToAct);

#[test]
fn a_gateway_that_hangs_at_arming_takes_its_grants_with_it_and_brings_nothing_back() {
    for run in shipped("process_ends").expect(SEEDS) {
        let [response] = &run.verdict.responses[..] else { panic!("{:?}", run.verdict.responses) };
        assert!(response.kept && response.fate == Fate::Hang, "{response:?} {:?}", run.verdict.findings);
        assert!(response.restricted_ms.is_some_and(|ms| ms <= 1000.0), "{response:?}");
    }
}

#[test]
fn a_unit_that_did_not_run_holds_before_it_hears_what_waited_for_it() {
    for run in ending_at(Process::Autonomy, Ending::Hang, ARMING).expect(SEEDS) {
        let [response] = &run.verdict.responses[..] else { panic!("{:?}", run.verdict.responses) };
        let lease = response.plant.and_then(|plant| plant.lease_ended_ms);
        assert!(lease.is_some_and(|ms| ms <= 310.0), "the plant did not wait for it: {response:?}");
        let after = run.verdict.transitions.iter().find(|t| t.t_ms > response.killed_ms + 1.0).expect("it changes");
        assert_eq!((after.to.as_str(), after.cause.as_str()), ("HOLD_SAFE", "lost:lease"));
    }
}

#[test]
fn a_unit_that_did_not_run_for_less_than_its_products_live_goes_on() {
    let mut ready = ending_at(Process::Autonomy, Ending::Hang, ARMING);
    let short = serde_json::json!(0.15);
    ready.scenario = Settings::one("kill.0.duration_s", short).applied_to(&ready.scenario).expect("a duration");
    for seed in SEEDS {
        let run = ready.run(seed);
        let kept = run.verdict.responses.iter().all(|r| r.kept);
        let restricted = run.verdict.transitions.iter().any(|t| t.cause.starts_with("lost"));
        assert!(kept && !restricted, "{:?} {:?}", run.verdict.findings, run.verdict.transitions);
    }
}

#[test]
fn a_unit_that_is_started_again_is_idle_and_arms_nothing_by_itself() {
    let mut ready = ending_at(Process::Autonomy, Ending::Kill, ARMING);
    let again = serde_json::json!(1.0);
    ready.scenario = Settings::one("kill.0.restart_after_s", again).applied_to(&ready.scenario).expect("a restart");
    for run in ready.expect(SEEDS) {
        let restarted = run.evidence.entries.iter().find_map(|w| match w.entry.event {
            Event::Restarted { node: NodeId::UNIT_A, boot } => Some((w.at, boot.0)),
            _ => None,
        });
        let (at, boot) = restarted.expect("it is started again");
        assert_eq!(boot, 2);
        let heard = |w: &campaign::oracle::Witnessed| w.at > at && w.entry.node == NodeId::GATEWAY;
        let reports = run.evidence.entries.iter().filter(|w| heard(w)).any(|w| match w.entry.event {
            Event::Accepted { record, .. } => record.node == NodeId::UNIT_A && record.boot.0 == 2,
            _ => false,
        });
        assert!(reports, "it reports under its new boot");
        let later: Vec<_> = run.verdict.transitions.iter().filter(|t| t.t_ms > at as f64 / 1000.0).collect();
        assert!(later.is_empty(), "nobody enabled it: {later:?}");
    }
}

#[test]
fn a_process_that_is_said_to_hang_and_goes_on_writing_is_no_evidence() {
    let attacked = shipped("process_ends").run(1);
    let mut ready = shipped("process_ends");
    ready.scenario.kill = Default::default();
    let mut quiet = ready.run(1);
    let claims = attacked.evidence.entries.iter().filter(|w| w.entry.node == NodeId::CAMPAIGN);
    quiet.evidence.entries.extend(claims.copied());
    quiet.evidence.entries.sort_by_key(|w| w.at);
    quiet.evidence.planned = attacked.evidence.planned;
    let verdict = judge(&quiet.evidence);
    assert_eq!((verdict.receipt, verdict.outcome), (false, Outcome::Invalid), "{:?}", verdict.findings);
}

#[test]
fn losses_are_noticed_in_time_with_half_and_with_a_quarter_of_the_processor() {
    for name in ["constrained_loss", "constrained_blackout"] {
        let cells = variations(name);
        assert_eq!(cells.len(), 2);
        cells.iter().for_each(|cell| drop(cell.expect(SEEDS)));
    }
}

#[test]
fn products_that_miss_their_deadline_are_a_lost_stage() {
    shipped("slow_inference").expect(SEEDS);
}

/// The same log without the hold: the judge has to miss it.
#[test]
fn a_unit_that_goes_on_after_a_hang_as_if_nothing_had_been_is_late() {
    let mut run = ending_at(Process::Autonomy, Ending::Hang, ARMING).run(1);
    let holds = |event: &Event| matches!(event, Event::Transition { to: Mode::HoldSafe, .. });
    run.evidence.entries.retain(|w| !holds(&w.entry.event));
    let verdict = judge(&run.evidence);
    // The display heard of the hold, so it is at odds with the cut log as well (P7).
    assert!(matches!(verdict.outcome, Outcome::Late | Outcome::Unsafe), "{:?}", verdict.outcome);
    assert!(verdict.findings.iter().any(|f| f.what.contains("in which it did not run")), "{:?}", verdict.findings);
}
