//! Row of a judged run, as reports are made of.

use std::collections::BTreeMap;

use evidence::claims::Claims;
use evidence::log::hashes;
use evidence::progress::Progress;
use evidence::trial::{GuestFailure, Knowledge, Outcome, StepRow, Trial};
use evidence::{Evidence, InjectionRow, Micros};
use ground_truth::{Any, GuardVerdict, Note};
use wire::event::{Account, Event, Interface};
use wire::id::NodeId;

use crate::facts::peers;
use crate::verdict::Verdict;

/// Row of a trial, with the `knowledge` that its adversary has. `received`, `accepted` and `dropped` add up the
/// two ends of the telemetry link of the unit under test: the gateway's uplink and the unit's downlink.
pub fn trial(seed: u64, knowledge: Knowledge, evidence: &Evidence, verdict: &Verdict) -> Trial {
    let (log_hash, decision_hash) = hashes(&evidence.entries);
    let mut trial = Trial {
        seed,
        cell: None,
        knowledge,
        steps: Vec::new(),
        outcome: verdict.outcome,
        findings: findings(verdict),
        receipt: verdict.receipt,
        injections: verdict.injections.iter().map(InjectionRow::from).collect(),
        log_hash,
        decision_hash,
        received: 0,
        accepted: 0,
        dropped: BTreeMap::new(),
        guard_refused: BTreeMap::new(),
        outsiders: BTreeMap::new(),
        host_late_ms: None,
        host_stall_ms: None,
        confinement: None,
        host_spoilt_ms: Vec::new(),
        claims: claims(evidence, verdict),
        guest: verdict.guest.clone(),
        mission: Some(verdict.mission.clone()),
        transitions: verdict.transitions.clone(),
        latency_ms: verdict.latency,
        responses: verdict.responses.clone(),
        held: None,
        sim_seconds: evidence.duration as f64 / 1e6,
        false_trips: verdict.false_trips,
        nominal_seconds: verdict.nominal as f64 / 1e6,
        cpu_seconds: 0.0,
    };
    for w in &evidence.entries {
        if let Any::Service(Event::Count { account, n }) = w.entry.event {
            add_account(&mut trial, evidence, w.entry.node, account, n);
        }
        if let Any::Instrument(Note::Step { step, begun: true }) = w.entry.event {
            trial.steps.push(StepRow { step: step.to_string(), t_ms: w.at as f64 / 1000.0 });
        }
        if let Any::Instrument(Note::GuardSaw { verdict, .. }) = w.entry.event
            && verdict != GuardVerdict::Passed
        {
            *trial.guard_refused.entry(verdict.name().to_owned()).or_default() += 1;
        }
    }
    trial
}

/// All findings, in words: broken properties first, then the missing parts of the mission, and where it did not get on.
pub fn findings(verdict: &Verdict) -> Vec<String> {
    let broken = verdict.findings.iter().map(|f| format!("{:?} at {} ms: {}", f.property, f.at_us / 1000, f.message));
    let failure = verdict.guest.as_ref().and_then(|guest| guest.failure.as_ref());
    let failed = failed_guest(failure);
    let arrived = (verdict.outcome == Outcome::Invalid).then(|| undelivered(verdict)).into_iter().flatten();
    let missing = verdict.mission.missing.iter().map(|part| format!("mission: {part}"));
    let asks_progress = matches!(verdict.outcome, Outcome::Stuck | Outcome::Undetected);
    let stuck = verdict.mission.progress.as_ref().filter(|_| asks_progress).and_then(Progress::describe);
    broken.chain(failed).chain(arrived).chain(missing).chain(stuck).collect()
}

/// The injections that did not arrive, each with its obstacle if one is proven.
fn undelivered(verdict: &Verdict) -> impl Iterator<Item = String> {
    verdict.injections.iter().map(InjectionRow::from).filter_map(|row| row.undelivered())
}

fn failed_guest(failure: Option<&GuestFailure>) -> impl Iterator<Item = String> {
    failure
        .map(|GuestFailure { at_ms, fault, reason }| format!("guest: {fault} at {at_ms:.0} ms: {reason}"))
        .into_iter()
}

/// False claims of a teammate, from the first one to the unit's first restriction after it; none where none was made.
fn claims(evidence: &Evidence, verdict: &Verdict) -> Option<Claims> {
    let degraded = verdict.latency.to_degraded.map(|ms| (ms * 1000.0) as Micros);
    let reaction = verdict.zero.zip(degraded).map(|(zero, after)| zero + after);
    Some(peers::claims(evidence, reaction)).filter(|claims| claims.said > 0)
}

fn add_account(trial: &mut Trial, evidence: &Evidence, node: NodeId, account: Account, n: u64) {
    let of_unit_link = |interface: Interface| {
        (node == NodeId::GATEWAY && interface == Interface::Uplink)
            || (node == evidence.under.node() && interface == Interface::Downlink)
    };
    match account {
        Account::Received(i) if of_unit_link(i) => trial.received += n,
        Account::Accepted(i) if of_unit_link(i) => trial.accepted += n,
        Account::Refused(i, reason) if of_unit_link(i) && n > 0 => {
            *trial.dropped.entry(reason.name().to_owned()).or_default() += n;
        }
        Account::Received(_)
        | Account::Accepted(_)
        | Account::Refused(..)
        | Account::Sent
        | Account::RelayIn(_)
        | Account::RelayOut(_)
        | Account::RelayDropped(_)
        | Account::RelayAdded(_)
        | Account::RelayStranger
        | Account::GuardIn
        | Account::GuardRefused
        | Account::Delivered
        | Account::Discarded
        | Account::Handshake
        | Account::KernelDropped
        | Account::RelayUnsent(_)
        | Account::SentDirect
        | Account::Datagrams
        | Account::Unguarded => {}
        // The launcher reports those of the relay.
        Account::Outsiders if n > 0 => {
            let receiver = if node == NodeId::CAMPAIGN { NodeId::RELAY_TELEMETRY } else { node };
            *trial.outsiders.entry(receiver.to_string()).or_default() += n;
        }
        Account::Outsiders => {}
    }
}
