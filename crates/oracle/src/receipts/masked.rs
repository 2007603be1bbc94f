//! Obstacles that kept a planned injection from arriving, where it has no receipt: the platform itself, or another attack.
//!
//! No injection is masked by an actor's word. The absence of a process is the launcher's word and that process's
//! silence; the absence of a message to take hold of is told by its sender, or by the guards; a fault hidden by
//! another, by the other's receipt; that there was no link, by the plan of contacts and the silence of the guards at its ends. Where none of that holds for the whole time of the plan, it stays without proof.

use evidence::{Evidence, Mask, Micros, Plan, Planned, Takes, Witnessed};
use instrument::{Action, Any, FaultKind, Note, Sight, Suspension};
use wire::core::Side;
use wire::event::{Event, Interface};
use wire::feed::CommandStage;
use wire::id::{CommandId, NodeId};

use crate::arrived::Befallen;
use crate::datagram;
use crate::window::Window;
use crate::{contact, life, link};

/// A span of time.
type Span = (Micros, Micros);

/// Time for which a plan may have had its conditions: less than it takes to have any effect (the period of the links is
/// 100 ms).
const AT_MOST: Micros = 200_000;
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
pub(crate) fn by(evidence: &Evidence, plan: &Plan, window: Window, faults: &[Befallen]) -> Option<Mask> {
    let span = window.span(evidence.duration);
    let idle = || {
        let takes = plan.needs.takes.filter(|_| !claimed(evidence, plan.what, window))?;
        nothing(evidence, takes, span)
    };
    let out = || out_of_contact(evidence, plan.what, span).then_some(Mask::OutOfContact);
    out().or_else(|| gone(evidence, plan, span)).or_else(idle).or_else(|| hidden(plan.what, span, faults))
}

/// True for an action on messages of the link between unit and control domain, where its plan of contacts had none and no message came.
fn out_of_contact(evidence: &Evidence, planned: Planned, span: Span) -> bool {
    let on_datagrams = matches!(planned, Planned::Action(action) if LINK.contains(&action));
    let on_link = on_datagrams || matches!(planned, Planned::Stream(_) | Planned::Broker(_));
    let targets = [NodeId::GATEWAY, evidence.under.node()];
    let silent = || targets.iter().all(|target| !link::came(evidence, *target).iter().any(|at| within(span, *at)));
    on_link && contact::gaps(evidence).into_iter().any(|gap| covers(gap, span)) && silent() && !streamed(evidence, span)
}

/// True if an end of the command streams saw bytes or a publication come.
fn streamed(evidence: &Evidence, span: Span) -> bool {
    let came = |w: &Witnessed| match w.entry.event {
        Any::Instrument(Note::StreamSaw { sight, .. }) => matches!(sight, Sight::Arrived | Sight::Delivered),
        _ => false,
    };
    evidence.entries.iter().any(|w| within(span, w.at) && came(w))
}

/// True if a span has begun in time and lasts for the whole rest of the plan's.
fn covers((from, to): Span, plan: Span) -> bool {
    from <= plan.0 + AT_MOST.min((plan.1 - plan.0) / 2) && to >= plan.1
}

/// The first of the processes that it needs which did not live or run for all that time. One may take over from another.
fn gone(evidence: &Evidence, plan: &Plan, time: Span) -> Option<Mask> {
    let of = |node: NodeId| {
        let spans = match plan.what {
            // What it did itself did not keep it from anything.
            Planned::Suspend(itself) if itself == node => ended(evidence, node),
            Planned::Kill(itself) if itself == node => before(ended(evidence, node), time.0),
            _ => away(evidence, node),
        };
        spans.into_iter().map(move |span| (span, node))
    };
    let mut spans: Vec<(Span, NodeId)> = plan.needs.running.iter().flat_map(|node| of(*node)).collect();
    spans.sort_unstable();
    let joined = |i: usize| {
        spans[i..].iter().fold(spans[i].0, |all, (span, _)| match span.0 <= all.1 {
            true => (all.0, all.1.max(span.1)),
            false => all,
        })
    };
    (0..spans.len()).find(|i| covers(joined(*i), time)).map(|i| Mask::Gone(spans[i].1))
}

fn before(spans: Vec<Span>, time: Micros) -> Vec<Span> {
    spans.into_iter().filter(|span| span.0 + UNDER_WAY <= time).collect()
}

/// Times at which the launcher says that a process did not live, and it left no mark.
fn ended(evidence: &Evidence, node: NodeId) -> Vec<Span> {
    life::dead(evidence, node).into_iter().filter(|span| life::silent(evidence, node, *span)).collect()
}

/// The same, or that it hung.
fn away(evidence: &Evidence, node: NodeId) -> Vec<Span> {
    let hung = evidence.entries.iter().filter(|w| {
        let hangs = |how| how == Suspension::Hang;
        let of = matches!(
            w.entry.event,
            Any::Instrument(Note::Suspended { node: n, how, on: true }) if n == node && hangs(how)
        );
        of && w.entry.node == NodeId::CAMPAIGN
    });
    let on = |from: Micros| {
        let later = evidence.entries.iter().filter(move |w| w.at > from);
        let goes_on = |w: &&Witnessed| {
            matches!(
                w.entry.event,
                Any::Instrument(Note::Suspended { node: n, on: false, .. }) if n == node
            )
        };
        later.filter(goes_on).map(|w| w.at).next().unwrap_or(evidence.duration)
    };
    let hung = hung.map(|w| (w.at, on(w.at)));
    let hung = hung.filter(|span| life::silent(evidence, node, *span));
    ended(evidence, node).into_iter().chain(hung).collect()
}

/// True if the actor says that it took hold of a message in that time.
fn claimed(evidence: &Evidence, planned: Planned, window: Window) -> bool {
    evidence.entries.iter().filter(|w| window.has(w.at)).any(|w| match (planned, w.entry.event) {
        (Planned::Action(of), Any::Instrument(Note::Attack { action, .. })) => {
            action == of && w.entry.node == NodeId::RELAY_TELEMETRY && !is_dropped(evidence, w)
        }
        (Planned::Stream(of), Any::Instrument(Note::Tampered { deed, .. })) => {
            deed == of && w.entry.node == NodeId::RELAY_COMMAND
        }
        (Planned::Broker(of), Any::Instrument(Note::Attack { action, .. })) => {
            action == of && w.entry.node == NodeId::INSIDER_BROKER
        }
        (Planned::Feed(_) | Planned::Late(_), Any::Instrument(Note::Withheld { .. })) => {
            w.entry.node == NodeId::INSIDER_GATEWAY
        }
        (Planned::Swallowed, Any::Instrument(Note::Swallowed { .. })) => w.entry.node == NodeId::INSIDER_GATEWAY,
        _ => false,
    })
}

/// True if the relay says of the same bytes that it then dropped them.
fn is_dropped(evidence: &Evidence, told: &Witnessed) -> bool {
    let Any::Instrument(Note::Attack { hash: of, .. }) = told.entry.event else { return false };
    let dropped = |w: &Witnessed| {
        matches!(w.entry.event, Any::Instrument(Note::Attack { action: Action::Drop, hash, .. }) if hash == of)
            && w.entry.node == NodeId::RELAY_TELEMETRY
    };
    evidence.entries.iter().any(|w| w.at >= told.at && dropped(w))
}

/// Obstacle, if there was no message to take hold of.
fn nothing(evidence: &Evidence, takes: Takes, span: Span) -> Option<Mask> {
    let since = span.0.saturating_sub(UNDER_WAY);
    match takes {
        Takes::Records(to) => no_records(evidence, to, span),
        Takes::Pieces => {
            let quiet = !published(evidence, None, None, (since, span.1)) && !arrived(evidence, span);
            quiet.then_some(Mask::NothingPublished)
        }
        Takes::Publications { to, asks, ever } => {
            let since = if ever { 0 } else { since };
            (!published(evidence, to, asks, (since, span.1))).then_some(Mask::NothingPublished)
        }
        Takes::Orders(asks) => {
            let asked =
                given(evidence).any(|(at, _, kind)| within((since, span.1), at) && asks.is_none_or(|a| a == kind));
            (!asked).then_some(Mask::NothingAsked)
        }
        Takes::Reports => {
            let accepted = evidence.entries.iter().any(|w| match w.entry.event {
                Any::Service(Event::Accepted { at: Interface::Uplink, record, .. }) => {
                    w.entry.node == NodeId::GATEWAY
                        && record.node == evidence.under.node()
                        && within((since, span.1), w.at)
                }
                _ => false,
            });
            (!accepted).then_some(Mask::NoReport)
        }
    }
}

fn within((from, to): Span, at: Micros) -> bool {
    (from..=to).contains(&at)
}

/// Orders that the console says an operator gave: time, identity, command.
fn given(evidence: &Evidence) -> impl Iterator<Item = (Micros, CommandId, &'static str)> {
    evidence.entries.iter().filter_map(|w| match w.entry.event {
        Any::Service(Event::Intended { command, kind, .. }) if w.entry.node == NodeId::CONSOLE => {
            Some((w.at, command, kind.name()))
        }
        _ => None,
    })
}

/// True if there is a word of a publication on the command plane: the gateway to the unit, the unit's answers, or a rogue.
fn published(evidence: &Evidence, to: Option<Side>, asks: Option<&str>, span: Span) -> bool {
    let about =
        |command: CommandId| asks.is_none_or(|asks| given(evidence).all(|(_, id, kind)| id != command || kind == asks));
    evidence.entries.iter().filter(|w| within(span, w.at)).any(|w| match w.entry.event {
        Any::Service(Event::Staged { command, stage: CommandStage::Sent }) => {
            to != Some(Side::Server) && w.entry.node == NodeId::GATEWAY && about(command)
        }
        Any::Service(Event::Executed { command, .. } | Event::Stored { command, .. }) => {
            to != Some(Side::Client) && w.entry.node == evidence.under.node() && about(command)
        }
        Any::Instrument(Note::Rogue { .. }) => to != Some(Side::Server),
        _ => false,
    })
}

/// True if an ingress at either end of the command streams saw bytes come.
fn arrived(evidence: &Evidence, span: Span) -> bool {
    let came = |w: &Witnessed| matches!(w.entry.event, Any::Instrument(Note::StreamSaw { sight: Sight::Arrived, .. }));
    evidence.entries.iter().any(|w| within(span, w.at) && came(w))
}

/// No record of the link came to the guards that it was on its way to: no session stood yet, or since one of the ends or the relay was
/// gone, or since the relay dropped the records before.
fn no_records(evidence: &Evidence, to: Option<Side>, span: Span) -> Option<Mask> {
    let targets = [(Side::Server, NodeId::GATEWAY), (Side::Client, evidence.under.node())];
    let mut last = None;
    for (_, target) in targets.into_iter().filter(|(side, _)| to.is_none_or(|to| to == *side)) {
        let times = link::came(evidence, target);
        if times.iter().any(|at| within((span.0.saturating_sub(UNDER_WAY), span.1), *at)) {
            return None;
        }
        last = last.max(times.into_iter().filter(|at| *at < span.0).max());
    }
    let Some(last) = last else { return Some(Mask::NoSession) };
    let began = (last, last + link::SILENCE);
    let ends = [NodeId::GATEWAY, evidence.under.node(), NodeId::RELAY_TELEMETRY];
    let left =
        ends.into_iter().find(|node| away(evidence, *node).iter().any(|s| within(began, s.0) || covers(*s, began)));
    let dropped = || datagram::receipt(evidence, Action::Drop, Window::between(began)).map(|_| Mask::Dropped);
    left.map(Mask::Gone).or_else(dropped)
}

/// A dropout or a freeze of the same sensor, which arrived and lasted all that time: other faults do not show through.
fn hidden(planned: Planned, span: Span, faults: &[Befallen]) -> Option<Mask> {
    let Planned::Fault(sensor, kind) = planned else { return None };
    let hides = |f: &&Befallen| {
        f.sensor == sensor && f.kind != kind && matches!(f.kind, FaultKind::Dropout | FaultKind::Freeze)
    };
    let mut others = faults.iter().filter(hides);
    others.find(|f| covers((f.start, f.end), span)).map(|f| Mask::Hidden(sensor, f.kind))
}
