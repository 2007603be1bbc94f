//! Obstacles that kept a planned injection from arriving, where it has no receipt: the platform itself, or another attack.
//!
//! An actor's log never proves masking. The absence of a process is proven by the launcher's log and that process's
//! silence; the absence of a message to take hold of by its sender's log, or by the guards'; a fault hidden by
//! another, by the other's receipt; the absence of a link, by the plan of contacts and the silence of the guards at its ends. Where none of
//! that holds for the whole time of the plan, the injection stays without proof.

use evidence::{Evidence, Mask, Micros, Plan, Planned, Takes, Witnessed};
use ground_truth::{Action, Any, FaultKind, Note, Sight, Suspension};
use wire::core::Side;
use wire::event::{Event, Interface};
use wire::feed::CommandStage;
use wire::id::{CommandId, NodeId};

use super::datagram;
use super::window::Window;
use crate::facts::sensor_fault::SensorFault;
use crate::facts::stream::sightings;
use crate::facts::{Facts, Span, contact, link, process};

/// Time for which a plan may have had its conditions without an effect: less than it takes to have any effect (the period of the links is
/// 100 ms).
const NO_EFFECT_WITHIN: Micros = 200_000;
/// Time for which a message may have been on its way to the actor when its time began.
const UNDER_WAY: Micros = 50_000;

/// Actions on datagrams of the link.
const LINK: [Action; 8] = [
    Action::Delay,
    Action::Drop,
    Action::Duplicate,
    Action::Reorder,
    Action::Replay,
    Action::Corrupt,
    Action::Reoriginate,
    Action::Inject,
];

/// Obstacle that kept `plan`, without a receipt, from arriving.
pub(crate) fn obstacle(facts: &Facts, plan: &Plan, window: Window) -> Option<Mask> {
    let evidence = facts.evidence;
    let span = window.span(evidence.duration);
    let no_message = || {
        // An actor that claims a message contradicts its absence: nothing is proven then.
        let takes = plan.needs.takes.filter(|_| !actor_claims(evidence, plan.what, window))?;
        without_message(evidence, takes, span)
    };
    let no_contact = || out_of_contact(evidence, plan.what, span).then_some(Mask::OutOfContact);
    no_contact()
        .or_else(|| without_process(evidence, plan, span))
        .or_else(no_message)
        .or_else(|| hidden_by_fault(plan.what, span, &facts.sensor_faults))
}

/// True for an action on messages of the link between unit and control domain, where its plan of contacts had none and no message came.
fn out_of_contact(evidence: &Evidence, planned: Planned, span: Span) -> bool {
    let on_datagrams = matches!(planned, Planned::Action(action) if LINK.contains(&action));
    let on_link = on_datagrams || matches!(planned, Planned::Stream(_) | Planned::Broker(_));
    let targets = [NodeId::GATEWAY, evidence.under.node()];
    let silent = || {
        targets.iter().all(|target| !link::record_times(evidence, *target).iter().any(|time| is_within(span, *time)))
    };
    on_link
        && contact::contact_gaps(evidence).into_iter().any(|gap| covers_plan(gap, span))
        && silent()
        && !stream_carried(evidence, span)
}

/// True if an end of the command streams saw bytes or a publication come.
fn stream_carried(evidence: &Evidence, span: Span) -> bool {
    sightings(evidence).any(|s| is_within(span, s.at) && matches!(s.sight, Sight::Arrived | Sight::Delivered))
}

/// True if a span has begun in time and lasts for the whole rest of the plan's.
fn covers_plan((from, to): Span, plan: Span) -> bool {
    // Half of a short plan at most: an obstacle that began as the plan ended did not mask it.
    from <= plan.0 + NO_EFFECT_WITHIN.min((plan.1 - plan.0) / 2) && to >= plan.1
}

/// Obstacle, if one of the processes that a plan needs did not live or run for all that time. The stop of one may follow on that of another.
fn without_process(evidence: &Evidence, plan: &Plan, time: Span) -> Option<Mask> {
    let spans_without = |node: NodeId| {
        let spans = match plan.what {
            // A plan does not keep itself from arriving.
            Planned::Suspend(itself) if itself == node => ended_spans(evidence, node),
            Planned::Kill(itself) if itself == node => begun_before(ended_spans(evidence, node), time.0),
            _ => stopped_spans(evidence, node),
        };
        spans.into_iter().map(move |span| (span, node))
    };
    let mut spans: Vec<(Span, NodeId)> = plan.needs.running.iter().flat_map(|node| spans_without(*node)).collect();
    spans.sort_unstable();
    let joined = |i: usize| {
        spans[i..].iter().fold(spans[i].0, |all, (span, _)| match span.0 <= all.1 {
            true => (all.0, all.1.max(span.1)),
            false => all,
        })
    };
    (0..spans.len()).find(|i| covers_plan(joined(*i), time)).map(|i| Mask::Gone(spans[i].1))
}

fn begun_before(spans: Vec<Span>, time: Micros) -> Vec<Span> {
    spans.into_iter().filter(|span| span.0 + UNDER_WAY <= time).collect()
}

/// Times at which the launcher says that a process did not live, and it left no mark.
fn ended_spans(evidence: &Evidence, node: NodeId) -> Vec<Span> {
    let dead = process::dead_spans(evidence, node).into_iter();
    dead.filter(|span| process::left_no_mark(evidence, node, *span)).collect()
}

/// Times at which the launcher says that a process did not live or hung, and it left no mark.
fn stopped_spans(evidence: &Evidence, node: NodeId) -> Vec<Span> {
    let hung = evidence.entries.iter().filter(|w| {
        let hangs = matches!(
            w.entry.event,
            Any::Instrument(Note::Suspended { node: n, how: Suspension::Hang, on: true }) if n == node
        );
        hangs && w.entry.node == NodeId::CAMPAIGN
    });
    let runs_on = |from: Micros| {
        let later = evidence.entries.iter().filter(move |w| w.at > from);
        let goes_on = |w: &&Witnessed| {
            matches!(
                w.entry.event,
                Any::Instrument(Note::Suspended { node: n, on: false, .. }) if n == node
            )
        };
        later.filter(goes_on).map(|w| w.at).next().unwrap_or(evidence.duration)
    };
    let hung = hung.map(|w| (w.at, runs_on(w.at)));
    let hung = hung.filter(|span| process::left_no_mark(evidence, node, *span));
    ended_spans(evidence, node).into_iter().chain(hung).collect()
}

/// True if the actor says that it took hold of a message in that time.
fn actor_claims(evidence: &Evidence, planned: Planned, window: Window) -> bool {
    evidence.entries.iter().filter(|w| window.contains(w.at)).any(|w| match (planned, w.entry.event) {
        (Planned::Action(planned), Any::Instrument(Note::Attack { action, .. })) => {
            action == planned && w.entry.node == NodeId::RELAY_TELEMETRY && !is_dropped(evidence, w)
        }
        (Planned::Stream(planned), Any::Instrument(Note::Tampered { deed, .. })) => {
            deed == planned && w.entry.node == NodeId::RELAY_COMMAND
        }
        (Planned::Broker(planned), Any::Instrument(Note::Attack { action, .. })) => {
            action == planned && w.entry.node == NodeId::INSIDER_BROKER
        }
        (Planned::Feed(_) | Planned::Late(_), Any::Instrument(Note::Withheld { .. })) => {
            w.entry.node == NodeId::INSIDER_GATEWAY
        }
        (Planned::Swallowed, Any::Instrument(Note::Swallowed { .. })) => w.entry.node == NodeId::INSIDER_GATEWAY,
        _ => false,
    })
}

/// True if the relay says that it later dropped the bytes of this claim.
fn is_dropped(evidence: &Evidence, claim: &Witnessed) -> bool {
    let Any::Instrument(Note::Attack { hash: claimed, .. }) = claim.entry.event else { return false };
    let dropped = |w: &Witnessed| {
        matches!(w.entry.event, Any::Instrument(Note::Attack { action: Action::Drop, hash, .. }) if hash == claimed)
            && w.entry.node == NodeId::RELAY_TELEMETRY
    };
    evidence.entries.iter().any(|w| w.at >= claim.at && dropped(w))
}

/// Obstacle, if there was no message to take hold of.
fn without_message(evidence: &Evidence, takes: Takes, span: Span) -> Option<Mask> {
    let since = span.0.saturating_sub(UNDER_WAY);
    match takes {
        Takes::Records(to) => without_records(evidence, to, span),
        Takes::Pieces => {
            let quiet = !was_published(evidence, None, None, (since, span.1)) && !bytes_arrived(evidence, span);
            quiet.then_some(Mask::NothingPublished)
        }
        Takes::Publications { to, asks, ever } => {
            let since = if ever { 0 } else { since };
            (!was_published(evidence, to, asks, (since, span.1))).then_some(Mask::NothingPublished)
        }
        Takes::Orders(asks) => {
            let was_ordered = orders_given(evidence)
                .any(|(given_at, _, kind)| is_within((since, span.1), given_at) && asks.is_none_or(|a| a == kind));
            (!was_ordered).then_some(Mask::NothingAsked)
        }
        Takes::Reports => {
            let accepted = evidence.entries.iter().any(|w| match w.entry.event {
                Any::Service(Event::Accepted { at: Interface::Uplink, record, .. }) => {
                    w.entry.node == NodeId::GATEWAY
                        && record.node == evidence.under.node()
                        && is_within((since, span.1), w.at)
                }
                _ => false,
            });
            (!accepted).then_some(Mask::NoReport)
        }
    }
}

fn is_within((from, to): Span, time: Micros) -> bool {
    (from..=to).contains(&time)
}

/// Orders that the console says an operator gave: time, identity, command.
fn orders_given(evidence: &Evidence) -> impl Iterator<Item = (Micros, CommandId, &'static str)> {
    evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Service(Event::Intended { command, kind, .. }) if w.entry.node == NodeId::CONSOLE => {
            Some((w.at, command, kind.name()))
        }
        _ => None,
    })
}

/// True if a log names a publication on the command plane: the gateway to the unit, the unit's answers, or a rogue.
fn was_published(evidence: &Evidence, to: Option<Side>, asks: Option<&str>, span: Span) -> bool {
    let is_wanted = |command: CommandId| {
        // An order that no operator gave may be of any kind: it counts as a message, so its absence is not proven.
        asks.is_none_or(|asks| orders_given(evidence).all(|(_, id, kind)| id != command || kind == asks))
    };
    evidence.entries.iter().filter(|w| is_within(span, w.at)).any(|w| match w.entry.event {
        Any::Service(Event::Staged { command, stage: CommandStage::Sent }) => {
            to != Some(Side::Server) && w.entry.node == NodeId::GATEWAY && is_wanted(command)
        }
        Any::Service(Event::Executed { command, .. } | Event::Stored { command, .. }) => {
            to != Some(Side::Client) && w.entry.node == evidence.under.node() && is_wanted(command)
        }
        Any::Instrument(Note::Rogue { .. }) => to != Some(Side::Server),
        _ => false,
    })
}

/// True if an ingress at either end of the command streams saw bytes come.
fn bytes_arrived(evidence: &Evidence, span: Span) -> bool {
    sightings(evidence).any(|s| is_within(span, s.at) && s.sight == Sight::Arrived)
}

/// Obstacle, if no record of the link came to the guards that it was on its way to: no session stood yet, or one of the ends or the relay did
/// not run, or the relay dropped the records before.
fn without_records(evidence: &Evidence, to: Option<Side>, span: Span) -> Option<Mask> {
    let targets = [(Side::Server, NodeId::GATEWAY), (Side::Client, evidence.under.node())];
    let mut last = None;
    for (_, target) in targets.into_iter().filter(|(side, _)| to.is_none_or(|to| to == *side)) {
        let times = link::record_times(evidence, target);
        if times.iter().any(|arrived_at| is_within((span.0.saturating_sub(UNDER_WAY), span.1), *arrived_at)) {
            return None;
        }
        last = last.max(times.into_iter().filter(|arrived_at| *arrived_at < span.0).max());
    }
    // No record before the plan either: the ends had not yet begun a session.
    let Some(last) = last else { return Some(Mask::NoSession) };
    let began = (last, last + link::SILENCE);
    let ends = [NodeId::GATEWAY, evidence.under.node(), NodeId::RELAY_TELEMETRY];
    let breaks = |span: &Span| is_within(began, span.0) || covers_plan(*span, began);
    let stopped = ends.into_iter().find(|node| stopped_spans(evidence, *node).iter().any(breaks));
    let dropped = || datagram::receipt(evidence, Action::Drop, Window::from_span(began)).map(|_| Mask::Dropped);
    stopped.map(Mask::Gone).or_else(dropped)
}

/// Obstacle, if a dropout or a freeze of the same sensor arrived and lasted all that time: other faults do not show through.
fn hidden_by_fault(planned: Planned, span: Span, faults: &[SensorFault]) -> Option<Mask> {
    let Planned::Fault(sensor, kind) = planned else { return None };
    let hides = |f: &&SensorFault| {
        f.sensor == sensor && f.kind != kind && matches!(f.kind, FaultKind::Dropout | FaultKind::Freeze)
    };
    let mut hiding = faults.iter().filter(hides);
    hiding.find(|f| covers_plan((f.start, f.end), span)).map(|f| Mask::Hidden(sensor, f.kind))
}
