//! Controls: no attack, an attack that did not arrive, and a claimed attack.

use evidence::Witnessed;
use evidence::trial::Outcome;
use ground_truth::{Any, Note};
use holdsafe_tests::shipped;
use oracle::judge;
use wire::event::{Account, Event};
use wire::feed::CommandStage;
use wire::id::NodeId;

use crate::SEEDS;

#[test]
fn null_attack_trips_nothing_and_completes_the_mission() {
    for run in shipped("nominal").expect(SEEDS) {
        let acts = run
            .evidence
            .entries
            .iter()
            .filter(|w| matches!(w.entry.event, Any::Instrument(Note::PlantAct { .. })))
            .count();
        assert_eq!(acts, 1, "{:?}", run.verdict.transitions);
    }
}

/// A lossy link is a condition, not an attack: its cost is a false trip.
#[test]
fn hold_by_link_loss_is_a_false_trip() {
    let mut ready = shipped("nominal");
    ready.scenario = ready.scenario.soak(60.0, 0.35);
    let verdicts = (1..=8).map(|seed| ready.run(seed).verdict);
    let held: Vec<_> = verdicts.filter(|v| v.transitions.iter().any(|t| t.to == "HOLD_SAFE")).collect();
    assert!(held.len() >= 3, "loss brought about {} holds", held.len());
    for verdict in held {
        assert_eq!(verdict.outcome, Outcome::FalseTrip, "{:?}", verdict.transitions);
        assert!(verdict.false_trips > 0 && verdict.zero.is_none());
    }
}

/// The log of a run without the attack gets the adversary's claims from the same run with it. They name the right
/// streams and places, and are all untrue.
#[test]
fn claimed_stream_attack_has_no_receipt() {
    for name in ["command_stall", "command_cut", "command_corrupt"] {
        let mut ready = shipped(name);
        let attacked = ready.run(1);
        assert!(attacked.verdict.receipt, "{name}");
        let s = &mut ready.scenario;
        (s.stall, s.cut, s.stream_corrupt) = Default::default();
        let mut quiet = ready.run(1);
        assert!(quiet.verdict.zero.is_none(), "{name}");
        let claims = attacked
            .evidence
            .entries
            .iter()
            .filter(|w| matches!(w.entry.event, Any::Instrument(Note::Tampered { .. })));
        quiet.evidence.entries.extend(claims.copied());
        quiet.evidence.entries.sort_by_key(|w| w.at);
        quiet.evidence.planned = attacked.evidence.planned;
        let verdict = judge(&quiet.evidence);
        assert_eq!((verdict.receipt, verdict.outcome), (false, Outcome::Invalid), "{name}: {:?}", verdict.findings);
    }
}

/// Live, the gateway sends an order and reports it, and the broker may be quicker to say that it kept it.
#[test]
fn sender_may_report_just_after_the_broker() {
    let run = shipped("command_splice").run(1);
    for (lag, receipt) in [(0, true), (20_000, true), (100_000, false)] {
        let mut evidence = run.evidence.clone();
        let sent =
            |w: &&mut Witnessed| matches!(w.entry.event, Any::Service(Event::Staged { stage: CommandStage::Sent, .. }));
        evidence.entries.iter_mut().filter(sent).for_each(|w| w.at += lag);
        evidence.entries.sort_by_key(|w| w.at);
        assert_eq!(judge(&evidence).receipt, receipt, "{lag} us later");
    }
}

/// Datagrams of another program on the same host to gateway, unit or relay: reported, and neither in the class nor in
/// the accounts.
#[test]
fn outsider_datagrams_leave_class_and_accounts_unchanged() {
    for name in ["nominal", "delay"] {
        let run = shipped(name).run(1);
        let mut evidence = run.evidence.clone();
        let (at, last) = (evidence.duration, *evidence.entries.last().expect("entries"));
        for node in [NodeId::CAMPAIGN, NodeId::GATEWAY.guard().unwrap(), NodeId::UNIT_A.guard().unwrap()] {
            let mut entry = last.entry;
            (entry.node, entry.event) = (node, Any::Service(Event::Count { account: Account::Outsiders, n: 7 }));
            evidence.entries.push(Witnessed { at, entry });
        }
        let verdict = judge(&evidence);
        assert_eq!((verdict.outcome, &verdict.findings), (run.verdict.outcome, &run.verdict.findings), "{name}");
        let trial = oracle::judged::trial(1, Default::default(), &evidence, &verdict);
        let names: Vec<_> = trial.outsiders.iter().map(|(at, n)| (at.as_str(), *n)).collect();
        assert_eq!(names, [("guard-gateway", 7), ("guard-unit-a", 7), ("relay-telemetry", 7)]);
        // An equal change in an account of the run's own would not balance.
        for w in &mut evidence.entries {
            if let Any::Service(Event::Count { account, .. }) = &mut w.entry.event
                && *account == Account::Outsiders
            {
                *account = Account::Unguarded;
            }
        }
        assert_eq!(judge(&evidence).outcome, Outcome::Invalid, "{name}");
    }
}

#[test]
fn unaccounted_relay_datagram_invalidates_the_run() {
    let run = shipped("nominal").run(1);
    assert_eq!(run.verdict.findings, []);
    for node in [NodeId::GATEWAY, NodeId::UNIT_A] {
        let mut evidence = run.evidence.clone();
        let one_less = |w: &mut Witnessed| {
            if let Any::Service(Event::Count { account: Account::Datagrams, n }) = &mut w.entry.event
                && Some(w.entry.node) == node.guard()
            {
                *n -= 1;
            }
        };
        evidence.entries.iter_mut().for_each(one_less);
        assert_eq!(judge(&evidence).outcome, Outcome::Invalid, "{node}");
    }
}
