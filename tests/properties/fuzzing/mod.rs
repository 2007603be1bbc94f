//! Property-based attack fuzzing: words that nobody wrote down, over everything the shipped alphabets allow, against what must
//! hold whatever is done.
//!
//! Four files: `transitions` is all that adversary and world can do, `system` the real cores in the twin, `reference` what
//! should happen, said without them, `assertions` what must hold of every trial. Drawing and shrinking are `campaign::search`'s.
//!
//! `HOLDSAFE_CASES=1000 cargo test fuzzing` tries more words of each alphabet than the few of every day. A failure prints the
//! smallest word that shows it and the file with its scenario; moved into `tests/regressions/` it is a regression from then on.

mod assertions;
mod reference;
mod system;
mod transitions;

use assertions::ASSERTIONS;
use system::System;
use transitions::Transitions;

#[test]
fn whatever_a_relay_without_a_key_does_every_assertion_holds() {
    fuzz("path");
}

#[test]
fn whatever_a_hostile_broker_does_every_assertion_holds() {
    fuzz("broker");
}

#[test]
fn whatever_a_gateway_in_other_hands_does_to_the_display_every_assertion_holds() {
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

fn fuzz(alphabet: &str) {
    let transitions = Transitions::of(alphabet);
    let system = System::new(&transitions);
    if let Some(failure) = system.first_failure(&transitions) {
        panic!("{failure}");
    }
}

/// A regression says what must come of it; what once went wrong is not among that.
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
fn every_assertion_fails_on_a_trial_that_breaks_it() {
    for assertion in ASSERTIONS {
        let (sound, broken) = (assertion.examples)();
        assert_eq!((assertion.holds)(&sound), Ok(()), "{}: on a sound trial", assertion.name);
        assert!((assertion.holds)(&broken).is_err(), "{}: on a broken trial", assertion.name);
    }
}
