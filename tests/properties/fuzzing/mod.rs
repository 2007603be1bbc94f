//! Property-based attack fuzzing: generated attack sequences, over everything the shipped attack spaces allow, against
//! properties of every trial.
//!
//! Four parts: `transitions` is all that adversary and world can do, `system` the real cores in the twin, `reference` the
//! expected behaviour, written without them, `assertions` the properties of every trial. Their inputs are read by `deeds` off
//! the sequence and by `witness` off a second run of it. Drawing and shrinking are `search`'s.
//!
//! `HOLDSAFE_CASES=1000 cargo test fuzzing` tries more sequences of each attack space than the few of every day. A failure
//! prints the smallest sequence that shows it and the file with its scenario; moved into `tests/regressions/` it is a
//! regression from then on.

mod assertions;
mod deeds;
mod reference;
mod system;
mod transitions;
mod witness;

use system::System;
use transitions::Transitions;

#[test]
fn assertions_hold_against_a_keyless_relay() {
    fuzz("path");
}

#[test]
fn whatever_a_hostile_broker_does_every_assertion_holds() {
    fuzz("broker");
}

#[test]
fn assertions_hold_against_a_hostile_gateway() {
    fuzz("display");
}

#[test]
fn whichever_sensors_fail_every_assertion_holds() {
    fuzz("sensors");
}

#[test]
fn whichever_processes_end_or_hang_every_assertion_holds() {
    fuzz("processes");
}

#[test]
fn whatever_an_admitted_teammate_says_every_assertion_holds() {
    fuzz("teammates");
}

#[test]
fn assertions_hold_against_a_second_operator() {
    fuzz("stations");
}

#[test]
fn assertions_hold_against_a_keyless_station() {
    fuzz("roles");
}

#[test]
fn assertions_hold_against_a_keyless_memory_writer() {
    fuzz("memory");
}

/// A fabricated vehicle is excepted.
#[test]
fn assertions_hold_against_perceptions_keys() {
    fuzz("perception");
}

/// Every file among the attack spaces is fuzzed with: the name of each is in a test above.
#[test]
fn every_shipped_space_has_its_test() {
    let folder = holdsafe_tests::root().join("scenarios/spaces");
    let files = std::fs::read_dir(&folder).expect("the folder").flatten().map(|e| e.path());
    let named = files.map(|file| format!("    fuzz({:?});", file.file_stem().expect("a name").to_string_lossy()));
    let untested: Vec<String> = named.filter(|call| !include_str!("mod.rs").contains(call.as_str())).collect();
    assert!(untested.is_empty(), "{untested:?}");
}

fn fuzz(space: &str) {
    let transitions = Transitions::for_space(space);
    let system = System::new(&transitions);
    if let Some(failure) = system.first_failure(&transitions) {
        panic!("{failure}");
    }
}

/// A regression names its acceptable classes; the former fault is not among them.
#[test]
fn every_regression_stays_mended() {
    let folder = holdsafe_tests::root().join("tests/regressions");
    let mut files: Vec<_> = std::fs::read_dir(&folder).expect("the folder").flatten().map(|e| e.path()).collect();
    files.sort();
    assert!(!files.is_empty(), "no regression in {}", folder.display());
    for file in files {
        let ready = holdsafe_tests::file(&file);
        let run = ready.run(1);
        let outcome = run.verdict.outcome;
        let expected = &ready.scenario.expected;
        assert!(expected.contains(&outcome), "{}: {outcome:?}, {:?}", file.display(), run.verdict.findings);
    }
}

#[test]
fn every_assertion_fails_on_a_breaking_trial() {
    for assertion in assertions::all() {
        let (sound, broken) = (assertion.examples)();
        assert_eq!((assertion.holds)(&sound), Ok(()), "{}: on a sound trial", assertion.name);
        assert!((assertion.holds)(&broken).is_err(), "{}: on a broken trial", assertion.name);
    }
}

/// An assertion that cannot be broken is no test.
#[test]
#[ignore = "long: a search for each check"]
fn every_single_check_assertion_breaks_without_it() {
    let unbroken = assertions::all().filter_map(|assertion| {
        let (check, space) = assertion.carried_by?;
        let transitions = Transitions::for_space(space).without_check(check);
        let breaks = System::new(&transitions).breaks(&transitions, assertion);
        (!breaks).then(|| format!("{} holds without {check} too, over {space}", assertion.name))
    });
    assert_eq!(unbroken.collect::<Vec<_>>(), Vec::<String>::new());
}
