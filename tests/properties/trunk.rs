//! A run whose cores follow a baseline run is, byte for byte, the run that it is without.

use std::sync::Arc;

use holdsafe_tests::{Ready, shipped};
use scenario::{Alphabet, Scenario};
use search::{AttackSequence, Moments, SearchConfig};
use twin::part::Part;
use twin::part::baseline::Baseline;
use twin::trial::{baseline, start, start_following};

use crate::forks::finish;

/// Number of a run's cores that followed its baseline to the end, and of all.
fn along_to_the_end(ready: &Ready, seed: u64, known: &Arc<Baseline>, of: &Scenario, word: &str) -> (usize, usize) {
    let (topology, twin) = start(of, &ready.setup, seed, false).expect("it starts");
    let alone = finish(twin, topology.duration);
    let (topology, mut twin) = start_following(of, &ready.setup, seed, known).expect("it starts");
    twin.run_until(topology.duration);
    twin.finish(1_500_000);
    // Every byte, signatures too.
    assert!(twin.log() == alone, "{word}");
    let follows = |part: &Part| matches!(part, Part::Following(along) if along.follows());
    (twin.nodes().iter().filter(|node| follows(&node.part)).count(), twin.nodes().len())
}

/// And is the same.
#[test]
fn run_following_its_own_trunk_computes_nothing() {
    let ready = shipped("nominal");
    let known = Arc::new(baseline(&ready.scenario, &ready.setup, 3).expect("it runs"));
    let (along, all) = along_to_the_end(&ready, 3, &known, &ready.scenario, "nothing");
    assert_eq!(along, all);
}

#[test]
fn run_along_a_trunk_is_unchanged_under_attack() {
    let ready = shipped("nominal");
    for file in std::fs::read_dir(holdsafe_tests::root().join("scenarios/alphabets")).expect("the folder").flatten() {
        let alphabet = Alphabet::load(&file.path()).expect("a shipped alphabet");
        let nothing = AttackSequence::default().in_scenario(&alphabet, &ready.scenario).expect("it fits");
        let known = Arc::new(baseline(&nothing, &ready.setup, 1).expect("it runs"));
        let ground = SearchConfig::new(ready.scenario.clone(), ready.setup.clone(), 1, alphabet).expect("it runs");
        let nominal = ground.try_word(&AttackSequence::default()).expect("it runs");
        let moments = Moments::of(&nominal, &ground.alphabet, &ready.setup.bounds);
        let words = ground.words(1, &moments, 10_000).expect("few words");
        let (mut followed, mut left) = (0, 0);
        for word in words.iter().step_by(9) {
            let of = word.in_scenario(&ground.alphabet, &ready.scenario).expect("it fits");
            let (along, all) = along_to_the_end(&ready, 1, &known, &of, &word.told(&ground.alphabet));
            (followed, left) = (followed + along, left + all - along);
        }
        let name = ground.alphabet.name.as_str();
        assert!(followed > 0 && left > 0, "{name}: {followed} cores went along to the end, {left} did not");
    }
}
