//! Processes that end.

use campaign::scenario::Process;
use campaign::trial::Outcome;
use holdsafe_tests::{Ready, shipped};

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
