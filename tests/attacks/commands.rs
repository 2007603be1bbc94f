//! Attacks on the command plane.

use evidence::Witnessed;
use ground_truth::{Any, Note, Sight, StreamEffect};
use holdsafe_tests::{shipped, variations};
use wire::command::CommandKind;
use wire::event::Event;
use wire::id::PeerId;
use wire::refusal::Reason;

use crate::SEEDS;

#[test]
fn stalled_hold_is_late_and_unneeded() {
    for run in shipped("command_stall").expect(SEEDS) {
        let order = run.evidence.entries.iter().find_map(|w| match w.entry.event {
            Any::Service(Event::Intended { kind: CommandKind::Hold, .. }) => Some(w.at as f64 / 1000.0),
            _ => None,
        });
        let order_time = order.expect("the operator held");
        let held = run.verdict.transitions.iter().find(|t| t.to == "HOLD_SAFE").expect("the lease lapsed").t_ms;
        assert!(
            held >= order_time && held - order_time <= 560.0,
            "lease, one control period and a hop: {order_time} to {held} ms"
        );
        // The operator asks again when nothing is acknowledged; of what waited in the stall only the young is executed.
        let first = run.evidence.entries.iter().find_map(|w| match w.entry.event {
            Any::Service(Event::Executed { kind: CommandKind::Hold, refused, .. }) => Some(refused),
            _ => None,
        });
        assert_eq!(first, Some(Some(Reason::Late)), "the order came out of the stall and was refused");
    }
}

#[test]
fn cut_command_connection_loses_hold_and_recovers() {
    for run in shipped("command_cut").expect(SEEDS) {
        let done = |wanted: CommandKind| {
            let one = |w: &&Witnessed| match w.entry.event {
                Any::Service(Event::Executed { kind, refused: None, .. }) => kind == wanted,
                _ => false,
            };
            run.evidence.entries.iter().filter(one).count()
        };
        assert!(done(CommandKind::Hold) > 0 && done(CommandKind::Resume) == 1, "{:?}", run.verdict.transitions);
    }
}

/// The secure layer refuses it.
#[test]
fn damaged_confirmation_is_refused_without_act() {
    for run in shipped("command_corrupt").expect(SEEDS) {
        let times = |test: &dyn Fn(&Any) -> bool| {
            let found = run.evidence.entries.iter().filter(|w| test(&w.entry.event)).map(|w| w.at);
            found.collect::<Vec<_>>()
        };
        assert!(!times(&|e| matches!(e, Any::Instrument(Note::StreamSaw { sight: Sight::Refused, .. }))).is_empty());
        // The operator asks again when nothing is acknowledged, and may act once the path is whole.
        let damaged = times(&|e| matches!(e, Any::Instrument(Note::Tampered { deed: StreamEffect::Damaged, .. })));
        let acted = times(&|e| matches!(e, Any::Instrument(Note::PlantAct { .. })));
        assert!(acted.first().is_none_or(|time| Some(time) > damaged.last()), "{acted:?} {damaged:?}");
    }
}

#[test]
fn stolen_session_is_alarmed_voided_and_recovered() {
    for ready in variations("session_takeover") {
        let whose = if ready.cell.as_deref() == Some("gateway") { PeerId::GATEWAY } else { PeerId::UNIT_A };
        for run in ready.expect(SEEDS) {
            let entries = &run.evidence.entries;
            let times_of = |event: Event| {
                entries.iter().filter(|w| w.entry.event == Any::Service(event)).map(|w| w.at).collect::<Vec<_>>()
            };
            let by_broker = times_of(Event::TakenOver { peer: whose });
            let by_owner = times_of(Event::SessionLost { peer: whose });
            assert!(by_owner.len() > 1, "they take turns: {by_owner:?}");
            assert!(by_broker.len() >= 2 * by_owner.len() - 1, "the thief is displaced as well: {by_broker:?}");
            assert!(by_owner.len() < 12, "and not as fast as they can: {by_owner:?}");
            let shown = entries.iter().filter_map(|w| match w.entry.event {
                Any::Service(Event::LossesShown { peer, times }) if peer == whose => Some(times as usize),
                _ => None,
            });
            assert_eq!(shown.max(), Some(by_owner.len()));
            let done = |wanted: CommandKind| {
                entries.iter().any(|w| match w.entry.event {
                    Any::Service(Event::Executed { kind, refused: None, .. }) => {
                        kind == wanted && w.at > by_owner[by_owner.len() - 1]
                    }
                    _ => false,
                })
            };
            assert!(done(CommandKind::Hold) && done(CommandKind::Resume), "the operator has the last word");
        }
    }
}
