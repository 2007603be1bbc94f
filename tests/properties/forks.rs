//! A fork goes on exactly as the run it was taken from, and leaves that run alone.

use campaign::evidence::{Logged, hashes, read};
use campaign::twin::Twin;
use campaign::twin::trial::start;
use holdsafe_tests::{Ready, shipped};
use wire::id::WorldId;

/// Hash of what was logged from `from` on, to the end of the run.
fn finish(mut twin: Twin, end: u64) -> Vec<Logged> {
    twin.run_until(end);
    twin.finish(1_500_000);
    twin.log().to_vec()
}

fn forks_agree(ready: &Ready, seed: u64, ticks: impl Iterator<Item = u64>) {
    let (cast, twin) = start(&ready.scenario, &ready.setup, seed, false).expect("a shipped scenario starts");
    let whole = hashes(&read(&finish(twin, cast.duration)).0);
    let (_, mut trunk) = start(&ready.scenario, &ready.setup, seed, false).expect("a shipped scenario starts");
    for (i, tick) in ticks.enumerate() {
        trunk.run_until(tick);
        let fork = trunk.fork(WorldId(1 + i as u64));
        let forked = hashes(&read(&finish(fork, cast.duration)).0);
        assert_eq!(forked, whole, "fork at {tick} µs");
    }
    let trunk = hashes(&read(&finish(trunk, cast.duration)).0);
    assert_eq!(trunk, whole, "the trunk after its forks");
}

#[test]
fn forks_at_a_hundred_ticks_end_as_the_unforked_run() {
    // Ascending ticks drawn by a fixed linear congruence over the 9 s of the run.
    let ready = shipped("nominal");
    let mut ticks: Vec<u64> = (0..100u64).map(|i| (i * 7_919 + 13) * 104_729 % 9_000_000).collect();
    ticks.sort_unstable();
    forks_agree(&ready, 3, ticks.into_iter());
}

#[test]
fn forks_in_the_middle_of_an_attack_end_as_the_unforked_run() {
    for name in ["replay", "thermal_loss"] {
        forks_agree(&shipped(name), 5, [4_050_000, 4_400_000, 5_000_000].into_iter());
    }
}
