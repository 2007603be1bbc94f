//! A run whose cores follow a baseline run is, byte for byte, the run that it is without.

use std::sync::Arc;

use holdsafe_tests::{Ready, shipped};
use scenario::{AttackSpace, Scenario};
use search::{AttackSequence, Moments, SearchConfig};
use twin::part::Part;
use twin::part::baseline::Baseline;
use twin::trial::{baseline, start, start_following};

use crate::forks::finish;

/// Number of a run's cores that followed its baseline to the end, and of all.
fn along_to_the_end(
    ready: &Ready,
    seed: u64,
    known: &Arc<Baseline>,
    scenario: &Scenario,
    sequence: &str,
) -> (usize, usize) {
    let (topology, twin) = start(scenario, &ready.setup, seed, false).expect("it starts");
    let single_log = finish(twin, topology.duration);
    let (topology, mut twin) = start_following(scenario, &ready.setup, seed, known).expect("it starts");
    twin.run_until(topology.duration);
    twin.finish(1_500_000);
    // Every byte, signatures too.
    assert!(twin.log() == single_log, "{sequence}");
    let follows = |part: &Part| matches!(part, Part::Following(along) if along.follows());
    (twin.nodes().iter().filter(|node| follows(&node.part)).count(), twin.nodes().len())
}

/// The run has the same result as its trunk.
#[test]
fn run_following_its_own_trunk_computes_nothing() {
    let ready = shipped("nominal");
    let known = Arc::new(baseline(&ready.scenario, &ready.setup, 3).expect("it runs"));
    let (along, all) = along_to_the_end(&ready, 3, &known, &ready.scenario, "nothing");
    assert_eq!(along, all);
}

#[test]
#[ignore = "long: every attack space"]
fn run_along_a_trunk_is_unchanged_under_attack() {
    let ready = shipped("nominal");
    for file in std::fs::read_dir(holdsafe_tests::root().join("scenarios/spaces")).expect("the folder").flatten() {
        let space = AttackSpace::load(&file.path()).expect("a shipped attack space");
        let empty_scenario = AttackSequence::default().in_scenario(&space, &ready.scenario).expect("it fits");
        let known = Arc::new(baseline(&empty_scenario, &ready.setup, 1).expect("it runs"));
        let config = SearchConfig::new(ready.scenario.clone(), ready.setup.clone(), 1, space).expect("it runs");
        let nominal = config.try_sequence(&AttackSequence::default()).expect("it runs");
        let moments = Moments::from_run(&nominal, &config.space, &ready.setup.bounds);
        let sequences = config.sequences(1, &moments, 10_000).expect("few sequences");
        let (mut followed, mut left) = (0, 0);
        for sequence in sequences.iter().step_by(9) {
            let scenario = sequence.in_scenario(&config.space, &ready.scenario).expect("it fits");
            let (along, all) = along_to_the_end(&ready, 1, &known, &scenario, &sequence.describe(&config.space));
            (followed, left) = (followed + along, left + all - along);
        }
        let name = config.space.name.as_str();
        assert!(followed > 0 && left > 0, "{name}: {followed} cores went along to the end, {left} did not");
    }
}
