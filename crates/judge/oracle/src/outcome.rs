//! The one class of a trial: the first that matches, from UNSAFE down to NOMINAL.
//!
//! The second judge, `tools/judge/verdict.py`, has the same rule in another language and changes with it.

use evidence::trial::{GuestFailure, GuestRow, Latency, Outcome};
use evidence::{Evidence, Fate, Injection, Micros};
use ground_truth::{Any, GuardVerdict, Note, Sight};
use wire::guest::Fault;
use wire::mode::{Cause, Mode};

use crate::facts::guest::EngagedGuest;
use crate::facts::timeline::{Change, Timeline, is_nominal};
use crate::facts::{Facts, core_input, guest};
use crate::mission;
use crate::properties::{self, Breach, Finding, Property, finding, process_fault};
use crate::receipts::{Arrival, Receipts, disguise, guest_bus};
use crate::verdict::Verdict;

/// Puts the verdict together.
pub(super) fn verdict(facts: &Facts, receipts: &Receipts, mut findings: Vec<Finding>) -> Verdict {
    let Facts { evidence, timeline, .. } = facts;
    if let Some(longest) = stalled(evidence) {
        findings.push(finding(Property::P10, evidence.duration, overslept(longest, evidence.stall_limit)));
    }
    let zero = receipts.zero;
    let trips = false_trips(evidence, timeline, zero);
    let mission = mission::compared(evidence, timeline, zero);
    let outcome = match class_of_trial(facts, receipts, &findings, trips) {
        // A broken property needs no mission, and a false trip may be the reason that there was none. The other classes
        // show nothing without it.
        found @ (Outcome::Unsafe | Outcome::GuestFailed | Outcome::Late | Outcome::FalseTrip) => found,
        _ if !mission.missing.is_empty() => Outcome::Invalid,
        Outcome::Nominal if mission.is_stuck() => Outcome::Stuck,
        class => class,
    };
    let bare = guest::is_bare(evidence);
    Verdict {
        outcome,
        receipt: receipts.complete,
        injections: injections(facts, receipts),
        zero,
        latency: zero.map(|zero| latency(evidence, timeline, zero)).unwrap_or_default(),
        transitions: timeline.transition_rows(),
        false_trips: trips,
        nominal: timeline.nominal_until(evidence.duration),
        mission,
        responses: if bare { Vec::new() } else { process_fault::responses(facts) },
        guest: guest_row(evidence),
        findings,
    }
}

fn class_of_trial(facts: &Facts, receipts: &Receipts, findings: &[Finding], trips: u32) -> Outcome {
    let evidence = facts.evidence;
    let broken = |breach: Breach| findings.iter().any(|f| f.property.row().breach == breach);
    // The findings of a tampered log are still listed; they are no evidence.
    if !evidence.log_flaws.is_empty() {
        return Outcome::Invalid;
    }
    // A violated safety property counts without a receipt: the witness of the violation needs no cause.
    if broken(Breach::Unsafe) {
        return Outcome::Unsafe;
    }
    if let Some(failure) = guest::guest_failure(evidence) {
        return class_of_failed_guest(evidence, receipts, findings, &failure);
    }
    // A missed bound is no evidence of an attack that may not have arrived, or on a host that stalled.
    if !receipts.complete || broken(Breach::NoEvidence) {
        return Outcome::Invalid;
    }
    if broken(Breach::Late) {
        return Outcome::Late;
    }
    if trips > 0 {
        return Outcome::FalseTrip;
    }
    receipts.zero.map_or(Outcome::Nominal, |zero| answer_of_platform(evidence, &facts.timeline, zero))
}

/// Class of a trial with a failed guest. The failure decides it, unless a bound was missed before, or the host may be
/// to blame.
fn class_of_failed_guest(
    evidence: &Evidence,
    receipts: &Receipts,
    findings: &[Finding],
    failure: &GuestFailure,
) -> Outcome {
    let earlier = |f: &&Finding| f.at_us as f64 / 1000.0 <= failure.at_ms;
    let late = |f: &Finding| f.property.row().breach == Breach::Late;
    // A bound that was missed before the failure is no consequence of it.
    if receipts.complete && findings.iter().filter(earlier).any(late) {
        Outcome::Late
    } else if may_be_the_hosts(failure) && stalled(evidence).is_some() {
        Outcome::Invalid
    } else {
        Outcome::GuestFailed
    }
}

/// Answer of the platform from `zero` on: the mode in which it ended, or a refusal or an alarm.
fn answer_of_platform(evidence: &Evidence, timeline: &Timeline, zero: Micros) -> Outcome {
    if guest::is_bare(evidence) {
        let unmoved =
            || if refused_or_alarmed(evidence, timeline, zero) { Outcome::Rejected } else { Outcome::Undetected };
        return guest::stands_from(evidence, timeline, zero).map_or_else(unmoved, |_| Outcome::HoldSafe);
    }
    let reached = |mode: Mode| timeline.first_change(zero, |c| c.to == mode && c.cause != Cause::Operator).is_some();
    // For a dead unit only its plant can be believed.
    if reached(Mode::HoldSafe) || plant_stopped_without_unit(evidence, timeline) {
        Outcome::HoldSafe
    } else if reached(Mode::Degraded) {
        Outcome::Degraded
    } else if refused_or_alarmed(evidence, timeline, zero) {
        Outcome::Rejected
    } else {
        Outcome::Undetected
    }
}

/// Fate of each planned injection.
fn injections(facts: &Facts, receipts: &Receipts) -> Vec<Injection> {
    let noticed =
        |arrived_at: Micros| answer_of_platform(facts.evidence, &facts.timeline, arrived_at) != Outcome::Undetected;
    let fate = |arrival: Arrival| match arrival {
        Some(Ok(arrived_at)) => Fate::Delivered { at: arrived_at, noticed: noticed(arrived_at) },
        Some(Err(mask)) => Fate::Masked(mask),
        None => Fate::NotProven,
    };
    receipts.arrivals.iter().map(|(plan, arrival)| Injection { plan: *plan, fate: fate(*arrival) }).collect()
}

/// True if there was a refusal of a boundary after the injection: by a service by name, by the guard, or by the secure layer;
/// perception saw through a disguise; the end of a guest's bus refused an attack on it; or the display showed the operator an alarm.
fn refused_or_alarmed(evidence: &Evidence, timeline: &Timeline, zero: Micros) -> bool {
    use wire::event::{Account, Event, Freshness, ShownAs};
    let by_service = timeline.refused.iter().any(|(refused_at, _)| *refused_at >= zero);
    let in_entries = evidence.entries.iter().any(|w| match w.entry.event {
        Any::Instrument(Note::GuardSaw { verdict, .. }) => w.at >= zero && verdict != GuardVerdict::Passed,
        Any::Instrument(Note::StreamSaw { sight: Sight::Refused, .. }) => w.at >= zero,
        Any::Service(Event::CommandShown { shown: ShownAs::NotAcknowledged, .. } | Event::LossesShown { .. }) => {
            w.at >= zero
        }
        // After the end every sender is silent, and the display shows the unit as stale without an attack.
        Any::Service(Event::Displayed { unit, freshness: Freshness::Stale | Freshness::Lost, .. })
            if unit == evidence.under.unit =>
        {
            (zero..evidence.duration).contains(&w.at)
        }
        // An account has no times: records that the secure layer discarded count for the whole run.
        Any::Service(Event::Count { account: Account::Discarded, n }) => n > 0,
        _ => false,
    });
    by_service
        || in_entries
        || core_input::insider_refused_on_bus(evidence, zero)
        || disguise::seen_through(evidence, zero)
        || guest_bus::refused(evidence, zero)
}

/// Losses of authority and restrictions before an injection arrived, other than by the operator; and false statements
/// of a bare guest that it is safe.
fn false_trips(evidence: &Evidence, timeline: &Timeline, zero: Option<Micros>) -> u32 {
    // Without a receipt the trial is INVALID in any case: all of its restrictions are listed.
    let until = if evidence.planned.is_empty() { Micros::MAX } else { zero.unwrap_or(Micros::MAX) };
    let tripped = |c: &&Change| {
        c.at < until
            && is_nominal(c.from)
            && matches!(c.to, Mode::Degraded | Mode::HoldSafe)
            && c.cause != Cause::Operator
    };
    let lost_authority = |c: &&Change| {
        c.at < until && c.from == Mode::PrepareToAct && c.to == Mode::Ready && matches!(c.cause, Cause::Lost(_))
    };
    let changes = timeline.changes.iter();
    changes.filter(|c| tripped(c) || lost_authority(c)).count() as u32 + guest::false_alarms(evidence, timeline, until)
}

fn latency(evidence: &Evidence, timeline: &Timeline, zero: Micros) -> Latency {
    let delay_ms = |time: Micros| (time - zero) as f64 / 1000.0;
    if guest::is_bare(evidence) {
        let stood = guest::stands_from(evidence, timeline, zero).map(delay_ms);
        return Latency { to_degraded: None, to_hold_safe: stood, to_authority_revoked: None };
    }
    let delay_to = |test: &dyn Fn(&Change) -> bool| timeline.first_change(zero, test).map(|c| delay_ms(c.at));
    let by_loss = |cause: Cause| matches!(cause, Cause::Lost(_) | Cause::Unrecovered(_));
    let revoked = || delay_to(&|c| c.from == Mode::PrepareToAct && c.to != Mode::PrepareToAct && by_loss(c.cause));
    Latency {
        to_degraded: delay_to(&|c| matches!(c.to, Mode::Degraded | Mode::HoldSafe) && c.cause != Cause::Operator),
        to_hold_safe: delay_to(&|c| c.to == Mode::HoldSafe && c.cause != Cause::Operator),
        to_authority_revoked: timeline.held_authority_at(zero).then(revoked).flatten(),
    }
}

/// Remark on a host whose longest stall, microseconds, is above its limit.
fn overslept(stall: Micros, limit: Micros) -> String {
    format!(
        "the host overslept by {} ms, at most {} ms are allowed: nothing is said about the platform; end other work or use \
         --jobs 1, and repeat with --retries 2",
        stall / 1000,
        limit / 1000
    )
}

/// Longest stall of the host, microseconds, if above its limit.
pub fn stalled(evidence: &Evidence) -> Option<Micros> {
    let stalls = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Instrument(Note::Stalled { by }) => Some(by.0),
        _ => None,
    });
    stalls.max().filter(|longest| *longest > evidence.stall_limit)
}

/// True if the unit under test was killed and its plant stands without a lease.
fn plant_stopped_without_unit(evidence: &Evidence, timeline: &Timeline) -> bool {
    evidence.killed.contains(&evidence.under.node()) && timeline.ends_at_rest_unleased()
}

/// True if a host that overslept may be the cause that the guest did not start or answer.
fn may_be_the_hosts(failure: &GuestFailure) -> bool {
    [Fault::Silent, Fault::NotStarted].map(Fault::name).contains(&failure.fault.as_str())
}

/// Row of the guest in a trial, with the properties that are not judged of it.
fn guest_row(evidence: &Evidence) -> Option<GuestRow> {
    let EngagedGuest { name, bare, .. } = guest::engaged_guest(evidence)?;
    let (steps, limited) = guest::closing_account(evidence).unwrap_or_default();
    let without_place = !guest::states_place(evidence);
    let not_judged = properties::not_judged_of_bare_guest()
        .chain(without_place.then_some(properties::STATED_PLACE_NOT_JUDGED))
        .filter(|_| bare)
        .map(|(part, reason)| format!("{part}: {reason}"))
        .collect();
    Some(GuestRow { name, bare, steps, limited, failure: guest::guest_failure(evidence), not_judged })
}
