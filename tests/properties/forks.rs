//! A fork continues exactly as the run it was taken from, and leaves that run alone; a branch continues by its own random
//! draws, in the values that the scenario lets vary and in no others.

use evidence::log::{Logged, hashes};
use holdsafe_tests::{Ready, shipped};
use recording::log::read_log;
use twin::Twin;
use twin::trial::start;
use wire::id::WorldId;

/// The log of a run to its end.
pub(super) fn finish(mut twin: Twin, end: u64) -> Vec<Logged> {
    twin.run_until(end);
    twin.finish(1_500_000);
    twin.log().to_vec()
}

fn forks_agree(ready: &Ready, seed: u64, ticks: impl Iterator<Item = u64>) {
    let (topology, twin) = start(&ready.scenario, &ready.setup, seed, false).expect("a shipped scenario starts");
    let whole = hashes(&read_log(&finish(twin, topology.duration)).0);
    let (_, mut trunk) = start(&ready.scenario, &ready.setup, seed, false).expect("a shipped scenario starts");
    for (i, tick) in ticks.enumerate() {
        trunk.run_until(tick);
        let fork = trunk.fork(WorldId(1 + i as u64));
        let forked = hashes(&read_log(&finish(fork, topology.duration)).0);
        assert_eq!(forked, whole, "fork at {tick} µs");
    }
    let trunk = hashes(&read_log(&finish(trunk, topology.duration)).0);
    assert_eq!(trunk, whole, "the trunk after its forks");
}

#[test]
fn forks_end_as_the_unforked_run() {
    // Ascending ticks drawn by a fixed linear congruence over the 9 s of the run.
    let ready = shipped("nominal");
    let mut ticks: Vec<u64> = (0..100u64).map(|i| (i * 7_919 + 13) * 104_729 % 9_000_000).collect();
    ticks.sort_unstable();
    forks_agree(&ready, 3, ticks.into_iter());
}

#[test]
fn forks_during_an_attack_end_the_same() {
    for name in ["replay", "thermal_loss"] {
        forks_agree(&shipped(name), 5, [4_050_000, 4_400_000, 5_000_000].into_iter());
    }
}

/// Time of branching: behind the act, so that no authority names a world any more.
const BRANCHES_AT: u64 = 6_000_000;

/// Logs of a fork and two kinds of branches behind `BRANCHES_AT`.
fn fork_and_branches(ready: &Ready, seeds: [u64; 2]) -> (Vec<Logged>, [Vec<Logged>; 2]) {
    let (topology, mut trunk) = start(&ready.scenario, &ready.setup, 3, false).expect("a shipped scenario starts");
    trunk.run_until(BRANCHES_AT);
    let before = trunk.log().len();
    let branches = seeds.map(|seed| finish(trunk.branch(seed, &ready.scenario.varies), topology.duration));
    let fork = finish(trunk.fork(WorldId(1)), topology.duration);
    (fork[before..].to_vec(), branches)
}

#[test]
fn branch_draws_by_its_seed_without_recording() {
    let ready = shipped("nominal");
    let (fork, [one, same]) = fork_and_branches(&ready, [7, 7]);
    assert_eq!(one, same, "the same seed");
    assert_ne!(one, fork, "chances of its own");
    assert_ne!(one, fork_and_branches(&ready, [8, 8]).1[0], "another seed");
    let (_, problem) = read_log(&one);
    assert!(problem.is_some(), "a log without its beginning passes for a run's");
}

#[test]
fn branch_redraws_only_varied_values() {
    let mut ready = shipped("nominal");
    (ready.scenario.varies.noise, ready.scenario.varies.delays) = (false, false);
    let (fork, [one, other]) = fork_and_branches(&ready, [7, 8]);
    assert!(fork == one && fork == other, "links without loss, no noise, no delays: there is nothing to draw");
}

#[test]
fn each_source_of_chance_redraws_by_itself() {
    let lossy = || {
        let mut ready = shipped("nominal").scenario.soak(9.0, 0.2);
        (ready.varies.noise, ready.varies.delays) = (false, false);
        ready
    };
    let (mut noisy, mut late) = (lossy().soak(9.0, 0.0), lossy().soak(9.0, 0.0));
    (noisy.varies.noise, late.varies.delays) = (true, true);
    for (what, scenario) in [("loss", lossy()), ("noise", noisy), ("delays", late)] {
        let ready = Ready { scenario, ..shipped("nominal") };
        let (fork, [one, other]) = fork_and_branches(&ready, [7, 8]);
        assert!(one != fork && one != other, "{what} went on as it was");
    }
}
