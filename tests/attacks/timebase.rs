//! Time and delay: a receiver's time that is steered, delays that hover, creep or were always there, contact by turns.

use evidence::trial::Outcome;
use ground_truth::{Action, Any, Note};
use holdsafe_tests::shipped;
use oracle::{Finding, Property, judge};
use twin::trial::Run;
use wire::event::Event;
use wire::id::Nonce;
use wire::mode::Guard;
use wire::policy::{Check, Requirement};
use wire::time::{AgeBound, Echo, Instant, MAX_DRIFT_PPM, PeerStamp, Span};

use crate::SEEDS;

/// Steps, running back or away; no stale record is accepted.
#[test]
fn receiver_time_attacks_hold() {
    for name in ["time_step", "time_rollback", "time_drift"] {
        for run in shipped(name).expect(SEEDS) {
            let lost = run.verdict.transitions.iter().any(|t| t.cause == "lost:time_base");
            assert!(lost, "{name}: {:?}", run.verdict.transitions);
            let refused = |e: &Any| matches!(e, Any::Service(Event::Refused { .. }));
            let mut after = run.evidence.entries.iter().filter(|w| Some(w.at) >= run.verdict.zero);
            assert!(after.all(|w| !refused(&w.entry.event)), "{name}: no age hangs on that time");
        }
    }
}

/// No age, lease or freshness rests on the receiver's time: without its guard steering it has no effect.
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
fn initial_delay_is_not_taken_for_usual() {
    for run in shipped("delay_at_handshake").expect(SEEDS) {
        assert_eq!(run.verdict.transitions, [], "never enabled");
    }
}

/// Every record is still younger than the window.
#[test]
fn creeping_delay_ends_supervision_within_the_window() {
    for run in shipped("delay_creeping").expect(1..2) {
        assert_eq!(run.verdict.findings, []);
    }
}

/// At the edge of the window the mode changes at most once in ten windows by itself.
#[test]
fn mode_is_steady_at_the_windows_edge() {
    let ready = shipped("delay_edge");
    let distance = 10.0 * ready.setup.bounds.freshness_ms as f64;
    for run in ready.expect(1..60) {
        let own_rows = run.verdict.transitions.iter().filter(|t| t.cause != "operator" && t.t_ms >= 4000.0);
        let times: Vec<f64> = own_rows.filter(|t| t.cause != "expired").map(|t| t.t_ms).collect();
        assert!(times.windows(2).all(|pair| pair[1] - pair[0] >= distance), "{:?}", run.verdict.transitions);
    }
}

/// The unit continues only on an order of the operator.
#[test]
fn alternating_contact_holds_in_each_gap() {
    for run in shipped("contact_windows").expect(SEEDS) {
        let held = |run: &Run| run.verdict.transitions.iter().filter(|t| t.to == "HOLD_SAFE").count();
        assert_eq!(held(&run), 3, "{:?}", run.verdict.transitions);
        let left = run.verdict.transitions.iter().filter(|t| t.from == "HOLD_SAFE");
        let causes: Vec<&str> = left.map(|t| t.cause.as_str()).collect();
        assert_eq!(causes, ["operator"; 3], "{:?}", run.verdict.transitions);
    }
}

/// The check on stale acceptance has been seen to fail: without freshness, records held back for longer than *Tf* get in.
#[test]
fn freshness_waiver_accepts_stale_and_is_detected() {
    let mut ready = shipped("delay");
    ready.setup.policy.boundary.insert(Check::Freshness, Requirement::Waived);
    let run = ready.run(1);
    let stale = |p: &[Finding]| p.iter().any(|f| f.property == Property::P7 && f.message.contains("accepted"));
    assert!(stale(&run.verdict.findings), "{:?}", run.verdict.findings);
    // And it rests on the relay's log: a relay that held nothing back leaves nothing to find.
    let mut evidence = run.evidence;
    evidence.entries.retain(|w| !matches!(w.entry.event, Any::Instrument(Note::Attack { action: Action::Delay, .. })));
    assert!(!stale(&judge(&evidence).findings));
}

/// Ages of the records of a peer with a clock `ppm` too fast, with `way` microseconds from one to the other: each with the
/// time since the challenge went out.
fn ages(ppm: i64, way: u64) -> Vec<(u64, Option<u64>)> {
    let our_time = |true_us: u64| Instant(1_000_000_000 + true_us);
    let peer_time =
        |true_us: u64| PeerStamp(5_000_000_000 + true_us.saturating_add_signed(true_us as i64 * ppm / 1_000_000));
    let mut bound = AgeBound::new(Span::s(3));
    bound.issue(Nonce(7), our_time(0));
    assert!(bound.prove(Echo { nonce: Nonce(7), seen: peer_time(way) }));
    let written = (way..3_000_000 - way).step_by(9_973);
    written.map(|t| (t, bound.age(peer_time(t), our_time(t + way)).map(|age| age.upper().0))).collect()
}

/// A clock that costs neither hides little of a record's age.
#[test]
fn wrong_host_clock_costs_age_or_supervision() {
    for way in [300, 3_000, 30_000] {
        for ppm in [-100_000, -1_000, 0, MAX_DRIFT_PPM as i64] {
            assert!(ages(ppm, way).iter().all(|(_, age)| age.is_some_and(|age| age + 1 >= way)), "{ppm} {way}");
        }
        for ppm in [500, 1_000, 10_000, 100_000] {
            let hidden = 3 * (ppm as u64 - MAX_DRIFT_PPM);
            let believed = ages(ppm, way).into_iter().filter_map(|(_, age)| age);
            assert!(believed.into_iter().all(|age| age + hidden + 1 >= way), "{ppm} {way}");
        }
    }
    let refused = ages(1_000, 300).into_iter().find(|(_, age)| age.is_none());
    assert!(refused.is_some_and(|(since, _)| since < 1_500_000), "{refused:?}: its stamps are ahead of what can be");
}
