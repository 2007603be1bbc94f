//! Attacks on orders that wait for their time.

use evidence::Witnessed;
use ground_truth::Any;
use holdsafe_tests::shipped;
use twin::trial::Run;
use wire::event::{Event, ShownAs};
use wire::id::NodeId;
use wire::refusal::Reason;

use crate::SEEDS;

/// Entries of unit A, in order: an order of this kind stored (`None`), or answered.
fn stored_entries(run: &Run, wanted: &str) -> Vec<(u64, Option<Option<Reason>>)> {
    let is_own = |w: &&Witnessed| w.entry.node == NodeId::UNIT_A;
    let order_event = |w: &Witnessed| match w.entry.event {
        Any::Service(Event::Stored { kind, .. }) if kind.name() == wanted => Some((w.at, None)),
        Any::Service(Event::Executed { kind, refused, .. }) if kind.name() == wanted => Some((w.at, Some(refused))),
        _ => None,
    };
    run.evidence.entries.iter().filter(is_own).filter_map(order_event).collect()
}

fn answers(run: &Run, wanted: &str) -> Vec<Option<Option<Reason>>> {
    stored_entries(run, wanted).into_iter().map(|(_, answer)| answer).collect()
}

#[test]
fn hold_is_carried_out_in_the_gap() {
    for run in shipped("hold_stored").expect(SEEDS) {
        let holds = stored_entries(&run, "hold");
        let [(stored, None), (held, Some(None))] = holds[..] else { panic!("{holds:?}") };
        // The contact ends 28 s after the start, the next one begins at 58 s.
        assert!(stored < 21_000_000 && (38_500_000..40_200_000).contains(&held), "{holds:?}");
        let shown = run.evidence.entries.iter().filter_map(|w| match w.entry.event {
            Any::Service(Event::CommandShown { shown, .. }) => Some((w.at, shown)),
            _ => None,
        });
        let shown: Vec<_> = shown.filter(|(time, _)| *time > 19_000_000).collect();
        let place = |wanted| shown.iter().position(|(_, as_shown)| *as_shown == wanted);
        assert!(place(ShownAs::Stored) < place(ShownAs::Executed) && place(ShownAs::Stored).is_some(), "{shown:?}");
        assert!(shown.last().is_some_and(|(time, _)| *time > 58_000_000), "its answer comes with the next contact");
    }
}

#[test]
fn hold_kept_past_its_window_is_refused_and_unneeded() {
    for run in shipped("hold_stored_late").expect(SEEDS) {
        let reasons = answers(&run, "hold");
        assert!(!reasons.is_empty() && reasons.iter().all(|answer| *answer == Some(Some(Reason::Late))), "{reasons:?}");
    }
}

#[test]
fn stored_resumption_does_not_outlive_a_hold() {
    for run in shipped("resume_stored_withdrawn").expect(SEEDS) {
        assert_eq!(answers(&run, "resume"), [None, Some(Some(Reason::Interlock))]);
        assert_eq!(run.verdict.transitions.last().map(|t| t.to.as_str()), Some("HOLD_SAFE"));
    }
}

#[test]
fn stored_resumption_needs_supervision_at_its_time() {
    for run in shipped("resume_stored_hold_dropped").expect(SEEDS) {
        let resumes = stored_entries(&run, "resume");
        let [(stored, None), (due, Some(Some(Reason::Interlock)))] = resumes[..] else { panic!("{resumes:?}") };
        assert!(due - stored > 3_000_000, "refused at its time, and not before: {resumes:?}");
        assert_eq!(answers(&run, "hold"), [Some(None)], "the first, and not the one that was dropped");
    }
}
