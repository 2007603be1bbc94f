//! Same seed, same log; another seed, another log.

use campaign::evidence::hashes;
use holdsafe_tests::shipped;

#[test]
fn the_same_seed_gives_the_same_log_and_another_seed_another() {
    for name in ["nominal", "replay", "loss"] {
        let ready = shipped(name);
        let of = |seed| hashes(&ready.run(seed).evidence.entries);
        let (first, again, other) = (of(1), of(1), of(2));
        assert_eq!(first, again, "{name}");
        assert_ne!(first.0, other.0, "{name}: log");
        assert_ne!(first.1, other.1, "{name}: decisions");
    }
}
