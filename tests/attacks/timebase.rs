//! Time and delay: a receiver's time that is steered, delays that hover, creep or were always there, contact by turns.

use campaign::oracle::{Property, judge};
use campaign::trial::Outcome;
use campaign::twin::trial::Run;
use holdsafe_tests::shipped;
use wire::event::{Action, Event};
use wire::mode::Guard;
use wire::policy::{Check, Requirement};

use crate::SEEDS;

#[test]
fn a_receivers_time_that_steps_runs_back_or_away_holds_and_nothing_stale_is_accepted() {
    for name in ["time_step", "time_rollback", "time_drift"] {
        for run in shipped(name).expect(SEEDS) {
            let lost = run.verdict.transitions.iter().any(|t| t.cause == "lost:time_base");
            assert!(lost, "{name}: {:?}", run.verdict.transitions);
            let refused = |e: &Event| matches!(e, Event::Refused { .. });
            let mut after = run.evidence.entries.iter().filter(|w| Some(w.at) >= run.verdict.zero);
            assert!(after.all(|w| !refused(&w.entry.event)), "{name}: no age hangs on that time");
        }
    }
}

/// No age, lease or freshness rests on the receiver's time: without its guard nothing comes of steering it.
#[test]
fn without_its_guard_a_steered_time_changes_nothing() {
    let mut ready = shipped("time_rollback");
    ready.setup.policy.guards.insert(Guard::TimeBase, Requirement::Waived);
    for seed in SEEDS {
        let verdict = ready.run(seed).verdict;
        assert_eq!((verdict.outcome, verdict.findings), (Outcome::Undetected, vec![]));
    }
}

#[test]
fn a_delay_that_was_there_before_the_first_record_is_not_taken_for_usual() {
    for run in shipped("delay_at_handshake").expect(SEEDS) {
        assert_eq!(run.verdict.transitions, [], "never enabled");
    }
}

#[test]
fn a_creeping_delay_ends_supervision_while_every_record_is_still_younger_than_the_window() {
    for run in shipped("delay_creeping").expect(1..2) {
        assert_eq!(run.verdict.findings, []);
    }
}

/// At the edge of the window the mode changes at most once in ten windows by itself.
#[test]
fn at_the_edge_of_the_window_the_mode_does_not_flicker() {
    let ready = shipped("delay_edge");
    let apart = 10.0 * ready.setup.bounds.freshness_ms as f64;
    for run in ready.expect(1..60) {
        let own = run.verdict.transitions.iter().filter(|t| t.cause != "operator" && t.t_ms >= 4000.0);
        let times: Vec<f64> = own.filter(|t| t.cause != "expired").map(|t| t.t_ms).collect();
        assert!(times.windows(2).all(|pair| pair[1] - pair[0] >= apart), "{:?}", run.verdict.transitions);
    }
}

#[test]
fn contact_by_turns_holds_in_each_gap_and_goes_on_only_when_the_operator_says_so() {
    for run in shipped("contact_windows").expect(SEEDS) {
        let held = |run: &Run| run.verdict.transitions.iter().filter(|t| t.to == "HOLD_SAFE").count();
        assert_eq!(held(&run), 3, "{:?}", run.verdict.transitions);
        let left = run.verdict.transitions.iter().filter(|t| t.from == "HOLD_SAFE");
        let causes: Vec<&str> = left.map(|t| t.cause.as_str()).collect();
        assert_eq!(causes, ["operator"; 3], "{:?}", run.verdict.transitions);
    }
}

/// The check on stale acceptance has been seen to fail: without freshness, what was held back for longer than *Tf* gets in.
#[test]
fn without_freshness_stale_records_are_accepted_and_the_oracle_says_so() {
    let mut ready = shipped("delay");
    ready.setup.policy.boundary.insert(Check::Freshness, Requirement::Waived);
    let run = ready.run(1);
    let stale =
        |p: &[campaign::oracle::Finding]| p.iter().any(|f| f.property == Property::P7 && f.what.contains("accepted"));
    assert!(stale(&run.verdict.findings), "{:?}", run.verdict.findings);
    // And it rests on the relay's log: a relay that held nothing back leaves nothing to find.
    let mut evidence = run.evidence;
    evidence.entries.retain(|w| !matches!(w.entry.event, Event::Attack { action: Action::Delay, .. }));
    assert!(!stale(&judge(&evidence).findings));
}
