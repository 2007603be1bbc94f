//! Obligations after the kill of a process, and requirements on a restarted one.

use evidence::trial::Outcome;
use ground_truth::{Any, Note, Suspension};
use oracle::Property;
use wire::command::CommandKind;
use wire::event::Event;
use wire::id::{Boot, NodeId};
use wire::mode::{Cause, Mode};

use super::log::{Log, command};

#[test]
fn p3_plant_continues_after_unit_death() {
    let mut log = Log::whole();
    log.killed(5000, NodeId::UNIT_A).cut_display(5000);
    assert!(log.breaks_with_dead(NodeId::UNIT_A).contains(&Property::P3), "it never stops");
    let mut late = log.clone();
    late.plant_stops(6200);
    assert_eq!(late.breaks_with_dead(NodeId::UNIT_A), [Property::P3], "its lease ends after Th");
    let after = |log: &Log, node| log.judge_with(vec![node]).responses[0].after;
    assert_eq!(after(&log, NodeId::UNIT_A), Mode::PrepareToAct, "its last word, for its plant goes on");
    log.plant_stops(5300);
    assert_eq!(after(&log, NodeId::UNIT_A), Mode::HoldSafe);
    let mut other = Log::whole();
    other.killed(5000, NodeId::CONSOLE).plant_stops(5300);
    assert_eq!(after(&other, NodeId::CONSOLE), Mode::PrepareToAct, "the unit lives and says what it is in");
    let verdict = log.judge_with(vec![NodeId::UNIT_A]);
    assert_eq!((verdict.findings.as_slice(), verdict.outcome), (&[][..], Outcome::HoldSafe));
    let plant = verdict.responses[0].plant.unwrap();
    assert_eq!((plant.lease_ended_ms, plant.standing_ms), (Some(300.0), Some(1300.0)));
}

/// No plant brakes and no lease ends while the world of the plant stands still.
#[test]
fn p3_counts_no_time_of_a_hung_world() {
    for hangs in [4900, 5000] {
        let mut log = Log::whole();
        log.killed(5000, NodeId::UNIT_A).cut_display(5000);
        for (at, on) in [(hangs, true), (6300, false)] {
            log.add(at, NodeId::CAMPAIGN, Note::Suspended { node: NodeId::SIM, how: Suspension::Hang, on });
        }
        log.remove_between(hangs, 6300, |w| matches!(w.entry.event, Any::Instrument(Note::Truth { .. })));
        let mut late = log.clone();
        late.plant_stops(7400);
        assert!(
            late.breaks_with_dead(NodeId::UNIT_A).contains(&Property::P3),
            "its lease goes on in a world that runs"
        );
        log.plant_stops(6400);
        assert_eq!(log.breaks_with_dead(NodeId::UNIT_A), []);
    }
}

#[test]
fn p3_stop_of_a_dead_unit_owes_nothing() {
    let mut log = Log::whole();
    log.killed(5000, NodeId::UNIT_A).cut_display(5000).plant_stops(5300);
    for (at, on) in [(6000, true), (8000, false)] {
        log.add(at, NodeId::CAMPAIGN, Note::Suspended { node: NodeId::UNIT_A, how: Suspension::Hang, on });
    }
    assert_eq!(log.breaks_with_dead(NodeId::UNIT_A), []);
    assert_eq!(log.judge_with(vec![NodeId::UNIT_A]).responses.len(), 1);
}

#[test]
fn p3_plant_lease_twice_the_limit() {
    for (ends, broken) in [(5300, vec![]), (5350, vec![]), (5600, vec![Property::P3])] {
        let mut log = Log::whole();
        log.killed(5000, NodeId::UNIT_A).cut_display(5000).plant_stops(ends);
        assert_eq!(log.breaks_with_dead(NodeId::UNIT_A), broken, "{ends}");
    }
}

#[test]
fn p2_p3_unit_ready_without_needed_process() {
    for (node, broken) in [
        (NodeId::PERCEPTION, vec![Property::P2, Property::P3]),
        (NodeId::GATEWAY, vec![Property::P2, Property::P3]),
        (NodeId::RECORDER, vec![Property::P2]),
        (NodeId::CONSOLE, vec![]),
    ] {
        let mut log = Log::whole();
        log.killed(5000, node);
        let mut found = log.breaks_with_dead(node);
        found.retain(|p| matches!(p, Property::P2 | Property::P3));
        found.dedup();
        assert_eq!(found, broken, "{node}");
    }
}

#[test]
fn p3_unit_ignores_hold_after_broker_death() {
    let mut log = Log::whole();
    log.killed(5000, NodeId::BROKER);
    assert_eq!(log.breaks_with_dead(NodeId::BROKER), [Property::P10], "nobody tried");
    log.add(7000, NodeId::CONSOLE, Event::Intended { command: command(9), kind: CommandKind::Hold, tag: None });
    // Once for the responses to the broker's death, once for the operator's HOLD itself.
    assert_eq!(log.breaks_with_dead(NodeId::BROKER), [Property::P2, Property::P3, Property::P3, Property::P3]);
}

#[test]
fn early_end_before_an_obligation_is_inconclusive() {
    for node in [NodeId::PERCEPTION, NodeId::GATEWAY, NodeId::RECORDER] {
        let mut log = Log::whole();
        log.killed(9800, node);
        let verdict = log.judge_with(vec![node]);
        assert_eq!((verdict.outcome, verdict.responses[0].in_time), (Outcome::Invalid, false), "{node}");
    }
}

/// A unit that ends at 3 s, is started again at 4 s and enabled at 5 s; judged by the findings with `word` in them.
fn started_again(change: impl Fn(&mut Log), word: &str) -> Vec<String> {
    let mut log = Log::whole();
    log.killed(3000, NodeId::UNIT_A).cut_display(3000);
    log.add(4000, NodeId::CAMPAIGN, Note::Restarted { node: NodeId::UNIT_A, boot: Boot(2) });
    log.command(5000, 5, CommandKind::Enable).transition(5000, Mode::Idle, Mode::Ready, Cause::Operator);
    change(&mut log);
    let findings = log.judge_with(vec![NodeId::UNIT_A]).findings;
    findings.into_iter().map(|f| f.message).filter(|name| name.contains(word)).collect()
}

#[test]
fn p3_applies_again_after_a_restart() {
    let silent = |from: u64, to: u64| {
        move |log: &mut Log| {
            let guard = NodeId::UNIT_A.guard();
            log.entries.retain(|w| !(w.at > from * 1000 && w.at < to * 1000 && Some(w.entry.node) == guard));
        }
    };
    assert_eq!(started_again(silent(3000, 4000), "nothing timely"), [""; 0], "dead");
    assert_eq!(started_again(silent(6000, 8000), "nothing timely").len(), 1, "alive again");
    let hold = |ms: u64| {
        let event = Event::Intended { command: command(9), kind: CommandKind::Hold, tag: None };
        move |log: &mut Log| {
            log.add(ms, NodeId::CONSOLE, event);
        }
    };
    assert_eq!(started_again(hold(2500), "had not held"), [""; 0], "it died under the order");
    assert_eq!(started_again(hold(6000), "had not held").len(), 1, "alive again");
}
