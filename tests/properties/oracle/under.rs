//! The unit under test is a role: the judge's answer does not depend on the unit that has it.

#![expect(clippy::wildcard_enum_match_arm, reason = "a reader of the log asks about a few events and skips the rest")]

use evidence::{Evidence, Under};
use ground_truth::{Any, Note};
use oracle::{Finding, Verdict, judge};
use wire::event::Event;
use wire::id::{NodeId, UnitId};
use wire::mode::{Cause, Guard, Mode};

use super::log::Log;

/// Unit 9 with the parts that the rule gives it.
fn unit_9() -> Under {
    let node = |name: &str| NodeId::from_name(name).expect("a name of the table");
    let unit = UnitId::from_name("unit-9").expect("a unit");
    Under { unit, sim: node("sim-9"), perception: node("perception-9") }
}

/// The run with unit 9 in unit A's place.
fn recast(log: &Log) -> Evidence {
    let exception = unit_9();
    let other = |node: NodeId| match node {
        NodeId::UNIT_A => exception.node(),
        NodeId::SIM => exception.sim,
        NodeId::PERCEPTION => exception.perception,
        node if Some(node) == NodeId::UNIT_A.guard() => exception.guard().expect("a unit has one"),
        node => node,
    };
    let mut evidence = log.evidence(Vec::new());
    for w in &mut evidence.entries {
        w.entry.node = other(w.entry.node);
        match &mut w.entry.event {
            Any::Service(Event::Displayed { unit, report, .. }) => {
                (*unit, report.node) = (exception.unit, other(report.node));
            }
            Any::Service(Event::Accepted { record, peer, .. }) => {
                (record.node, *peer) = (other(record.node), exception.peer())
            }
            Any::Instrument(Note::Truth { unit, .. }) => *unit = exception.unit,
            Any::Instrument(Note::MouthSaw { reader, .. }) => *reader = other(*reader),
            Any::Instrument(Note::Associated { peer, .. }) if *peer == Under::A.peer() => *peer = exception.peer(),
            _ => {}
        }
    }
    evidence.under = exception;
    evidence
}

/// Class and findings, with the unit's name left out.
fn answer(verdict: &Verdict) -> (String, Vec<String>) {
    let plain = |found: &Finding| {
        let name = found.message.replace("unit-9", "unit").replace("unit-a", "unit");
        format!("{:?} {} {name}", found.property, found.at_us)
    };
    (format!("{:?}", verdict.outcome), verdict.findings.iter().map(plain).collect())
}

#[test]
fn another_unit_under_test_is_judged_alike() {
    let mut held = Log::whole();
    held.thermal_fault(5000, 6000).cut_display(5300).transition(
        5300,
        Mode::PrepareToAct,
        Mode::Degraded,
        Cause::Lost(Guard::Thermal),
    );
    let mut late = Log::whole();
    late.thermal_fault(5000, 9000);
    let mut unordered = Log::whole();
    unordered.transition(5000, Mode::PrepareToAct, Mode::Ready, Cause::Operator);
    for (name, log) in [("whole", Log::whole()), ("held", held), ("late", late), ("unordered", unordered)] {
        let (first, other) = (judge(&log.evidence(Vec::new())), judge(&recast(&log)));
        assert_eq!(answer(&first), answer(&other), "{name}");
    }
}

/// The check above can fail: a judge that still looks at unit A finds no receipt of this fault.
#[test]
fn fault_at_another_unit_is_none_of_a() {
    let mut log = Log::whole();
    log.thermal_fault(5000, 9000);
    let evidence = Evidence { under: Under::A, ..recast(&log) };
    assert_ne!(answer(&judge(&evidence)), answer(&judge(&log.evidence(Vec::new()))));
}
