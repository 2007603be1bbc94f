//! Attacks on the telemetry link by one who holds no key.

use evidence::Witnessed;
use evidence::trial::Outcome;
use ground_truth::{Any, GuardVerdict, Note};
use holdsafe_tests::{shipped, variations, with_policy};
use wire::event::{Account, Event, Interface};
use wire::id::NodeId;

use crate::SEEDS;

#[test]
fn replayed_session_records_are_never_delivered() {
    for run in shipped("replay").expect(SEEDS) {
        let gateway = NodeId::GATEWAY.guard().expect("a guard");
        let count = |node: NodeId, wanted: Account| {
            run.evidence.entries.iter().find_map(|w| match w.entry.event {
                Any::Service(Event::Count { account, n }) if account == wanted && w.entry.node == node => Some(n),
                _ => None,
            })
        };
        let added = count(NodeId::RELAY_TELEMETRY, Account::RelayAdded(wire::core::Side::Server)).unwrap_or(0);
        assert!(added > 0, "something was replayed");
        assert_eq!(count(gateway, Account::Discarded), Some(added));
        assert_eq!(count(NodeId::GATEWAY, Account::Received(Interface::Uplink)), count(gateway, Account::Delivered));
    }
}

#[test]
fn delay_beyond_the_freshness_window_holds() {
    shipped("delay").expect(SEEDS);
}

#[test]
fn duplicates_are_accepted_once() {
    shipped("duplicate").expect(SEEDS);
}

#[test]
fn damaged_ciphertext_is_discarded_and_the_association_stands() {
    shipped("corrupt").expect(SEEDS);
}

#[test]
fn loss() {
    shipped("loss").expect(SEEDS);
}

/// The unit holds although it hears everything.
#[test]
fn unheard_unit_gets_no_grants_and_holds() {
    for run in shipped("uplink_loss").expect(SEEDS) {
        let lapsed = run.verdict.transitions.iter().any(|t| t.to == "HOLD_SAFE" && t.cause == "lost:lease");
        assert!(lapsed, "{:?}", run.verdict.transitions);
        let heard = run.evidence.entries.iter().filter(|w| match w.entry.event {
            Any::Service(Event::Accepted { at: Interface::Downlink, .. }) => {
                Some(w.at) > run.verdict.zero.map(|zero| zero + 1_000_000)
            }
            _ => false,
        });
        assert!(heard.count() > 0, "the downlink stands");
    }
}

/// Without the lease the reaction is late.
#[test]
fn silence_beyond_the_bound_holds() {
    for ready in variations("brief_silence") {
        ready.expect(SEEDS);
    }
}

#[test]
fn a_naive_relay_gets_no_record_in() {
    for run in shipped("naive_relay").expect(SEEDS) {
        let refused = run.evidence.entries.iter().any(|w| {
            matches!(
                w.entry.event,
                Any::Instrument(Note::GuardSaw { association, .. }) if association == twin::UNKNOWN_PEER
            )
        });
        assert!(refused, "the guard saw the unknown peer");
    }
}

#[test]
fn age_bound_waiver_still_blocks_session_replay() {
    let ready = with_policy("replay", "session-only");
    for seed in SEEDS {
        let outcome = ready.run(seed).verdict.outcome;
        assert!(!matches!(outcome, Outcome::Unsafe | Outcome::Invalid), "{outcome:?}");
    }
}

/// Without the guard a series of alerts leads to HOLD_SAFE.
#[test]
fn keyless_alerts_are_harmless_with_guard() {
    for run in shipped("alert").expect(SEEDS) {
        assert!(
            run.evidence
                .entries
                .iter()
                .all(|w| !matches!(w.entry.event, Any::Service(Event::Session { open: false, .. })))
        );
    }
    for seed in SEEDS {
        let run = with_policy("alert", "guard-off").run(seed);
        assert_eq!(run.verdict.outcome, Outcome::HoldSafe, "{:?}", run.verdict.transitions);
    }
}

/// This holds even when the association must be opened again.
#[test]
fn silent_hello_blocks_no_peer() {
    shipped("silent_hello").expect(SEEDS);
    for seed in SEEDS {
        let run = with_policy("silent_hello", "guard-off").run(seed);
        assert_eq!(run.verdict.outcome, Outcome::Rejected, "{:?}", run.verdict.transitions);
        let unit = |w: &&Witnessed| w.entry.node == NodeId::UNIT_A;
        let sessions = run.evidence.entries.iter().filter(unit).filter_map(|w| match w.entry.event {
            Any::Service(Event::Session { open, .. }) => Some(open),
            _ => None,
        });
        assert_eq!(sessions.collect::<Vec<_>>(), [true, false, true], "ended once and came back");
    }
}

#[test]
fn hellos_whose_lengths_lie_are_refused_by_name() {
    for run in shipped("malformed_hello").expect(SEEDS) {
        let refused = |w: &&Witnessed| {
            matches!(w.entry.event, Any::Instrument(Note::GuardSaw { verdict: GuardVerdict::Malformed, .. }))
        };
        assert_eq!(run.evidence.entries.iter().filter(refused).count(), 120);
    }
}
