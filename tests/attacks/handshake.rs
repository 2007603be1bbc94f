//! Handshakes and records on the real stacks in memory, named after the attack.

use evidence::trial::{Outcome, Trial};
use holdsafe_tests::root;

use crate::SEEDS;

/// Every trial of every cell of a shipped scenario, each within the classes that its cell expects.
fn expected(name: &str) -> Vec<(String, Trial)> {
    let scenario = scenario::load(&scenario::find(&root(), name).expect("a shipped scenario")).expect("it loads");
    let mut trials = Vec::new();
    for variation in scenario.variations(None) {
        let cell = variation.cell.expect("each is a cell");
        for seed in SEEDS {
            let trial = stacks::trial(&variation.scenario, seed).expect("it runs");
            let classes = &variation.scenario.expected;
            assert!(classes.contains(&trial.outcome), "{cell} seed {seed}: {:?} {:?}", trial.outcome, trial.findings);
            trials.push((cell.clone(), trial));
        }
    }
    assert!(!trials.is_empty());
    trials
}

#[test]
fn bad_certificate_is_refused_by_name() {
    for (cell, trial) in expected("certificates") {
        let certificate = cell.rsplit('/').next().expect("a name");
        let name = match certificate {
            "sound" => {
                assert!(trial.dropped.is_empty(), "{cell}");
                continue;
            }
            "revoked-later" => "revoked".to_owned(),
            "two-names" => "no_name".to_owned(),
            "other-name" => "wrong_name".to_owned(),
            other => other.replace('-', "_"),
        };
        assert_eq!(trial.dropped.keys().collect::<Vec<_>>(), [&name], "{cell}");
    }
}

#[test]
fn weak_protocol_handshake_is_refused_by_name() {
    for (cell, trial) in expected("downgrade") {
        let name = match cell.rsplit('/').next().expect("a name") {
            "version" => "version",
            "master-secret" => "master_secret",
            _ => "suite",
        };
        assert_eq!(trial.dropped.keys().collect::<Vec<_>>(), [name], "{cell}");
    }
}

#[test]
fn repeated_record_is_delivered_once() {
    for (cell, trial) in expected("record_replay") {
        let discarded = trial.dropped.get("discarded").copied().unwrap_or(0);
        assert_eq!(discarded, if cell == "replay" { 64 } else { 0 }, "{cell}");
    }
}

#[test]
fn copies_are_discarded_and_order_is_not_promised() {
    expected("record_flood");
}

#[test]
fn changed_record_is_discarded() {
    expected("record_damage");
}

/// Unknown peers cost honest ends nothing and keep no newcomer out.
#[test]
fn hundreds_of_unknown_peers_block_no_peer() {
    for (cell, trial) in expected("hello_storm") {
        let name = if cell.starts_with("broken") || cell.starts_with("noise") {
            ["malformed", "stranger"]
        } else {
            ["shed", "unfinished"]
        };
        assert!(name.iter().any(|name| trial.guard_refused.contains_key(*name)), "{cell}: {:?}", trial.guard_refused);
    }
}

#[test]
fn plaintext_ends_an_association_without_guard_only() {
    for (cell, trial) in expected("record_plaintext") {
        let off = cell.ends_with("guard-off");
        assert_eq!(trial.outcome == Outcome::Late, off, "{cell}");
        assert_eq!(trial.guard_refused.get("plaintext"), (!off).then_some(&1), "{cell}");
    }
}
