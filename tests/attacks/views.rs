//! Attacks by the holder of the gateway's keys on the operator's picture, and on the operator's requests.

use evidence::trial::Outcome;
use ground_truth::{Any, Note};
use holdsafe_tests::{Ready, shipped};
use twin::trial::Run;
use wire::core::Topic;
use wire::event::{Event, Freshness, Interface, ShownAs};
use wire::id::{NodeId, UnitId};
use wire::mode::Mode;
use wire::policy::{DisplayRule, Requirement};
use wire::refusal::Reason;

use crate::SEEDS;

/// The scenario with one rule of the display waived, and no class expected.
fn waive_rule(name: &str, rule: DisplayRule) -> Ready {
    let mut ready = shipped(name);
    ready.setup.policy.display.insert(rule, Requirement::Waived);
    ready
}

/// Reasons for which the console refused the gateway's messages.
fn refused(run: &Run) -> Vec<Reason> {
    let reason = |event: &Any| match *event {
        Any::Service(Event::Refused { at: Interface::Bus(Topic::Feed), reason, .. }) => Some(reason),
        _ => None,
    };
    let console = run.evidence.entries.iter().filter(|w| w.entry.node == NodeId::CONSOLE);
    console.filter_map(|w| reason(&w.entry.event)).collect()
}

/// Displays of the unit: time, mode, freshness.
fn displayed(run: &Run) -> Vec<(u64, Mode, Freshness)> {
    let shown = run.evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Service(Event::Displayed { unit: UnitId::A, mode, freshness, .. }) => Some((w.at, mode, freshness)),
        _ => None,
    });
    shown.collect()
}

#[test]
fn hold_under_a_stale_display_stops_the_unit() {
    for run in shipped("hold_stale_view").expect(SEEDS) {
        let held = run.verdict.transitions.iter().find(|t| t.to == "HOLD_SAFE").expect("it holds");
        assert_eq!(held.cause, "operator");
        let time = (held.t_ms * 1000.0) as u64;
        let before = displayed(&run).into_iter().rfind(|(shown, ..)| *shown < time);
        assert!(before.is_some_and(|(_, _, fresh)| fresh != Freshness::Fresh), "{before:?}");
    }
}

/// The gateway changes, signs or relabels the reports.
#[test]
fn altered_reports_are_not_displayed() {
    for run in shipped("view_forged").expect(SEEDS) {
        let refused = refused(&run);
        assert!(refused.contains(&Reason::Signature) && refused.contains(&Reason::Unit), "{refused:?}");
        assert!(displayed(&run).iter().all(|(_, mode, _)| *mode != Mode::HoldSafe), "the forged state");
    }
}

#[test]
fn unit_signature_waiver_lets_gateway_forge_display() {
    let run = waive_rule("view_forged", DisplayRule::Signature).run(1);
    assert_eq!(run.verdict.outcome, Outcome::Unsafe, "{:?}", run.verdict.findings);
    assert!(
        displayed(&run).iter().any(|(_, mode, freshness)| *mode == Mode::HoldSafe && *freshness == Freshness::Fresh)
    );
}

/// The operator acts on none of them.
#[test]
fn withheld_reports_age_out_unused() {
    for run in shipped("view_withheld").expect(SEEDS) {
        let zero = run.verdict.zero.expect("a receipt");
        // Fresh for Tf, late for two periods more; the last report was younger than a period when the withholding began.
        let limit = (run.evidence.bounds.freshness_ms + 2 * run.evidence.bounds.telemetry_period_ms) * 1000;
        let stale = displayed(&run).into_iter().find(|(time, _, f)| *time >= zero && *f == Freshness::Stale);
        let stale = stale.expect("it ages out").0;
        assert!(stale - zero <= limit, "{} ms", (stale - zero) / 1000);
        assert!(!run.evidence.entries.iter().any(|w| matches!(w.entry.event, Any::Instrument(Note::PlantAct { .. }))));
    }
}

/// Old modes are shown no longer than their reports are fresh.
#[test]
fn chosen_reports_show_old_modes_briefly() {
    for run in shipped("view_selected").expect(SEEDS) {
        let after =
            run.verdict.transitions.iter().find(|t| t.from == "PREPARE_TO_ACT").expect("disarmed").t_ms * 1000.0;
        let limit = (run.evidence.bounds.freshness_ms + run.evidence.bounds.telemetry_period_ms) as f64 * 1000.0;
        let shown = displayed(&run);
        let fresh = |(time, mode, f): &&(u64, Mode, Freshness)| {
            *time as f64 > after + limit && *mode == Mode::PrepareToAct && *f == Freshness::Fresh
        };
        assert_eq!(shown.iter().find(fresh), None);
    }
}

/// The shown age does not depend on the gateway's claim.
#[test]
fn kept_report_is_shown_at_its_age() {
    for name in ["view_late", "view_young"] {
        for run in shipped(name).expect(SEEDS) {
            let zero = run.verdict.zero.expect("a receipt");
            let in_window = |time: u64| time > zero + 500_000 && time < zero + 3_000_000;
            let shown = displayed(&run);
            let mut window = shown.iter().filter(|(time, ..)| in_window(*time)).peekable();
            assert!(window.peek().is_some(), "{name}");
            assert!(window.all(|(_, _, f)| *f == Freshness::Stale), "{name}: 800 ms is stale");
        }
    }
}

#[test]
fn challenge_waiver_lets_gateway_rejuvenate_reports() {
    let run = waive_rule("view_young", DisplayRule::Watch).run(1);
    assert_eq!(run.verdict.outcome, Outcome::Unsafe, "{:?}", run.verdict.findings);
    let honest = waive_rule("view_late", DisplayRule::Watch).run(1);
    assert_eq!(honest.verdict.outcome, Outcome::Rejected, "an honest gateway's word was enough");
}

#[test]
fn old_report_claimed_new_is_refused() {
    for run in shipped("view_replayed").expect(SEEDS) {
        assert!(refused(&run).contains(&Reason::Stale), "{:?}", refused(&run));
        assert!(displayed(&run).iter().filter(|(time, ..)| *time > 2_000_000).all(|(_, mode, _)| *mode != Mode::Idle));
    }
}

/// The effect of a gateway that keeps on granting on a HOLD is listed, not closed: the operator is informed, the unit is
/// not.
#[test]
fn swallowed_hold_is_shown_as_unacknowledged() {
    for run in shipped("gateway_hold").expect(SEEDS) {
        let entry = run
            .evidence
            .entries
            .iter()
            .find(|w| matches!(w.entry.event, Any::Service(Event::Intended { kind, .. }) if kind.name() == "hold"));
        let given_us = entry.expect("the operator held").at;
        let alarm = run.evidence.entries.iter().find(|w| {
            w.at > given_us
                && matches!(w.entry.event, Any::Service(Event::CommandShown { shown: ShownAs::NotAcknowledged, .. }))
        });
        let alarm = alarm.expect("an alarm").at;
        assert!(alarm - given_us <= 1_050_000, "{} ms", (alarm - given_us) / 1000);
        assert!(run.verdict.transitions.iter().all(|t| t.to != "HOLD_SAFE"), "{:?}", run.verdict.transitions);
    }
}
