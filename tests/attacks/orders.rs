//! Attacks by holders of a key or certificate: rights, roles, standing, counters, rates, values.

use evidence::trial::Outcome;
use ground_truth::{Any, Note};
use holdsafe_tests::{shipped, variations, with_policy};
use oracle::Property;
use scenario::Settings;
use twin::trial::Run;
use wire::command::CommandKind;
use wire::event::{Account, Event, Interface};
use wire::id::{CommandId, NodeId};
use wire::refusal::Reason;

use crate::SEEDS;

/// The first operator's requests, by kind.
fn requests(run: &Run, wanted: &str) -> Vec<(u64, CommandId)> {
    let stored = run.evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Service(Event::Intended { command, kind, .. }) if kind.name() == wanted => Some((w.at, command)),
        _ => None,
    });
    stored.collect()
}

/// True if the unit carried it out.
fn executed(run: &Run, wanted: CommandId) -> bool {
    run.evidence.entries.iter().any(|w| match w.entry.event {
        Any::Service(Event::Executed { command, refused: None, .. }) => {
            w.entry.node == NodeId::UNIT_A && command == wanted
        }
        _ => false,
    })
}

/// True if the first operator's request was carried out, by kind.
fn obeyed(run: &Run, kind: &str) -> bool {
    requests(run, kind).iter().any(|(_, id)| executed(run, *id))
}

/// Number of refusals at `at` for this reason that `node` reported.
fn refused(run: &Run, node: NodeId, at: Interface, wanted: Reason) -> usize {
    let one = |w: &&evidence::Witnessed| match w.entry.event {
        Any::Service(Event::Refused { at: interface, reason, .. }) => {
            (w.entry.node, interface, reason) == (node, at, wanted)
        }
        _ => false,
    };
    run.evidence.entries.iter().filter(one).count()
}

/// The rogue's orders that the unit carried out.
fn got_through(run: &Run) -> Vec<CommandKind> {
    let rogue = run.evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Instrument(Note::Rogue { command, kind, .. }) => Some((command, kind)),
        _ => None,
    });
    let is_given = |id: &CommandId| {
        !run.evidence
            .entries
            .iter()
            .any(|w| matches!(w.entry.event, Any::Service(Event::Intended { command, .. }) if command == *id))
    };
    rogue.filter(|(id, _)| is_given(id) && executed(run, *id)).map(|(_, kind)| kind).collect()
}

/// Broker, gateway and unit each refuse the order on their own.
#[test]
fn vehicle_credential_cannot_order() {
    for run in shipped("role_broker").expect(SEEDS) {
        assert_eq!(refused(&run, NodeId::BROKER, Interface::Broker, Reason::Role), 9);
        assert_eq!(refused(&run, NodeId::UNIT_A, Interface::Commands, Reason::Role), 0, "nothing came so far");
    }
    for run in shipped("role_gateway").expect(SEEDS) {
        for reason in [Reason::Role, Reason::Signature] {
            assert!(refused(&run, NodeId::GATEWAY, Interface::Requests, reason) > 0, "{reason:?}");
            assert_eq!(refused(&run, NodeId::UNIT_A, Interface::Commands, reason), 0, "nothing came so far");
        }
    }
    for run in shipped("role_unit").expect(SEEDS) {
        assert_eq!(refused(&run, NodeId::BROKER, Interface::Broker, Reason::Role), 0);
        for reason in [Reason::Role, Reason::Signature] {
            assert!(refused(&run, NodeId::UNIT_A, Interface::Commands, reason) > 0, "{reason:?}");
        }
        assert_eq!(got_through(&run), []);
    }
}

#[test]
fn without_the_role_check_anybodys_good_signature_acts() {
    for name in ["role_broker", "role_gateway"] {
        let run = with_policy(name, "role-waived").run(1);
        assert_eq!(run.verdict.outcome, Outcome::Unsafe, "{name}");
        assert!(got_through(&run).iter().any(|kind| kind.name() == "confirm"), "{name}");
    }
}

/// The rogue runs its counter ahead. The operator is still heard, and has it revoked.
#[test]
fn rogue_station_cannot_silence_the_operator() {
    for run in shipped("rogue_station").expect(SEEDS) {
        assert!(refused(&run, NodeId::UNIT_A, Interface::Commands, Reason::Jump) > 0);
        assert_eq!(got_through(&run), [CommandKind::Disarm], "what it did before it was revoked was to stop something");
        let struck = |node| {
            run.evidence.entries.iter().any(|w| {
                w.entry.node == node
                    && matches!(w.entry.event, Any::Service(Event::Struck { who }) if who == NodeId::OPERATOR_2)
            })
        };
        assert!(struck(NodeId::GATEWAY) && struck(NodeId::UNIT_A), "the unit knows it for itself");
        assert_eq!(refused(&run, NodeId::GATEWAY, Interface::Requests, Reason::Revoked), 3);
        assert!(obeyed(&run, "hold") && obeyed(&run, "resume"), "{:?}", run.verdict.transitions);
    }
    let run = with_policy("rogue_station", "standing-waived").run(1);
    assert_eq!(run.verdict.outcome, Outcome::Unsafe);
}

/// The attempt runs the operator's counter ahead.
#[test]
fn stolen_key_cannot_lock_out_its_operator() {
    for run in shipped("stolen_key").expect(SEEDS) {
        assert!(refused(&run, NodeId::UNIT_A, Interface::Commands, Reason::Jump) > 0);
        for kind in ["disarm", "hold", "resume"] {
            assert!(obeyed(&run, kind), "{kind}: {:?}", run.verdict.transitions);
        }
    }
    let run = with_policy("stolen_key", "jump-waived").run(1);
    assert_eq!(run.verdict.outcome, Outcome::Unsafe, "one id for all that the operator can still give");
    assert!(obeyed(&run, "hold"), "towards safe asks no counter");
    assert!(!run.verdict.transitions.iter().any(|t| t.from == "HOLD_SAFE"), "the thief has locked the operator out");
}

/// Ids from an earlier boot are refused as well.
#[test]
fn stolen_key_cannot_reuse_counted_ids() {
    for ready in variations("stolen_key_reused") {
        for run in ready.expect(SEEDS) {
            let last_hold = requests(&run, "hold").last().expect("the operator held").1;
            let rogue = run.evidence.entries.iter().find_map(|w| match w.entry.event {
                Any::Instrument(Note::Rogue { command, .. }) => Some(command),
                _ => None,
            });
            let rogue = rogue.expect("the rogue ordered");
            match ready.cell.as_deref() {
                Some("last-id") => assert_eq!(rogue, last_hold),
                _ => assert!(
                    rogue.boot < last_hold.boot && rogue.sequence > last_hold.sequence,
                    "{rogue:?} {last_hold:?}"
                ),
            }
            assert_eq!(refused(&run, NodeId::UNIT_A, Interface::Commands, Reason::Duplicate), 1);
            assert!(obeyed(&run, "resume"), "the operator's own resume is heard: {:?}", run.verdict.transitions);
        }
    }
}

#[test]
fn confirmation_for_another_track_is_refused() {
    for run in shipped("confirm_other_track").expect(SEEDS) {
        let other = run.evidence.entries.iter().find_map(|w| match w.entry.event {
            Any::Instrument(Note::Rogue { kind: CommandKind::Confirm(track), .. }) => Some(track),
            _ => None,
        });
        let held = run.evidence.entries.iter().find_map(|w| match w.entry.event {
            Any::Service(Event::Minted { track, .. }) => Some(track),
            _ => None,
        });
        assert!(other.is_some() && held.is_some() && other != held, "{other:?} {held:?}");
        assert_eq!(refused(&run, NodeId::UNIT_A, Interface::Commands, Reason::Interlock), 1);
        assert!(!run.evidence.entries.iter().any(|w| matches!(w.entry.event, Any::Instrument(Note::PlantAct { .. }))));
    }
}

#[test]
fn sound_disarm_burst_is_refused_by_rate_only() {
    for run in shipped("disarm_burst").expect(SEEDS) {
        assert!(refused(&run, NodeId::GATEWAY, Interface::Requests, Reason::Rate) > 0);
        let other_entries = run.evidence.entries.iter().filter(|w| match w.entry.event {
            Any::Service(Event::Refused { at: Interface::Requests | Interface::Commands, reason, .. }) => {
                reason != Reason::Rate
            }
            _ => false,
        });
        assert_eq!(other_entries.count(), 0);
    }
}

#[test]
fn unit_near_its_fence_is_not_enabled() {
    for run in shipped("fence_start").expect(SEEDS) {
        assert!(refused(&run, NodeId::UNIT_A, Interface::Commands, Reason::Interlock) > 0);
        assert!(run.verdict.transitions.iter().all(|t| t.to == "IDLE"), "{:?}", run.verdict.transitions);
    }
}

#[test]
fn expired_operator_is_refused_unless_waived() {
    for run in shipped("expired_operator").expect(SEEDS) {
        assert_eq!(refused(&run, NodeId::GATEWAY, Interface::Requests, Reason::Expired), 4);
        assert_eq!(got_through(&run), []);
    }
    assert_eq!(with_policy("expired_operator", "standing-waived").run(1).verdict.outcome, Outcome::Unsafe);
}

#[test]
fn hold_passes_a_flood_in_time() {
    let at_gateway = (NodeId::GATEWAY, Interface::Requests);
    for (name, (node, at)) in [
        ("order_flood", at_gateway),
        ("order_flood_unit", (NodeId::UNIT_A, Interface::Commands)),
        ("hold_flood", at_gateway),
    ] {
        for run in shipped(name).expect(SEEDS) {
            let (given_us, id) = requests(&run, "hold")[0];
            assert!(executed(&run, id), "{name}");
            let held = run.verdict.transitions.iter().find(|t| t.to == "HOLD_SAFE").expect("held").t_ms;
            assert!(held <= given_us as f64 / 1000.0 + 1000.0, "{name}: {held}");
            let counted = run.evidence.entries.iter().find_map(|w| match w.entry.event {
                Any::Service(Event::Count { account: Account::Refused(interface, Reason::Rate), n })
                    if interface == at =>
                {
                    Some(n)
                }
                _ => None,
            });
            assert!(counted.is_some_and(|n| n > 500), "{name}: {counted:?}");
            assert!(refused(&run, node, at, Reason::Rate) <= 8 + 3 * 4, "{name}: a flood is not one in the log");
        }
    }
}

/// A thief of the operator's own key requests orders that do not stop the unit, as fast as it can.
#[test]
fn own_key_disarm_flood_cannot_block_hold() {
    let mut ready = shipped("order_flood_unit");
    for (path, value) in [("rogue.0.holds", "operator-1"), ("rogue.0.order", "disarm")] {
        ready.scenario = Settings::one(path, value.into()).applied_to(&ready.scenario).expect("it is in the scenario");
    }
    for run in ready.expect(SEEDS) {
        assert!(refused(&run, NodeId::UNIT_A, Interface::Commands, Reason::Rate) > 0, "the flood is one");
        let (given_us, id) = requests(&run, "hold")[0];
        let executed_us = run.evidence.entries.iter().find_map(|w| match w.entry.event {
            Any::Service(Event::Executed { command, refused: None, .. }) if command == id => Some(w.at),
            _ => None,
        });
        assert!(
            executed_us.is_some_and(|time| time <= given_us + 300_000),
            "given at {given_us}, executed at {executed_us:?}"
        );
    }
}

/// Values are sent before the mission; under way all values are refused.
#[test]
fn unsafe_combined_values_are_refused() {
    for run in shipped("unsafe_values").expect(SEEDS) {
        assert_eq!(refused(&run, NodeId::UNIT_A, Interface::Commands, Reason::Joint), 4);
        assert!(refused(&run, NodeId::UNIT_A, Interface::Commands, Reason::Interlock) > 0);
        assert!(obeyed(&run, "configure") && got_through(&run).is_empty());
    }
    let run = with_policy("unsafe_values", "joint-waived").run(1);
    assert!(run.verdict.findings.iter().any(|f| f.property == Property::P4), "{:?}", run.verdict.findings);
}
