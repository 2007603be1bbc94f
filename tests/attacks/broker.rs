//! Attacks by the holder of the command broker's credentials, in the broker's place.

use evidence::Witnessed;
use evidence::trial::Outcome;
use ground_truth::{Any, Note};
use holdsafe_tests::{Ready, shipped, variations};
use twin::trial::Run;
use wire::command::CommandKind;
use wire::event::{Account, Event, Interface, ShownAs};
use wire::id::NodeId;
use wire::policy::{Check, Requirement};
use wire::refusal::Reason;

use crate::SEEDS;

/// The scenario with one check of the boundary waived, and no class expected.
fn waive_check(name: &str, check: Check) -> Ready {
    let mut ready = shipped(name);
    ready.setup.policy.boundary.insert(check, Requirement::Waived);
    ready
}

/// The unit's answers to orders of this kind, in order: carried out, or the reason.
fn answers(run: &Run, wanted: &str) -> Vec<Option<Reason>> {
    let answer = |w: &Witnessed| match w.entry.event {
        Any::Service(Event::Executed { kind, refused, .. })
            if w.entry.node == NodeId::UNIT_A && kind.name() == wanted =>
        {
            Some(refused)
        }
        _ => None,
    };
    run.evidence.entries.iter().filter_map(answer).collect()
}

fn acts(run: &Run) -> usize {
    run.evidence.entries.iter().filter(|w| matches!(w.entry.event, Any::Instrument(Note::PlantAct { .. }))).count()
}

/// Displays of commands of this kind, in order.
fn shown(run: &Run, wanted: CommandKind) -> Vec<(u64, ShownAs)> {
    let commands = run.evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Service(Event::Intended { command, kind, .. }) if kind.name() == wanted.name() => Some(command),
        _ => None,
    });
    let orders: Vec<_> = commands.collect();
    let statement = |w: &Witnessed| match w.entry.event {
        Any::Service(Event::CommandShown { command, shown }) if orders.contains(&command) => Some((w.at, shown)),
        _ => None,
    };
    run.evidence.entries.iter().filter_map(statement).collect()
}

/// Orders that the unit refused for this reason, by its closing account.
fn counted(run: &Run, wanted: Reason) -> u64 {
    let times = run.evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Service(Event::Count { account: Account::Refused(Interface::Commands, reason), n })
            if reason == wanted =>
        {
            Some(n)
        }
        _ => None,
    });
    times.sum()
}

/// A hostile broker captures the orders and delivers them again; the act happens once.
#[test]
fn redelivered_orders_are_refused() {
    for run in shipped("command_replay").expect(SEEDS) {
        let confirmed = answers(&run, "confirm");
        assert_eq!(confirmed.iter().filter(|a| a.is_none()).count(), 1, "{confirmed:?}");
        assert!(confirmed.contains(&Some(Reason::Duplicate)), "{confirmed:?}");
        assert_eq!(acts(&run), 1);
    }
}

/// The mode still stops a repeated confirmation.
#[test]
fn idempotency_waiver_lets_repeated_arming_through() {
    let run = waive_check("command_replay", Check::Duplicate).run(1);
    assert_eq!(acts(&run), 1);
    assert!(answers(&run, "confirm").contains(&Some(Reason::Interlock)), "{:?}", answers(&run, "confirm"));
    let run = waive_check("command_rearm", Check::Duplicate).run(1);
    assert!(answers(&run, "arm").iter().filter(|a| a.is_none()).count() > 1, "{:?}", answers(&run, "arm"));
    assert_eq!(run.verdict.outcome, Outcome::Unsafe, "carried out again: {:?}", run.verdict.findings);
}

#[test]
fn withdrawn_arming_is_not_repeated() {
    for run in shipped("command_rearm").expect(SEEDS) {
        let armed = answers(&run, "arm");
        assert!(armed[1..].iter().all(|a| *a == Some(Reason::Duplicate)) && armed.len() > 2, "{armed:?}");
    }
}

#[test]
fn orders_kept_three_seconds_are_refused_late() {
    for run in shipped("command_late").expect(SEEDS) {
        let confirmed = answers(&run, "confirm");
        assert!(!confirmed.is_empty() && confirmed.iter().all(|a| *a == Some(Reason::Late)), "{confirmed:?}");
        assert_eq!(acts(&run), 0);
    }
}

#[test]
fn nonce_age_waiver_executes_a_kept_order() {
    let run = waive_check("command_late", Check::Late).run(1);
    assert!(!answers(&run, "confirm").contains(&Some(Reason::Late)));
}

#[test]
fn a_doubled_order_is_carried_out_once() {
    for run in shipped("command_duplicate").expect(SEEDS) {
        assert_eq!(answers(&run, "confirm"), [None, Some(Reason::Duplicate), Some(Reason::Duplicate)]);
        assert_eq!(acts(&run), 1);
    }
}

#[test]
fn confirmation_overtaken_by_a_hold_is_refused() {
    for run in shipped("command_reorder").expect(SEEDS) {
        assert_eq!((answers(&run, "hold"), answers(&run, "confirm")), (vec![None], vec![Some(Reason::Duplicate)]));
        assert_eq!(acts(&run), 0);
    }
}

#[test]
fn retained_order_is_refused_after_return() {
    for run in shipped("command_retain").expect(SEEDS) {
        let armed = answers(&run, "arm");
        assert!(matches!(armed[..], [None, Some(Reason::Duplicate | Reason::Late)]), "{armed:?}");
    }
}

/// The order is repeated after the session was lost.
#[test]
fn repeated_safe_order_is_refused_as_seen() {
    for ready in variations("command_again") {
        let kind = ready.cell.clone().expect("cells are named after orders");
        for run in ready.expect(SEEDS) {
            let lost =
                run.evidence.entries.iter().find(|w| matches!(w.entry.event, Any::Service(Event::SessionLost { .. })));
            let lost = lost.expect("the unit lost its session").at;
            let repeated = run.evidence.entries.iter().filter(|w| w.at > lost && w.entry.node == NodeId::UNIT_A);
            let repeated = repeated.filter_map(|w| match w.entry.event {
                Any::Service(Event::Executed { kind: given, refused, .. }) if given.name() == kind => Some(refused),
                _ => None,
            });
            let repeated: Vec<_> = repeated.collect();
            assert!(
                !repeated.is_empty() && repeated.iter().all(|a| *a == Some(Reason::Duplicate)),
                "{kind}: {repeated:?}"
            );
            assert_eq!(answers(&run, &kind).iter().filter(|a| a.is_none()).count(), 1, "{kind}");
        }
    }
}

/// The same order is obeyed when it is given anew.
#[test]
fn arming_kept_past_a_session_is_void() {
    for run in shipped("command_void").expect(SEEDS) {
        assert_eq!(answers(&run, "arm"), [Some(Reason::Late), None]);
    }
}

#[test]
fn spliced_arming_fails_at_its_confirmation() {
    for run in shipped("command_splice_once").expect(SEEDS) {
        assert_eq!(answers(&run, "arm"), [Some(Reason::Confirmation)]);
    }
}

#[test]
fn delayed_hold_is_not_hidden_by_other_orders() {
    for run in shipped("hold_block_disarm").expect(SEEDS) {
        assert_eq!((answers(&run, "hold"), answers(&run, "disarm")), (vec![], vec![None]));
    }
}

#[test]
fn forged_operator_messages_are_refused_by_name() {
    for run in shipped("command_invent").expect(SEEDS) {
        let invented = answers(&run, "confirm");
        assert!(!invented.is_empty() && invented.iter().all(|a| *a == Some(Reason::Signature)), "{invented:?}");
        // The unit has heard the spliced arming already, which costs it less to see than whose the other half is.
        let spliced = answers(&run, "arm");
        assert!(spliced.len() > 1 && spliced[1..].iter().all(|a| *a == Some(Reason::Duplicate)), "{spliced:?}");
        // Not every one is answered; each is counted.
        assert_eq!((counted(&run, Reason::Signature), counted(&run, Reason::Duplicate)), (10, 5));
        assert_eq!(acts(&run), 0);
    }
}

#[test]
fn unheard_intent_cannot_use_anothers_confirmation() {
    for run in shipped("command_splice").expect(SEEDS) {
        let spliced = answers(&run, "arm");
        assert!(spliced.len() >= 3 && spliced.iter().all(|a| *a == Some(Reason::Confirmation)), "{spliced:?}");
        assert_eq!(acts(&run), 0);
    }
}

#[test]
fn signature_waiver_admits_an_invented_confirmation() {
    let run = waive_check("command_invent", Check::Signature).run(1);
    assert_eq!(run.verdict.outcome, Outcome::Unsafe);
    assert_eq!(acts(&run), 1, "{:?}", run.verdict.findings);
}

#[test]
fn forged_acknowledgement_is_refused_and_lease_holds() {
    for run in shipped("ack_forge").expect(SEEDS) {
        let refused = run.evidence.entries.iter().filter(|w| {
            let signature = matches!(
                w.entry.event,
                Any::Service(Event::Refused { at: Interface::Acks, reason: Reason::Signature, .. })
            );
            w.entry.node == NodeId::GATEWAY && signature
        });
        assert!(refused.count() >= 2);
        let shown = shown(&run, CommandKind::Hold);
        assert!(shown.iter().all(|(_, s)| *s != ShownAs::Executed), "{shown:?}");
        assert!(shown.iter().any(|(_, s)| *s == ShownAs::NotAcknowledged), "{shown:?}");
    }
}

#[test]
fn signature_waiver_shows_a_forged_acknowledgement() {
    let run = waive_check("ack_forge", Check::Signature).run(1);
    assert_eq!(run.verdict.outcome, Outcome::Unsafe, "{:?}", run.verdict.findings);
    assert!(shown(&run, CommandKind::Hold).iter().any(|(_, s)| *s == ShownAs::Executed));
}

/// Meanwhile no command is shown as done.
#[test]
fn missing_acknowledgement_shows_within_a_second() {
    for name in ["ack_suppress", "hold_block"] {
        let kind = if name == "hold_block" { "hold" } else { "confirm" };
        for run in shipped(name).expect(SEEDS) {
            let order = run.evidence.entries.iter().find_map(|w| match w.entry.event {
                Any::Service(Event::Intended { kind: k, .. }) if k.name() == kind => Some((w.at, k)),
                _ => None,
            });
            let (order_time, kind) = order.expect("the operator asked");
            let shown = shown(&run, kind);
            let alarm = shown.iter().find(|(_, s)| *s == ShownAs::NotAcknowledged).expect("an alarm").0;
            // A confirmation is asked twice: the second is away once the gateway has staged the first.
            assert!(alarm - order_time <= 1_050_000, "{name}: {} ms", (alarm - order_time) / 1000);
            assert!(shown.iter().all(|(_, s)| *s != ShownAs::Executed), "{name}: {shown:?}");
        }
    }
}
