//! The one class of a trial: the first that matches, from UNSAFE down to NOMINAL.
//!
//! The second judge, `tools/judge/verdict.py`, has the same rule in another language and changes with it.

use evidence::trial::{GuestFailure, Latency, Outcome};
use evidence::{Evidence, Fate, Finding, Injection, Mask, Micros, Property, Verdict};
use instrument::{Any, GuardVerdict, Note, Sight};
use wire::mode::{Cause, Mode};

use super::arrived::Receipt;
use super::finding;
use super::timeline::{Change, Timeline};
use super::{delivery, disguise, guest, mission, process_fault};

/// Puts the verdict together.
pub(super) fn verdict(evidence: &Evidence, line: &Timeline, receipt: Receipt, mut findings: Vec<Finding>) -> Verdict {
    if let Some(by) = stalled(evidence) {
        findings.push(finding(Property::P10, evidence.duration, overslept(by, evidence.stall_limit)));
    }
    let zero = receipt.zero;
    let trips = false_trips(evidence, line, zero);
    let mission = mission::of(evidence, line, &receipt);
    let outcome = match class(evidence, line, &receipt, &findings, trips) {
        // What was found stands without a mission, and a trip tells why there was none; the rest shows nothing.
        found @ (Outcome::Unsafe | Outcome::GuestFailed | Outcome::Late | Outcome::FalseTrip) => found,
        _ if !mission.missing.is_empty() => Outcome::Invalid,
        Outcome::Nominal if mission.is_stuck() => Outcome::Stuck,
        class => class,
    };
    let injections = injections(evidence, line, &receipt);
    Verdict {
        outcome,
        receipt: receipt.whole,
        injections,
        zero,
        latency: zero.map(|zero| latency(evidence, line, zero)).unwrap_or_default(),
        transitions: line.rows(),
        false_trips: trips,
        nominal: line.nominal(evidence.duration),
        mission,
        responses: Vec::new(),
        guest: None,
        findings,
    }
}

fn class(evidence: &Evidence, line: &Timeline, receipt: &Receipt, findings: &[Finding], trips: u32) -> Outcome {
    let broken = |wanted: &[Property]| findings.iter().any(|f| wanted.contains(&f.property));
    use Property::{P1, P2, P3, P4, P5, P6, P7, P8, P9, P10, P11, P12};
    // What a tampered log seems to show is still listed; it says nothing.
    if !evidence.log_flaws.is_empty() {
        return Outcome::Invalid;
    }
    if broken(&[P1, P4, P5, P7, P8, P9, P11, P12]) {
        return Outcome::Unsafe;
    }
    if let Some(failure) = guest::failed(evidence) {
        return of_failed_guest(evidence, receipt, findings, &failure);
    }
    if !receipt.whole || broken(&[P6, P10]) {
        return Outcome::Invalid;
    }
    if broken(&[P2, P3]) {
        return Outcome::Late;
    }
    if trips > 0 {
        return Outcome::FalseTrip;
    }
    receipt.zero.map_or(Outcome::Nominal, |zero| answer(evidence, line, zero))
}

/// A failed guest is the result, unless it was late before, or the host may be to blame.
fn of_failed_guest(evidence: &Evidence, receipt: &Receipt, findings: &[Finding], failure: &GuestFailure) -> Outcome {
    let earlier = |f: &&Finding| f.at_us as f64 / 1000.0 <= failure.at_ms;
    let late = |f: &Finding| matches!(f.property, Property::P2 | Property::P3);
    if receipt.whole && findings.iter().filter(earlier).any(late) {
        Outcome::Late
    } else if guest::is_of_the_host(failure) && stalled(evidence).is_some() {
        Outcome::Invalid
    } else {
        Outcome::GuestFailed
    }
}

/// Answer of the platform from `zero` on: the mode in which it ended, or a refusal or an alarm.
fn answer(evidence: &Evidence, line: &Timeline, zero: Micros) -> Outcome {
    if guest::is_bare(evidence) {
        let unmoved = || if refused(evidence, line, zero) { Outcome::Rejected } else { Outcome::Undetected };
        return guest::stands_from(evidence, line, zero).map_or_else(unmoved, |_| Outcome::HoldSafe);
    }
    let reached = |mode: Mode| line.first_change(zero, |c| c.to == mode && c.cause != Cause::Operator).is_some();
    // Of a dead unit only its plant can be believed.
    if reached(Mode::HoldSafe) || process_fault::stopped_without_its_unit(evidence, line) {
        Outcome::HoldSafe
    } else if reached(Mode::Degraded) {
        Outcome::Degraded
    } else if refused(evidence, line, zero) {
        Outcome::Rejected
    } else {
        Outcome::Undetected
    }
}

/// Fate of each planned injection.
fn injections(evidence: &Evidence, line: &Timeline, receipt: &Receipt) -> Vec<Injection> {
    let fate = |fate: Option<Result<Micros, Mask>>| match fate {
        Some(Ok(at)) => Fate::Delivered { at, noticed: answer(evidence, line, at) != Outcome::Undetected },
        Some(Err(mask)) => Fate::Masked(mask),
        None => Fate::NotProven,
    };
    receipt.plans.iter().map(|(plan, of)| Injection { plan: *plan, fate: fate(*of) }).collect()
}

/// True if there was a refusal of a boundary after the injection: by a service by name, by the guard, or by the secure layer;
/// perception saw through a disguise; or the display told the operator that something is amiss.
fn refused(evidence: &Evidence, line: &Timeline, zero: Micros) -> bool {
    use wire::event::{Account, Event, Freshness, ShownAs};
    let by_service = line.refused.iter().any(|(at, _)| *at >= zero);
    let below = evidence.entries.iter().any(|w| match w.entry.event {
        Any::Instrument(Note::GuardSaw { verdict, .. }) => w.at >= zero && verdict != GuardVerdict::Passed,
        Any::Instrument(Note::StreamSaw { sight: Sight::Refused, .. }) => w.at >= zero,
        Any::Service(Event::CommandShown { shown: ShownAs::NotAcknowledged, .. } | Event::LossesShown { .. }) => {
            w.at >= zero
        }
        // After the end everything falls silent, and the display says so.
        Any::Service(Event::Displayed { unit, freshness: Freshness::Stale | Freshness::Lost, .. })
            if unit == evidence.under.unit =>
        {
            (zero..evidence.duration).contains(&w.at)
        }
        Any::Service(Event::Count { account: Account::Discarded, n }) => n > 0,
        _ => false,
    });
    by_service || below || delivery::refused_on_the_bus(evidence, zero) || disguise::seen_through(evidence, zero)
}

/// Losses of authority or restrictions before anything was injected, other than by the operator; and a bare guest's own word that it is safe.
fn false_trips(evidence: &Evidence, line: &Timeline, zero: Option<Micros>) -> u32 {
    let until = if evidence.planned.is_empty() { Micros::MAX } else { zero.unwrap_or(Micros::MAX) };
    let tripped = |c: &&Change| {
        c.at < until
            && matches!(c.from, Mode::Ready | Mode::PrepareToAct)
            && matches!(c.to, Mode::Degraded | Mode::HoldSafe)
            && c.cause != Cause::Operator
    };
    let lost_authority = |c: &&Change| {
        c.at < until && c.from == Mode::PrepareToAct && c.to == Mode::Ready && matches!(c.cause, Cause::Lost(_))
    };
    let changes = line.changes.iter();
    changes.filter(|c| tripped(c) || lost_authority(c)).count() as u32 + guest::false_alarms(evidence, line, until)
}

fn latency(evidence: &Evidence, line: &Timeline, zero: Micros) -> Latency {
    let after = |at: Micros| (at - zero) as f64 / 1000.0;
    if guest::is_bare(evidence) {
        let stood = guest::stands_from(evidence, line, zero).map(after);
        return Latency { to_degraded: None, to_hold_safe: stood, to_authority_revoked: None };
    }
    let to = |test: &dyn Fn(&Change) -> bool| line.first_change(zero, test).map(|c| after(c.at));
    let by_loss = |cause: Cause| matches!(cause, Cause::Lost(_) | Cause::Unrecovered(_));
    let revoked = || to(&|c| c.from == Mode::PrepareToAct && c.to != Mode::PrepareToAct && by_loss(c.cause));
    Latency {
        to_degraded: to(&|c| matches!(c.to, Mode::Degraded | Mode::HoldSafe) && c.cause != Cause::Operator),
        to_hold_safe: to(&|c| c.to == Mode::HoldSafe && c.cause != Cause::Operator),
        to_authority_revoked: line.authority_at(zero).then(revoked).flatten(),
    }
}

/// Remark on a host that overslept by so many microseconds.
fn overslept(by: Micros, limit: Micros) -> String {
    format!(
        "the host overslept by {} ms, at most {} ms are allowed: nothing is said about the platform; end other work or use \
         --jobs 1, and repeat with --retries 2",
        by / 1000,
        limit / 1000
    )
}

/// The longest time by which the host overslept, microseconds, if above its limit.
pub fn stalled(evidence: &Evidence) -> Option<Micros> {
    let stalls = evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Instrument(Note::Stalled { by }) => Some(by.0),
        _ => None,
    });
    stalls.max().filter(|by| *by > evidence.stall_limit)
}
