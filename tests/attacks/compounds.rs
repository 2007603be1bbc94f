//! Campaigns of several hands at once (K1, K3): what holds against each alone has to hold against them together.

use holdsafe_tests::shipped;
use wire::event::{Event, Freshness, ShownAs};
use wire::id::{NodeId, UnitId};
use wire::mode::Mode;
use wire::refusal::Reason;

use crate::SEEDS;

#[test]
fn with_the_link_down_liveness_faked_and_the_view_kept_the_unit_holds_and_nothing_old_is_shown_fresh() {
    for run in shipped("link_down_view_kept").expect(SEEDS) {
        let bounds = &run.evidence.bounds;
        let begun = |of: &Event| matches!(of, Event::Step { step, begun: true } if step.as_str() == "cut");
        let cut = run.evidence.entries.iter().find(|w| begun(&w.entry.event)).expect("the link was cut").at;
        let held = run.verdict.transitions.iter().find(|t| t.to == "HOLD_SAFE").expect("it holds");
        let took = held.t_ms - cut as f64 / 1000.0;
        assert!((0.0..=bounds.to_hold_safe_ms as f64).contains(&took), "{took} ms after the cut");
        // What is shown as fresh was made no longer ago than it takes for the last report to age out.
        let limit = cut + bounds.freshness_ms * 1000;
        let mut shown = run.evidence.entries.iter().filter_map(|w| match w.entry.event {
            Event::Displayed { unit: UnitId::A, freshness, .. } if w.at > limit => Some(freshness),
            _ => None,
        });
        assert!(shown.next().is_some_and(|f| f != Freshness::Fresh) && shown.all(|f| f != Freshness::Fresh));
    }
}

#[test]
fn an_operator_whose_counter_is_run_ahead_and_whose_hold_is_kept_back_is_heard_by_the_silence() {
    for run in shipped("locked_out_then_drift").expect(SEEDS) {
        let jumps = run.evidence.entries.iter().filter(|w| {
            let jump = matches!(w.entry.event, Event::Refused { reason: Reason::Jump, .. });
            jump && w.entry.node == NodeId::UNIT_A
        });
        assert!(jumps.count() > 0, "the lock-out was tried");
        let hold = run.evidence.entries.iter().find_map(|w| match w.entry.event {
            Event::Intended { kind, .. } if kind.name() == "hold" => Some(w.at as f64 / 1000.0),
            _ => None,
        });
        let hold = hold.expect("the operator holds");
        let held = run.verdict.transitions.iter().find(|t| t.to == "HOLD_SAFE").expect("it holds");
        assert_eq!(held.cause, "lost:lease", "nothing arrived, and that was enough");
        assert!((0.0..=run.evidence.bounds.to_hold_safe_ms as f64).contains(&(held.t_ms - hold)), "{held:?}");
        let told = |event: &Event| matches!(event, Event::CommandShown { shown: ShownAs::NotAcknowledged, .. });
        assert!(run.evidence.entries.iter().any(|w| told(&w.entry.event)), "the operator is told");
    }
}

/// What each step of the demo is to bring about, and nothing worse, until the next one begins.
const DEMO: [(&str, Mode); 9] = [
    ("replay", Mode::Ready),
    ("stranger", Mode::Ready),
    ("delay", Mode::HoldSafe),
    ("thermal", Mode::Degraded),
    ("link", Mode::HoldSafe),
    ("commands", Mode::HoldSafe),
    ("relay", Mode::Ready),
    ("jump", Mode::HoldSafe),
    ("drift", Mode::HoldSafe),
];

#[test]
fn each_attack_of_the_demo_brings_about_what_was_stated_for_it_and_the_operator_goes_on_after_it() {
    for run in shipped("demo/demo").expect(1..4) {
        assert!(run.verdict.receipt && run.verdict.findings.is_empty(), "{:?}", run.verdict.findings);
        let begun = |name: &str| {
            let begins = |of: &Event| matches!(of, Event::Step { step, begun: true } if step.as_str() == name);
            let entry = run.evidence.entries.iter().find(|w| begins(&w.entry.event));
            entry.unwrap_or_else(|| panic!("{name} never began")).at as f64 / 1000.0
        };
        let end = run.evidence.duration as f64 / 1000.0;
        for (at, (name, worst)) in DEMO.iter().enumerate() {
            let until = DEMO.get(at + 1).map_or(end, |(next, _)| begun(next));
            let within = begun(name)..until;
            let after = run.verdict.transitions.iter().filter(|row| within.contains(&row.t_ms));
            let reached: Vec<&str> = after.filter(|row| row.cause != "operator").map(|row| row.to.as_str()).collect();
            for mode in [Mode::Degraded, Mode::HoldSafe] {
                // On its way to HOLD_SAFE a unit may be DEGRADED first.
                let may = *worst == Mode::HoldSafe && mode == Mode::Degraded;
                assert!(may || reached.contains(&mode.name()) == (*worst == mode), "{name}: {reached:?}");
            }
            let last = run.verdict.transitions.iter().rev().find(|row| row.t_ms < until).expect("it was enabled");
            assert!(["READY", "PREPARE_TO_ACT"].contains(&last.to.as_str()), "{name} ends in {last:?}");
        }
    }
}
