//! A supervision lease that lapsed: which way of the telemetry link failed first, or why the gateway granted nothing.
//!
//! The gateway grants while it hears the unit and while no HOLD is unacknowledged. So a lapse is told apart by what each
//! end went on accepting: after the uplink fails grants stop *Tf* later, after a HOLD at once, and after the downlink fails
//! the gateway still hears the unit.

use wire::command::CommandKind;
use wire::event::{Event, Interface};
use wire::feed::CommandStage;
use wire::id::{CommandId, NodeId, PeerId};
use wire::mode::Because;

use super::origin::{from, stages};
use super::{Change, Log, Origin, Place, Stage};
use crate::oracle::Micros;

/// What two ends may differ by that fail at once: a period and what a record takes; less than *Tf* by as much.
const SLACK: Micros = 150_000;
/// So many records at once are a backlog: whoever took them had not run.
const BACKLOG: usize = 3;
/// Within so little time they count as at once.
const AT_ONCE: Micros = 5_000;

/// Why there is no lease.
pub(super) fn lease(log: &Log, change: &Change) -> Origin {
    // The last grant that was accepted; everything accepted later was none.
    let granted = if let Because::Silence(stamp) = change.because { change.on_trace(stamp) } else { 0 };
    if let Some(origin) = held(log, change, granted) {
        return origin;
    }
    let period = log.bounds.telemetry_period_ms * 1000;
    let freshness = log.bounds.freshness_ms * 1000;
    let heard = log.accepted(NodeId::GATEWAY, Interface::Uplink, PeerId::UNIT_A, 0, change.at);
    let last_heard = heard.last().copied().unwrap_or(0);
    let late_up = refused_up(log, last_heard.saturating_sub(SLACK), change.at);
    let late_down = refused_down(log, granted, change.at);
    if last_heard + freshness <= granted + SLACK {
        // Grants stopped because nothing of the unit had been accepted for *Tf*.
        return uplink(log, change, last_heard, &late_up).refusing(NodeId::UNIT_A, &late_down);
    }
    if last_heard > granted + period + SLACK || !late_up.is_empty() && !late_down.is_empty() {
        return downlink(granted, &late_down).refusing(NodeId::GATEWAY, &late_up);
    }
    if late_up.is_empty()
        && late_down.is_empty()
        && let Some(origin) = no_gateway(log, change, last_heard.max(granted))
    {
        return origin;
    }
    let lasted = (change.at - granted.min(change.at)) / 1000;
    let what = match lasted + period / 1000 < log.bounds.lease_ms {
        true => format!("grants come so late that the last one lasts {lasted} ms"),
        false => "nothing passes between unit and gateway, either way".to_owned(),
    };
    let origin = from(NodeId::UNIT_A, Place::Telemetry, granted, what);
    origin.refusing(NodeId::UNIT_A, &late_down).refusing(NodeId::GATEWAY, &late_up)
}

fn uplink(log: &Log, change: &Change, since: Micros, refused: &[(Micros, String)]) -> Origin {
    let what = match refused.is_empty() {
        true => "the gateway hears nothing of the unit",
        false => "the gateway accepts nothing of the unit",
    };
    let limit = log.bounds.freshness_ms;
    let stopped = (since + limit * 1000).min(change.at);
    from(NodeId::GATEWAY, Place::Uplink, since, what).refusing(NodeId::GATEWAY, refused).with(
        Stage::Health,
        stopped,
        NodeId::GATEWAY,
        format!("no grant to a unit of which nothing newer than {limit} ms was accepted"),
    )
}

fn downlink(granted: Micros, refused: &[(Micros, String)]) -> Origin {
    let what = match refused.is_empty() {
        true => "the unit hears no grant, while the gateway hears the unit",
        false => "the unit accepts no grant, while the gateway hears the unit",
    };
    from(NodeId::UNIT_A, Place::Downlink, granted, what).refusing(NodeId::UNIT_A, refused)
}

/// A HOLD that the unit did not carry out: the gateway grants nothing until it does.
fn held(log: &Log, change: &Change, granted: Micros) -> Option<Origin> {
    let near = |at: Micros| at + SLACK >= granted && at <= granted + SLACK;
    let (sent, id) = log.by(NodeId::CONSOLE).filter(|w| w.at <= change.at).find_map(|w| match w.entry.event {
        Event::Intended { command, kind: CommandKind::Hold } => {
            let sent = stages(log, command, change.at).into_iter().find(|(_, stage)| *stage == CommandStage::Sent)?;
            near(sent.0).then_some((sent.0, command))
        }
        _ => None,
    })?;
    let origin = from(NodeId::GATEWAY, Place::CommandPlane, sent, format!("HOLD {id} was sent and is not carried out"));
    let asked = log.last(NodeId::CONSOLE, sent, |event| given(event, id));
    let origin = match asked {
        Some((at, ())) => origin.with(Stage::Cause, at, NodeId::CONSOLE, format!("{} asked for a HOLD", id.operator)),
        None => origin,
    };
    Some(origin.with(Stage::Health, sent, NodeId::GATEWAY, "no grant while a HOLD is unacknowledged"))
}

fn given(event: &Event, id: CommandId) -> Option<()> {
    matches!(event, Event::Intended { command, .. } if *command == id).then_some(())
}

/// Signs that the gateway and not the link is silent: it is not there to close its account, the broker lost it, or it takes a
/// backlog when it runs again.
fn no_gateway(log: &Log, change: &Change, last: Micros) -> Option<Origin> {
    let ends = log.entries().last().map_or(change.at, |w| w.at);
    let closed = log.by(NodeId::GATEWAY).any(|w| matches!(w.entry.event, Event::Count { .. }));
    let others =
        log.entries().iter().any(|w| w.entry.node != NodeId::GATEWAY && matches!(w.entry.event, Event::Count { .. }));
    let lost = log.first(NodeId::BROKER, last, |event| match event {
        Event::Session { peer: PeerId::GATEWAY, open: false } => Some(()),
        _ => None,
    });
    let what = if !closed && others {
        "the gateway wrote nothing more, and closed no account"
    } else if lost.is_some_and(|(at, ())| at <= change.at && at < ends) {
        "the broker lost the gateway, and the unit hears nothing of it"
    } else if backlog(log, change.at) {
        "the gateway wrote nothing, and later took a backlog at once"
    } else {
        return None;
    };
    Some(from(NodeId::GATEWAY, Place::Gateway, last, what))
}

fn backlog(log: &Log, from: Micros) -> bool {
    let judged = log.by(NodeId::GATEWAY).filter(|w| w.at > from).filter(|w| match w.entry.event {
        Event::Accepted { at: Interface::Uplink, peer, .. } => peer == PeerId::UNIT_A,
        Event::Refused { at: Interface::Uplink, peer, .. } => peer == Some(PeerId::UNIT_A),
        _ => false,
    });
    let judged: Vec<Micros> = judged.map(|w| w.at).take(BACKLOG).collect();
    matches!(judged[..], [first, .., last] if judged.len() == BACKLOG && last - first <= AT_ONCE)
}

fn refused_up(log: &Log, from: Micros, to: Micros) -> Vec<(Micros, String)> {
    log.refused(NodeId::GATEWAY, |at, peer| at == Interface::Uplink && peer == Some(PeerId::UNIT_A), from, to)
}

fn refused_down(log: &Log, from: Micros, to: Micros) -> Vec<(Micros, String)> {
    log.refused(NodeId::UNIT_A, |at, peer| at == Interface::Downlink && peer == Some(PeerId::GATEWAY), from, to)
}
